//! A real vcan0 for any command: the host's own, or that of a User-mode Linux.
//!
//! User-mode Linux boots as an ordinary process, with the host's files as its root, so a command
//! runs there with the same folder, environment and programs, and needs no rights on the host.
//! It has one slow processor: nothing inside may depend on wall-clock time.

use std::env;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, anyhow, bail};

use crate::process::{self, command, run as run_command, succeeds, target_dir};
use crate::setup;

/// The interface's name, also given to the command as `ANGUILLA_VCAN`.
pub const INTERFACE: &str = "vcan0";

const MODULES: [&str; 4] = ["can-dev.ko", "vcan.ko", "can.ko", "can-raw.ko"];

/// Runs a command beside a vcan0 and returns its exit status.
///
/// # Errors
/// When no vcan0 can be had, or the command can't be started.
pub fn run(words: &[String], variables: &[(&str, String)]) -> Result<u8> {
    if let Some(_interface) = HostInterface::open() {
        let (program, arguments) = words.split_first().context("no command")?;
        let status = Command::new(program)
            .args(arguments)
            .env("ANGUILLA_VCAN", INTERFACE)
            .envs(variables.iter().map(|(name, value)| (name, value)))
            .status()
            .with_context(|| format!("could not start {program}"))?;
        return Ok(status
            .code()
            .and_then(|code| u8::try_from(code).ok())
            .unwrap_or(255));
    }
    Guest::prepare(words, variables)?.run()
}

/// A vcan0 of the host's own kernel, taken down again if it was made here.
struct HostInterface {
    made: bool,
}

impl HostInterface {
    /// Finds or makes the interface.
    fn open() -> Option<Self> {
        let up = ["link", "set", INTERFACE, "up"];
        let ip = process::find("ip")?;
        if Path::new("/sys/class/net").join(INTERFACE).exists() {
            let is_up = fs::read_to_string("/sys/class/net/vcan0/flags")
                .is_ok_and(|flags| flags.trim_end().ends_with(['1', '3', '5', '7', '9']));
            return (is_up || succeeds(command(&ip).args(up))).then_some(Self { made: false });
        }
        if let Some(modprobe) = process::find("modprobe") {
            succeeds(command(modprobe).arg("vcan"));
        }
        if !succeeds(command(&ip).args(["link", "add", "dev", INTERFACE, "type", "vcan"])) {
            return None;
        }
        let interface = Self { made: true };
        succeeds(command(&ip).args(up)).then_some(interface)
    }
}

impl Drop for HostInterface {
    fn drop(&mut self) {
        if self.made {
            succeeds(command("ip").args(["link", "del", INTERFACE]));
        }
    }
}

/// One boot of a User-mode Linux, with its files in a folder of its own.
struct Guest {
    kernel: PathBuf,
    folder: PathBuf,
    /// What is loaded before the C library where the processor's state is larger than the kernel knows.
    preload: Option<PathBuf>,
}

impl Guest {
    /// Writes the guest's init script.
    fn prepare(words: &[String], variables: &[(&str, String)]) -> Result<Self> {
        if process::find("linux.uml").is_none() && setup::can_use_apt() {
            setup::install_packages(&["user-mode-linux", "kmod", "iproute2"])?;
        }
        let Some(kernel) = process::find("linux.uml") else {
            bail!(
                "this host can't make a vcan0 and has no User-mode Linux; on Debian: \
                 apt-get install user-mode-linux kmod iproute2 can-utils"
            );
        };
        let folder = target_dir()
            .join("vcan")
            .join(std::process::id().to_string());
        fs::create_dir_all(&folder)?;
        let preload = preload(&folder)?;
        let guest = Self {
            kernel,
            folder,
            preload,
        };
        fs::write(guest.file("environment"), environment(variables))?;
        fs::write(guest.file("init"), guest.script(words)?)?;
        for name in ["stdout", "stderr"] {
            File::create(guest.file(name))?;
        }
        run_command(
            command("chmod")
                .args(["-R", "go-rwx,u+x"])
                .arg(&guest.folder),
        )?;
        Ok(guest)
    }

    /// Returns the path of one of the guest's files.
    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes what the guest does between its boot and its end.
    fn script(&self, words: &[String]) -> Result<String> {
        let modules = find_modules(Path::new("/usr/lib/uml/modules"))?;
        let insmod = process::find("insmod").context("no insmod; Debian's package is kmod")?;
        let ip = process::find("ip").context("no ip; Debian's package is iproute2")?;
        let (insmod, ip) = (quote(insmod.display()), quote(ip.display()));
        let mut script = String::from(
            "#!/bin/sh\n\
             mount -t proc proc /proc\n\
             mount -t sysfs sysfs /sys\n\
             mount -t tmpfs tmpfs /run\n\
             # What is written reaches the host at once, so that output is seen as it comes.\n\
             echo 5 >/proc/sys/vm/dirty_writeback_centisecs\n\
             echo 5 >/proc/sys/vm/dirty_expire_centisecs\n\
             # Who is slow to receive frames loses none.\n\
             echo 16777216 >/proc/sys/net/core/rmem_max\n\
             echo 16777216 >/proc/sys/net/core/rmem_default\n",
        );
        for module in modules {
            script += &format!("{insmod} {}\n", quote(module.display()));
        }
        script += &format!(
            "{ip} link add dev {INTERFACE} type vcan && {ip} link set {INTERFACE} up\n\
             {ip} link set lo up\n\
             . {}\n\
             cd {}\n",
            quote(self.file("environment").display()),
            quote(env::current_dir()?.display()),
        );
        let line = words.iter().map(quote).collect::<Vec<_>>().join(" ");
        script += &format!(
            "{line} >>{} 2>>{} </dev/null\n\
             echo $? >{}\n\
             sync\n\
             halt -f 2>/dev/null || echo o >/proc/sysrq-trigger\n",
            quote(self.file("stdout").display()),
            quote(self.file("stderr").display()),
            quote(self.file("status").display()),
        );
        Ok(script)
    }

    /// Returns the command that boots; the guest ends with this program, also where that is killed.
    fn command(&self) -> Command {
        match process::find("setpriv") {
            Some(setpriv) => {
                let mut kernel = Command::new(setpriv);
                kernel.args(["--pdeathsig", "TERM"]).arg(&self.kernel);
                kernel
            }
            None => Command::new(&self.kernel),
        }
    }

    /// Boots, shows what the command writes, and returns its exit status.
    fn run(&self) -> Result<u8> {
        let log = File::create(self.file("kernel.log"))?;
        let mut kernel = self.command();
        if let Some(library) = &self.preload {
            kernel.env("LD_PRELOAD", library);
        }
        let mut kernel = kernel
            .args([
                "mem=1G",
                "root=/dev/root",
                "rootfstype=hostfs",
                "rootflags=/",
                "rw",
            ])
            .arg(format!("init={}", self.file("init").display()))
            .args(["con=null", "con0=null,fd:1"])
            .stdin(Stdio::null())
            .stderr(log.try_clone()?)
            .stdout(log)
            .spawn()
            .context("could not start User-mode Linux")?;
        self.show_output(&mut kernel)?;
        let status = fs::read_to_string(self.file("status")).unwrap_or_default();
        match status.trim().parse() {
            Ok(status) => {
                fs::remove_dir_all(&self.folder)?;
                Ok(status)
            }
            Err(_) => Err(anyhow!(
                "User-mode Linux ended before the command did; see {}",
                self.file("kernel.log").display()
            )),
        }
    }

    /// Copies what the command writes until the guest has ended.
    fn show_output(&self, kernel: &mut Child) -> Result<()> {
        let mut out = File::open(self.file("stdout"))?;
        let mut err = File::open(self.file("stderr"))?;
        loop {
            let ended = kernel.try_wait()?.is_some();
            copy(&mut out, &mut io::stdout())?;
            copy(&mut err, &mut io::stderr())?;
            if ended {
                return Ok(());
            }
            thread::sleep(Duration::from_millis(20));
        }
    }
}

/// Builds what User-mode Linux needs on a processor with AMX (see `xstate.c`); nothing elsewhere.
fn preload(folder: &Path) -> Result<Option<PathBuf>> {
    let processor = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    if !processor.split_whitespace().any(|flag| flag == "amx_tile") {
        return Ok(None);
    }
    let compiler = process::find("cc").context(
        "User-mode Linux needs a C compiler on this processor (AMX); Debian's package is gcc",
    )?;
    let (source, library) = (folder.join("xstate.c"), folder.join("xstate.so"));
    fs::write(&source, include_str!("xstate.c"))?;
    let mut build = command(compiler);
    build.args(["-shared", "-fPIC", "-O1", "-o"]);
    run_command(build.arg(&library).arg(&source))?;
    Ok(Some(library))
}

/// Copies what has been added to a file since the last time.
fn copy(from: &mut File, to: &mut impl Write) -> Result<()> {
    let mut bytes = Vec::new();
    from.read_to_end(&mut bytes)?;
    to.write_all(&bytes)?;
    to.flush()?;
    Ok(())
}

/// Writes the environment as shell commands.
fn environment(variables: &[(&str, String)]) -> String {
    let is_name = |name: &str| {
        !name.is_empty()
            && !name.starts_with(|first: char| first.is_ascii_digit())
            && name
                .chars()
                .all(|letter| letter.is_ascii_alphanumeric() || letter == '_')
    };
    let own = env::vars_os()
        .filter_map(|(name, value)| Some((name.into_string().ok()?, value.into_string().ok()?)));
    let added = variables
        .iter()
        .map(|(name, value)| ((*name).to_owned(), value.clone()));
    own.chain(added)
        .chain([("ANGUILLA_VCAN".to_owned(), INTERFACE.to_owned())])
        .filter(|(name, _)| {
            is_name(name) && !["PWD", "OLDPWD", "_", "SHLVL"].contains(&name.as_str())
        })
        .map(|(name, value)| format!("export {name}={}\n", quote(value)))
        .collect()
}

/// Quotes a word for the shell.
fn quote(word: impl std::fmt::Display) -> String {
    format!("'{}'", word.to_string().replace('\'', r"'\''"))
}

/// Finds the kernel modules of CAN in the order in which they load.
fn find_modules(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    list(folder, &mut files)?;
    MODULES
        .iter()
        .map(|name| {
            let found = files
                .iter()
                .find(|path| path.file_name().is_some_and(|it| it == *name));
            found
                .cloned()
                .with_context(|| format!("no {name} in {}", folder.display()))
        })
        .collect()
}

/// Lists all files below a folder.
fn list(folder: &Path, files: &mut Vec<PathBuf>) -> Result<()> {
    let entries = fs::read_dir(folder).with_context(|| format!("no {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.is_dir() {
            list(&path, files)?;
        } else {
            files.push(path);
        }
    }
    Ok(())
}

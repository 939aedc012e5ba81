//! The interface, and other programs beside the test.

use std::env;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use eel_protocol::Frame;
use eel_tests::skip;
use eel_transport::candump::{Line, parse_line};
use serde_json::Value;

/// Seconds after which something that must come is given up; generous for a slow guest.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Returns the interface to test on; `None`, after saying why, where there is none.
///
/// # Panics
/// Under CI, unless the tests' turn on an interface comes later.
pub fn interface() -> Option<String> {
    match env::var("ANGUILLA_VCAN") {
        Ok(name) if name == "later" => {
            println!("skipped: runs beside a vcan0 later in `cargo xtask test`");
            None
        }
        Ok(name) => Some(name),
        Err(_) => {
            skip("no ANGUILLA_VCAN; `cargo xtask test` runs this beside a vcan0");
            None
        }
    }
}

/// Returns the workspace's folder.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Runs a script of tests/python with python-canopen and returns the JSON that it prints.
pub fn script(name: &str, arguments: &[&str]) -> Value {
    let output = python(&Path::new("tests/python").join(name), arguments);
    serde_json::from_str(&output).unwrap_or_else(|error| panic!("{name}: {error}: {output}"))
}

/// Runs a Python program in the workspace's folder and returns what it prints.
pub fn python(program: &Path, arguments: &[&str]) -> String {
    let python = env::var("ANGUILLA_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python)
        .current_dir(root())
        .arg(program)
        .args(arguments)
        .stderr(Stdio::inherit())
        .output()
        .unwrap_or_else(|error| panic!("{python}: {error}; `cargo xtask setup` makes one"));
    let program = program.display();
    assert!(
        output.status.success(),
        "{program} ended with {}",
        output.status
    );
    String::from_utf8(output.stdout).expect("text")
}

/// Runs a program to its end and returns what it prints, on either way.
pub fn run(words: &[&str]) -> String {
    let (succeeded, text) = run_somehow(words);
    assert!(succeeded, "{words:?}: {text}");
    text
}

/// Runs a program that must end with an error, and returns what it prints.
pub fn fails(words: &[&str]) -> String {
    let (succeeded, text) = run_somehow(words);
    assert!(!succeeded, "{words:?}: {text}");
    text
}

fn run_somehow(words: &[&str]) -> (bool, String) {
    let (name, arguments) = words.split_first().expect("a program");
    let output = Command::new(name)
        .current_dir(root())
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .unwrap_or_else(|error| panic!("{name}: {error}; `cargo xtask setup` gets it"));
    let text = [output.stdout, output.stderr].concat();
    let text = String::from_utf8_lossy(&text).into_owned();
    (output.status.success(), text)
}

/// Returns the path of a program of this workspace, built as this test is.
pub fn own_program(name: &str) -> String {
    let test = env::current_exe().expect("a path");
    let folder = test.ancestors().nth(2).expect("target/debug");
    let program = folder.join(name);
    assert!(
        program.is_file(),
        "no {}; `cargo build -p {name}` makes it",
        program.display()
    );
    program.to_str().expect("text").to_owned()
}

/// Returns the path of a client from the Rust registry.
pub fn peer(name: &str) -> String {
    let program = root().join("target/peers/bin").join(name);
    program.to_str().expect("text").to_owned()
}

/// Reads the frames of a recording.
pub fn frames_of(log: &str) -> Vec<Frame> {
    log.lines()
        .map(|line| match parse_line(line.as_bytes()) {
            Ok(Line::Frame(record)) => record.frame,
            other => panic!("{line}: {other:?}"),
        })
        .collect()
}

/// Another program that is stopped when the test ends.
pub struct Program {
    name: String,
    child: Child,
}

impl Program {
    /// Starts a program and reads what it writes later.
    pub fn start(words: &[&str]) -> Self {
        Self::start_in(&root(), words)
    }

    /// Starts a program in a folder and reads what it writes later.
    pub fn start_in(folder: &Path, words: &[&str]) -> Self {
        let (name, arguments) = words.split_first().expect("a program");
        let child = Command::new(name)
            .current_dir(folder)
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{name}: {error}; Debian has it in can-utils"));
        Self {
            name: (*name).to_owned(),
            child,
        }
    }

    /// Asks the program to end, as Ctrl-C does.
    pub fn interrupt(&self) {
        let process = self.child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &process]).status();
        assert!(
            sent.is_ok_and(|status| status.success()),
            "kill -INT of {}",
            self.name
        );
    }

    /// Waits until the program has ended and returns what it wrote.
    pub fn output(mut self) -> String {
        let mut text = String::new();
        let mut out = self.child.stdout.take().expect("its output is piped");
        out.read_to_string(&mut text).expect("text");
        self.child.wait().expect("it ends");
        text
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// candump writing a file, which costs it little.
pub struct Recording {
    folder: PathBuf,
    candump: Program,
}

impl Recording {
    /// Starts to record, in a folder of this name.
    pub fn start(interface: &str, name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        let before = listeners();
        // -d tells of frames that the machine lost, which the large buffer is there to prevent.
        let words = ["candump", "-l", "-d", "-r", "4000000", interface];
        let candump = Program::start_in(&folder, &words);
        wait_for_listeners(before, 1);
        Self { folder, candump }
    }

    /// Ends it and returns the path of the file, and what is in it.
    pub fn end(self) -> (PathBuf, String) {
        self.candump.interrupt();
        self.candump.output();
        let mut files = fs::read_dir(&self.folder).expect("a folder");
        let file = files.next().expect("a file").expect("a file").path();
        let text = fs::read_to_string(&file).expect("text");
        assert!(!text.contains("DROPCOUNT"), "this machine lost frames");
        (file, text)
    }
}

/// Waits until `count` more sockets listen to an interface than `before`, or patience ends.
pub fn wait_for_listeners(before: usize, count: usize) {
    let start = std::time::Instant::now();
    while listeners() < before + count {
        assert!(start.elapsed() < PATIENCE, "nobody listens");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Returns how many raw CAN receivers the kernel has.
pub fn listeners() -> usize {
    let lists = ["rcvlist_all", "rcvlist_fil", "rcvlist_err"];
    lists
        .iter()
        .filter_map(|list| std::fs::read_to_string(format!("/proc/net/can/{list}")).ok())
        .map(|text| text.lines().filter(|line| line.contains("raw")).count())
        .sum()
}

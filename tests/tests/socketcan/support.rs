//! The interface, and other programs beside the test.

use std::env;
use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use eel_tests::skip;

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

/// Another program that is stopped when the test ends.
pub struct Program {
    name: String,
    child: Child,
}

impl Program {
    /// Starts a program and reads what it writes later.
    pub fn start(words: &[&str]) -> Self {
        let (name, arguments) = words.split_first().expect("a program");
        let child = Command::new(name)
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

//! A vertebra in QEMU's Cortex-M4: the image of `board-qemu`, one process each, in lock-step.
//!
//! A turn goes out as a packet of [`eel_vertebra::lockstep`] through QEMU's standard input, and its answer
//! comes back through the standard output. The simulator waits for the answer, so that a run takes its
//! time but is the same, bit for bit, however slow the machine is.

use std::fs::File;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context, bail, ensure};
use eel_protocol::{Frame, NodeId, PoseReport, State};
use eel_units::Instant;
use eel_vertebra::lockstep::{HEADER, Header, Input, Kind, MAX_FRAMES, Output, Start};
use eel_vertebra::{Drive, Event, Sample, Vertebra};
use tempfile::TempDir;

use super::node::{Node, Reset, prototype};

/// The emulator of Arm's processors.
const EMULATOR: &str = "qemu-system-arm";
/// The machine whose memory map is the STM32G474's; it has no part in what a vertebra does.
const MACHINE: [&str; 2] = ["-M", "netduinoplus2"];
/// No window, no monitor, no serial line; files and standard streams for the image.
const QUIET: [&str; 8] = [
    "-display",
    "none",
    "-monitor",
    "none",
    "-serial",
    "none",
    "-semihosting-config",
    "enable=on,target=native",
];

/// A vertebra in QEMU. Its flash lasts as long as its process, over every reset.
#[derive(Debug)]
pub struct QemuNode {
    start: Start,
    emulator: Child,
    to_image: ChildStdin,
    from_image: ChildStdout,
    state: State,
    trim_ns: i32,
    chain_out: bool,
    failure: Option<anyhow::Error>,
    /// What the image calls its pipes; gone with the node.
    _folder: TempDir,
}

impl QemuNode {
    /// Powers a prototype up that is the image in this file.
    ///
    /// # Errors
    /// Where there is no such file or no QEMU; the text says how to get them.
    pub fn new(id: NodeId, image: &Path) -> anyhow::Result<Self> {
        ensure!(
            image.is_file(),
            "no image at {}; `cargo xtask firmware qemu` builds it",
            image.display()
        );
        let image = image.canonicalize()?;
        let folder = tempfile::Builder::new().prefix("hil-sim-").tempdir();
        let folder = folder.context("no temporary folder for QEMU")?;
        symlink("/dev/fd/0", folder.path().join("lockstep.in"))?;
        symlink("/dev/fd/1", folder.path().join("lockstep.out"))?;
        let mut emulator = Command::new(EMULATOR)
            .args(MACHINE)
            .args(QUIET)
            .arg("-kernel")
            .arg(image)
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(File::create(folder.path().join("complaints"))?)
            .spawn()
            .map_err(|error| match error.kind() {
                ErrorKind::NotFound => {
                    anyhow::anyhow!("no {EMULATOR}; Debian has it in the package of that name")
                }
                _ => anyhow::anyhow!("can't start {EMULATOR}: {error}"),
            })?;
        let streams = emulator.stdin.take().zip(emulator.stdout.take());
        let (to_image, from_image) = streams.context("QEMU has no standard streams")?;
        let mut node = Self {
            start: Start {
                node: id,
                serial: prototype(id).serial,
                now: Instant::ZERO,
                failed: false,
            },
            emulator,
            to_image,
            from_image,
            state: State::NotReady,
            trim_ns: 0,
            chain_out: false,
            failure: None,
            _folder: folder,
        };
        node.power_up(Instant::ZERO, Reset::Power)?;
        Ok(node)
    }

    fn power_up(&mut self, now: Instant, cause: Reset) -> anyhow::Result<()> {
        self.start.now = now;
        self.start.failed = cause == Reset::Failure;
        self.state = State::NotReady;
        self.trim_ns = 0;
        let packet = self.start.encode();
        self.to_image.write_all(packet.as_bytes())?;
        Ok(())
    }

    /// Lets the image do a turn.
    fn exchange(&mut self, input: &Input) -> anyhow::Result<Output> {
        self.to_image.write_all(input.encode().as_bytes())?;
        let mut header = [0; HEADER];
        self.from_image.read_exact(&mut header)?;
        let Ok(Header { kind, length }) = Header::decode(header) else {
            // What is no packet is what the image says when it gives up.
            let mut said = header.to_vec();
            self.from_image.read_to_end(&mut said)?;
            bail!("it said: {}", String::from_utf8_lossy(&said).trim());
        };
        ensure!(kind == Kind::Output, "it answered with a packet {kind:?}");
        let mut body = vec![0; length];
        self.from_image.read_exact(&mut body)?;
        Output::decode(&body).map_err(|error| anyhow::anyhow!("its answer is wrong: {error:?}"))
    }

    /// Keeps why the node can't go on.
    fn fail(&mut self, error: anyhow::Error) {
        let node = self.start.node.get();
        let hint = "is the image of this source? `cargo xtask firmware qemu` builds it";
        let status = self.emulator.try_wait().ok().flatten();
        let status = status.map_or_else(String::new, |status| format!(" ({status})"));
        self.failure = Some(error.context(format!(
            "vertebra {node} in QEMU has failed{status}; {hint}"
        )));
    }
}

impl Node for QemuNode {
    fn turn(
        &mut self,
        now: Instant,
        frames: &[Frame],
        sample: &Sample,
        room: usize,
        sent: &mut Vec<Frame>,
    ) -> [Drive; 3] {
        if self.failure.is_some() {
            return [Drive::Off; 3];
        }
        let input = Input {
            now,
            sample: *sample,
            frames: frames.iter().copied().take(MAX_FRAMES).collect(),
            room: room.min(MAX_FRAMES) as u8,
        };
        let outcome = if frames.len() > MAX_FRAMES {
            Err(anyhow::anyhow!(
                "{} frames in one turn are more than a packet holds",
                frames.len()
            ))
        } else {
            self.exchange(&input)
        };
        match outcome {
            Ok(output) => {
                for frame in &output.frames {
                    if let Ok((_, report)) = PoseReport::from_frame(frame) {
                        self.state = report.state;
                    }
                }
                self.trim_ns = output.trim_ns;
                self.chain_out = output.chain_out;
                sent.extend(output.frames);
                output.drives
            }
            Err(error) => {
                self.fail(error);
                [Drive::Off; 3]
            }
        }
    }

    fn reset(&mut self, now: Instant, cause: Reset) {
        if let Err(error) = self.power_up(now, cause) {
            self.fail(error);
        }
    }

    fn vertebra(&self) -> Option<&Vertebra> {
        None
    }

    fn poll_event(&mut self) -> Option<Event> {
        None
    }

    fn tick_trim_ns(&self) -> i32 {
        self.trim_ns
    }

    fn chain_out(&self) -> bool {
        self.chain_out
    }

    /// Returns what the last pose report said.
    fn state(&self) -> Option<State> {
        Some(self.state)
    }

    fn take_failure(&mut self) -> Option<anyhow::Error> {
        self.failure.take()
    }
}

impl Drop for QemuNode {
    fn drop(&mut self) {
        // It has nothing to lose, and may have ended already.
        let _ = self.emulator.kill();
        let _ = self.emulator.wait();
    }
}

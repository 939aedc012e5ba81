//! The records of a run: the bus as a candump log, the states as CSV, the stride as SVG.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use eel_protocol::{Frame, NodeId};
use eel_transport::candump::{Record, write_line};
use sha2::{Digest, Sha256};

use super::tracking::radians;
use crate::robot::Robot;

/// Name of the interface in the log: what `canplayer` replays to without options.
const INTERFACE: &str = "vcan0";
/// Bytes that are gathered before they are hashed and written.
const CHUNK: usize = 1 << 16;

/// Writers of all records.
pub struct Records {
    folder: Option<PathBuf>,
    frames: Vec<u8>,
    frame_file: Option<File>,
    hash: Sha256,
    states: Option<BufWriter<File>>,
    line: String,
    failure: Option<std::io::Error>,
}

/// What was written.
pub struct Written {
    /// SHA-256 of the frame log in hexadecimal digits.
    pub frame_log_sha256: String,
    /// The files.
    pub paths: Vec<PathBuf>,
}

impl Records {
    /// Makes the folder and opens the files in it; older records there are overwritten.
    ///
    /// # Errors
    /// What the file system says.
    pub fn create(folder: &Path) -> std::io::Result<Self> {
        std::fs::create_dir_all(folder)?;
        // What is written last would else be an older run's until then.
        for name in ["stride.svg", "summary.json"] {
            match std::fs::remove_file(folder.join(name)) {
                Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        let mut states = BufWriter::new(File::create(folder.join("states.csv"))?);
        states.write_all(header().as_bytes())?;
        Ok(Self {
            frame_file: Some(File::create(folder.join("bus.log"))?),
            states: Some(states),
            folder: Some(folder.to_owned()),
            ..Self::nowhere()
        })
    }

    /// Records nothing but the hash of the frame log.
    pub fn nowhere() -> Self {
        Self {
            folder: None,
            frames: Vec::with_capacity(CHUNK + 128),
            frame_file: None,
            hash: Sha256::new(),
            states: None,
            line: String::new(),
            failure: None,
        }
    }

    /// Takes a frame that ended at `time_ns`.
    pub fn frame(&mut self, time_ns: u64, frame: &Frame) {
        let record = Record {
            time_ns,
            interface: INTERFACE,
            frame: *frame,
            direction: None,
        };
        write_line(&mut self.frames, &record);
        if self.frames.len() >= CHUNK {
            self.flush();
        }
    }

    /// Takes a row of states.
    ///
    /// # Errors
    /// What the file system says of it or said of a frame, with the file.
    pub fn state(&mut self, robot: &Robot) -> anyhow::Result<()> {
        self.check_frames()?;
        let Some(file) = &mut self.states else {
            return Ok(());
        };
        let plant = robot.plant();
        self.line.clear();
        write!(self.line, "{:.6}", robot.now_ns() as f64 / 1e9)?;
        for value in plant.centre_of_mass().into_iter().chain(plant.tail_edge()) {
            write!(self.line, ",{value:.6}")?;
        }
        write!(
            self.line,
            ",{:.4},{:.3}",
            plant.joint_power_w(),
            plant.supply_v()
        )?;
        for id in NodeId::all() {
            let index = id.index();
            for value in plant.joint_pose(index) {
                write!(self.line, ",{value:.6}")?;
            }
            let vertebra = robot.node(id).vertebra();
            let reference = vertebra.and_then(eel_vertebra::Vertebra::reference);
            match reference {
                Some(pose) => {
                    for angle in [pose.yaw, pose.pitch, pose.roll] {
                        write!(self.line, ",{:.6}", radians(angle))?;
                    }
                }
                None => self.line.push_str(",,,"),
            }
            for value in plant.motor_torque(index) {
                write!(self.line, ",{value:.4}")?;
            }
            let state = robot.node(id).state();
            write!(
                self.line,
                ",{}",
                state.map_or("", eel_protocol::State::name)
            )?;
        }
        self.line.push('\n');
        file.write_all(self.line.as_bytes())
            .context("can't write states.csv")
    }

    /// Closes everything and adds the picture, if there is one.
    ///
    /// # Errors
    /// What the file system said at any time.
    pub fn finish(mut self, drawing: Option<&String>) -> anyhow::Result<Written> {
        self.flush();
        self.check_frames()?;
        let mut paths = Vec::new();
        if let Some(mut states) = self.states {
            states.flush().context("can't write states.csv")?;
        }
        if let Some(folder) = self.folder {
            paths.extend(["bus.log", "states.csv"].map(|name| folder.join(name)));
            if let Some(drawing) = drawing {
                let path = folder.join("stride.svg");
                std::fs::write(&path, drawing).context("can't write stride.svg")?;
                paths.push(path);
            }
            paths.push(folder.join("summary.json"));
        }
        let mut frame_log_sha256 = String::with_capacity(64);
        for byte in self.hash.finalize() {
            write!(frame_log_sha256, "{byte:02x}")?;
        }
        Ok(Written {
            frame_log_sha256,
            paths,
        })
    }

    /// Tells what went wrong with the frame log, once.
    fn check_frames(&mut self) -> anyhow::Result<()> {
        self.failure
            .take()
            .map_or(Ok(()), Err)
            .context("can't write bus.log")
    }

    fn flush(&mut self) {
        self.hash.update(&self.frames);
        if let Some(file) = &mut self.frame_file
            && self.failure.is_none()
            && let Err(error) = file.write_all(&self.frames)
        {
            self.failure = Some(error);
        }
        self.frames.clear();
    }
}

/// Returns the first line of the state record: names with units.
fn header() -> String {
    let mut line =
        String::from("time_s,centre_x_m,centre_y_m,centre_z_m,tail_x_m,tail_y_m,tail_z_m");
    line.push_str(",joint_power_w,supply_v");
    for id in NodeId::all() {
        let n = id.get();
        for name in [
            "yaw_rad",
            "pitch_rad",
            "roll_rad",
            "reference_yaw_rad",
            "reference_pitch_rad",
            "reference_roll_rad",
            "torque1_nm",
            "torque2_nm",
            "torque3_nm",
            "state",
        ] {
            let _ = write!(line, ",v{n}_{name}");
        }
    }
    line.push('\n');
    line
}

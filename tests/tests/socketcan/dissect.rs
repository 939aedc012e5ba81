//! tshark's CANopen dissector on recordings: every frame is what we say that it is.

use std::path::Path;

use eel_protocol::{Cob, Frame};

use crate::support::run;

/// Returns what tshark's column of information must begin with for a frame, and what must be in it.
fn expected(frame: &Frame) -> (&'static str, String) {
    let id = frame.cob_id().expect("a standard frame");
    let data = frame.data();
    match Cob::from_id(id) {
        Cob::Nmt => ("NMT: ", String::new()),
        Cob::Sync => ("SYNC", format!("[{}]", data[0])),
        Cob::Time => ("TIME STAMP", String::new()),
        Cob::LssRequest => ("LSS (Master)", String::new()),
        Cob::LssResponse => ("LSS (Slave)", String::new()),
        Cob::Emergency(_) => ("EMCY", String::new()),
        Cob::Pose(_) => ("PDO1 (tx)", String::new()),
        Cob::Target(_) => ("PDO1 (rx)", String::new()),
        Cob::Effort(_) => ("PDO2 (tx)", String::new()),
        Cob::Moment(_) => ("PDO2 (rx)", String::new()),
        Cob::SdoResponse(_) => ("Default-SDO (tx)", String::new()),
        Cob::SdoRequest(_) => ("Default-SDO (rx)", String::new()),
        Cob::Heartbeat(node) => {
            let state = match data[0] {
                0 => "Boot-up",
                4 => "Stopped",
                5 => "Operational",
                _ => "Pre-operational",
            };
            ("NMT Error Control", format!("{state} [0x{node:x}]"))
        }
        Cob::Other(id) => panic!("{id:03X} has no place in a recording"),
    }
}

/// Has tshark dissect a recording and holds each frame to what it must be.
pub fn dissect(file: &Path, frames: &[Frame]) {
    let text = run(&[
        "tshark",
        "-r",
        file.to_str().unwrap(),
        "-d",
        "can.subdissector,canopen",
        "-T",
        "fields",
        "-e",
        "can.id",
        "-e",
        "_ws.malformed",
        "-e",
        "_ws.expert.message",
        "-e",
        "_ws.col.Info",
    ]);
    let mut lines = text.lines().filter(|line| line.contains('\t'));
    for frame in frames {
        let line = lines
            .next()
            .unwrap_or_else(|| panic!("no line for {frame:?}"));
        let fields: Vec<&str> = line.split('\t').collect();
        let [id, malformed, expert, info] = fields[..] else {
            panic!("{line}")
        };
        assert_eq!(id.parse().ok(), frame.cob_id(), "{line}");
        assert_eq!((malformed, expert), ("", ""), "{frame:?}: {line}");
        let (begin, content) = expected(frame);
        assert!(
            info.starts_with(begin) && info.contains(&content),
            "{frame:?}: {line}, not {begin} {content}"
        );
    }
    assert_eq!(lines.next(), None);
}

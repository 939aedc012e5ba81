//! The generated files against the tables and against a running vertebra.

use std::collections::BTreeMap;
use std::fmt::{Result, Write};
use std::fs;
use std::path::Path;

use eel_canopen::{Abort, Frame};
use eel_protocol::NodeId;
use eel_protocol::export::{write_dbc, write_eds, write_markdown};
use eel_units::Instant;
use eel_vertebra::{Calibration, Settings, Vertebra};

const NODE: u8 = 7;
const SERIAL: u32 = 0x1234_5678;

#[test]
fn the_generated_files_are_not_stale() {
    type Writer = fn(&mut dyn Write) -> Result;
    let files: [(&str, Writer); 3] = [
        ("vertebra.eds", write_eds),
        ("vertebra.dbc", write_dbc),
        ("dictionary.md", write_markdown),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/generated");
    for (name, write) in files {
        let mut fresh = String::new();
        write(&mut fresh).unwrap();
        let kept = fs::read_to_string(folder.join(name)).unwrap_or_default();
        // Git may check text out with the line ends of the system.
        let kept = kept.replace("\r\n", "\n");
        assert!(
            kept == fresh,
            "docs/generated/{name} is stale: run `cargo xtask gen`"
        );
    }
}

/// An entry as the data sheet describes it.
#[derive(Debug, Default)]
struct Described {
    data_type: u16,
    access: String,
    default: String,
    is_mappable: bool,
}

/// Reads the entries of a data sheet: those of a section with a data type.
fn data_sheet() -> BTreeMap<(u16, u8), Described> {
    let mut text = String::new();
    write_eds(&mut text).unwrap();
    let mut entries = BTreeMap::new();
    let mut at = None;
    for line in text.lines() {
        if let Some(section) = line
            .strip_prefix('[')
            .and_then(|line| line.strip_suffix(']'))
        {
            let (index, sub) = section.split_once("sub").unwrap_or((section, "0"));
            let index = u16::from_str_radix(index, 16)
                .ok()
                .filter(|_| index.len() == 4);
            at = index.zip(u8::from_str_radix(sub, 16).ok());
        } else if let (Some(at), Some((key, value))) = (at, line.split_once('=')) {
            let entry: &mut Described = entries.entry(at).or_default();
            match key {
                "DataType" => entry.data_type = number(value) as u16,
                "AccessType" => value.clone_into(&mut entry.access),
                "DefaultValue" => value.clone_into(&mut entry.default),
                "PDOMapping" => entry.is_mappable = value == "1",
                _ => {}
            }
        }
    }
    entries.retain(|_, entry| entry.data_type != 0);
    entries
}

/// Reads a number, with the node id where it is asked for.
fn number(text: &str) -> i64 {
    if let Some(base) = text.strip_prefix("$NODEID+") {
        return number(base) + i64::from(NODE);
    }
    match text.strip_prefix("0x") {
        Some(digits) => i64::from_str_radix(digits, 16).unwrap(),
        None => text.parse().unwrap(),
    }
}

/// A vertebra behind an SDO client.
struct Client {
    vertebra: Vertebra,
}

impl Client {
    fn new() -> Self {
        // As a board leaves the factory: nobody has calibrated it.
        let settings = Settings {
            calibration: Calibration::NONE,
            ..Settings::prototype(NodeId::new(NODE).unwrap(), SERIAL)
        };
        Self {
            vertebra: Vertebra::new(settings, Instant::from_micros(0)),
        }
    }

    fn ask(&mut self, request: [u8; 8]) -> [u8; 8] {
        let now = Instant::from_micros(0);
        while self.vertebra.poll_transmit().is_some() {}
        let frame = Frame::standard(0x600 + u16::from(NODE), &request).unwrap();
        self.vertebra.handle_frame(now, &frame);
        let answer = self.vertebra.poll_transmit().expect("an answer");
        assert_eq!(answer.cob_id(), Some(0x580 + u16::from(NODE)));
        answer.data().try_into().unwrap()
    }

    /// Reads an entry to its end.
    fn read(&mut self, (index, sub): (u16, u8)) -> std::result::Result<Vec<u8>, u32> {
        let [low, high] = index.to_le_bytes();
        let answer = self.ask([0x40, low, high, sub, 0, 0, 0, 0]);
        let [command, _, _, _, data @ ..] = answer;
        let word = u32::from_le_bytes(data);
        match command {
            0x80 => Err(word),
            0x41 => Ok(self.segments(word as usize)),
            _ => {
                assert_eq!(command & 0xF3, 0x43, "expedited, with its length");
                Ok(data[..4 - usize::from((command >> 2) & 3)].to_vec())
            }
        }
    }

    fn segments(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = Vec::new();
        for toggle in [0x60, 0x70].into_iter().cycle() {
            let [command, data @ ..] = self.ask([toggle, 0, 0, 0, 0, 0, 0, 0]);
            bytes.extend_from_slice(&data[..7 - usize::from((command >> 1) & 7)]);
            if command & 1 != 0 {
                break;
            }
        }
        assert_eq!(bytes.len(), length);
        bytes
    }

    /// Writes an entry of at most four bytes.
    fn write(&mut self, (index, sub): (u16, u8), data: &[u8]) -> std::result::Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut request = [
            0x23 | (4 - data.len() as u8) << 2,
            low,
            high,
            sub,
            0,
            0,
            0,
            0,
        ];
        request[4..4 + data.len()].copy_from_slice(data);
        match self.ask(request) {
            [0x80, _, _, _, code @ ..] => Err(u32::from_le_bytes(code)),
            answer => {
                assert_eq!(answer[0], 0x60);
                Ok(())
            }
        }
    }
}

#[test]
fn a_vertebra_serves_exactly_the_entries_of_its_data_sheet() {
    let sheet = data_sheet();
    let mut client = Client::new();
    assert!(sheet.len() > 140, "{}", sheet.len());
    for index in 0x1000..0x2200 {
        for sub in (0..=16).chain([0x7F, 0xFF]) {
            let answer = client.read((index, sub));
            let is_served = match &answer {
                Ok(_) => true,
                // Known, but without data for now: an error field that holds no error.
                Err(code) => *code == Abort::NoData.code(),
            };
            let is_listed = sheet.contains_key(&(index, sub));
            assert_eq!(
                is_served, is_listed,
                "{index:04X}:{sub:X} answers {answer:X?}"
            );
        }
    }
}

#[test]
fn a_fresh_vertebra_holds_the_defaults_of_its_data_sheet() {
    let mut client = Client::new();
    let mut compared = 0;
    for (at, entry) in data_sheet() {
        let Ok(bytes) = client.read(at) else { continue };
        let name = format!("{:04X}:{:X}", at.0, at.1);
        let length = match entry.data_type {
            5 => 1,
            3 | 6 => 2,
            4 | 7 => 4,
            9 | 15 => bytes.len(),
            other => panic!("{name} has data type {other}"),
        };
        assert_eq!(bytes.len(), length, "{name}");
        if entry.data_type == 15 {
            continue;
        }
        if entry.data_type == 9 {
            let text = String::from_utf8(bytes).unwrap();
            assert!(
                entry.default.is_empty() || text == entry.default,
                "{name}: {text}"
            );
            continue;
        }
        // What is measured has no default that a vertebra could hold.
        if entry.access == "ro" || entry.default.is_empty() {
            continue;
        }
        let mut wide = [0; 8];
        wide[..length].copy_from_slice(&bytes);
        let raw = u64::from_le_bytes(wide);
        let mask = u64::MAX >> (64 - 8 * length);
        assert_eq!(
            raw,
            number(&entry.default) as u64 & mask,
            "{name} = {}",
            entry.default
        );
        compared += 1;
    }
    assert!(compared > 80, "{compared}");
    assert_eq!(client.read((0x1018, 4)), Ok(SERIAL.to_le_bytes().to_vec()));
}

#[test]
fn a_vertebra_serves_its_own_data_sheet() {
    let mut client = Client::new();
    let served = client.read((0x1021, 0)).unwrap();
    let mut sheet = String::new();
    write_eds(&mut sheet).unwrap();
    assert!(served == sheet.as_bytes(), "is the grammar stale?");
    assert_eq!(client.read((0x1022, 0)), Ok(vec![0]), "plain text");
}

#[test]
fn a_vertebra_refuses_to_write_what_its_data_sheet_calls_read_only() {
    let mut client = Client::new();
    for (at, entry) in data_sheet() {
        let name = format!("{:04X}:{:X}", at.0, at.1);
        let bytes = client.read(at).unwrap_or(vec![0; 4]);
        let bytes = &bytes[..bytes.len().min(4)];
        let answer = client.write(at, bytes);
        match entry.access.as_str() {
            "ro" | "const" => assert_eq!(answer, Err(Abort::ReadOnly.code()), "{name}"),
            "rw" | "rww" => assert_ne!(answer, Err(Abort::ReadOnly.code()), "{name}"),
            other => panic!("{name} has access {other}"),
        }
    }
}

#[test]
fn a_vertebra_maps_what_its_data_sheet_calls_mappable_and_nothing_else() {
    let mut client = Client::new();
    let disable = |client: &mut Client, index: u16, cob_id: u32| {
        client
            .write((index, 1), &(cob_id | 1 << 31).to_le_bytes())
            .unwrap();
        client.write((index + 0x200, 0), &[0]).unwrap();
    };
    disable(&mut client, 0x1400, 0x200 + u32::from(NODE));
    disable(&mut client, 0x1800, 1 << 30 | (0x180 + u32::from(NODE)));
    for ((index, sub), entry) in data_sheet() {
        let bits = match entry.data_type {
            5 => 8,
            3 | 6 => 16,
            _ => 32,
        };
        let raw = u32::from(index) << 16 | u32::from(sub) << 8 | bits;
        let is_mapped =
            [0x1600, 0x1A00].map(|mapping| client.write((mapping, 1), &raw.to_le_bytes()).is_ok());
        let expected = match (entry.is_mappable, entry.access.as_str()) {
            (false, _) => [false, false],
            (true, "rww") => [true, false],
            (true, _) => [false, true],
        };
        assert_eq!(is_mapped, expected, "{index:04X}:{sub:X}");
    }
}

//! Tests of the scope's command with captures of known bytes, and against a vertebra of a few lines.

use std::thread;

use eel_protocol::Frame;
use eel_protocol::scope::ScopeHeader;
use eel_transport::{MemoryBus, pair};
use roxmltree::Document;

use super::*;

const YAW: u32 = 0x2010_0110;
const ANGLE: u32 = 0x2012_0120;

/// The bytes of a capture of yaw, a ramp, and of motor 1's angle, which never changes.
fn bytes(samples: u16, fault: Option<u16>) -> Vec<u8> {
    let header = ScopeHeader {
        state: ScopeState::Full,
        trigger: Trigger::Fault,
        divider: 2,
        samples,
        first_us: 10_000_000,
        fault,
        channels: [YAW, ANGLE, 0, 0],
    };
    let words = (0..i32::from(samples)).flat_map(|sample| [100 * sample - 200, 785_398]);
    let words = words.flat_map(i32::to_le_bytes);
    header.to_bytes().into_iter().chain(words).collect()
}

fn capture(samples: u16, fault: Option<u16>) -> Capture {
    Capture::of(Node(3), &[YAW, ANGLE, 0, 0], &bytes(samples, fault)).unwrap()
}

#[test]
fn signals_become_channels_and_what_can_not_be_captured_says_why() {
    let names =
        |names: &[&str]| -> Vec<String> { names.iter().map(|name| (*name).to_owned()).collect() };
    assert_eq!(
        channels(&names(&["pose.yaw", "motor.angle1"])),
        Ok([YAW, ANGLE, 0, 0])
    );
    let told = |all: &[&str]| channels(&names(all)).unwrap_err().0;
    assert!(told(&["pose.jaw"]).contains("pose has yaw, pitch, roll"));
    assert!(told(&["pose"]).contains("is a group: name up to four of pose.yaw, pose.pitch"));
    assert!(told(&["pose.yaw"; 5]).contains("takes four signals at a time, not 5"));
    for name in [
        "heartbeat.producer",
        "record.scope",
        "device.name",
        "0x3000",
    ] {
        assert!(told(&[name]).contains("can't be captured"), "{name}");
    }
}

#[test]
fn a_plot_is_these_characters() {
    let expected = "\
vertebra 3: 9 samples every 2 ms from 10.000 s after power-up, fault at 10.004 s

pose.yaw: -0.0200 to 0.0600 rad
  0.0600 ┤      ⠅             ⣀⠤⠒⠉
         │      ⠅         ⣀⠤⠒⠉
         │      ⠅    ⢀⣀⠤⠒⠉
         │      ⠅⢀⡠⠔⠊⠁
         │   ⢀⡠⠔⠏⠁
 -0.0200 ┤⡠⠔⠊⠁  ⠅

motor.angle1: always 0.785398 rad
0.785398 ┤⠤⠤⠤⠤⠤⠤⠥⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤⠤
         └──────┴─────────────────
          -0.004 s         0.012 s
";
    assert_eq!(plot::text(&capture(9, Some(2)), 24), expected);
}

#[test]
fn one_sample_and_a_long_capture_are_plotted_too() {
    for (samples, fault) in [(1, None), (2, Some(1)), (512, Some(256))] {
        let capture = capture(samples, fault);
        let text = plot::text(&capture, COLUMNS);
        assert!(text.lines().all(|line| line.chars().count() < 90), "{text}");
        let axis = text.lines().last().unwrap_or_default();
        assert!(axis.contains("fault") == (samples == 512), "{text}");
        Document::parse(&drawing::svg(&capture)).unwrap();
    }
}

#[test]
fn a_drawing_has_axes_units_a_legend_and_the_fault() {
    let text = drawing::svg(&capture(5, Some(2)));
    let document = Document::parse(&text).unwrap();
    let texts: Vec<_> = document
        .descendants()
        .filter(|node| node.has_tag_name("text"))
        .filter_map(|node| node.text())
        .collect();
    for words in [
        "pose.yaw",
        "motor.angle1",
        "pose.yaw, rad",
        "time since the fault, s",
        "fault",
        "-0.02",
        "0.004",
        "-0.004",
        "0.000",
    ] {
        assert!(texts.contains(&words), "{words}: {texts:?}");
    }
    let class = |name: &str| {
        let with = |node: &roxmltree::Node<'_, '_>| node.attribute("class") == Some(name);
        document.descendants().filter(with).count()
    };
    // A line in the legend, and the trace.
    assert_eq!(
        [class("trace1"), class("trace2"), class("trace3")],
        [2, 2, 0]
    );
    assert_eq!([class("fault"), class("frame")], [2, 2]);
    let without = drawing::svg(&capture(5, None));
    assert!(without.contains(">time, s<") && !without.contains("\"fault\""));
}

#[test]
fn a_table_has_a_line_for_each_sample_in_units() {
    let expected = "\
uptime_s,time_s,pose.yaw [rad],motor.angle1 [rad]
10.000000,-0.002,-0.0200,0.785398
10.002000,0.000,-0.0100,0.785398
10.004000,0.002,0.0000,0.785398
";
    assert_eq!(capture(3, Some(1)).csv(), expected);
}

#[test]
fn json_has_the_values_in_units() {
    let json = capture(3, None).json();
    assert_eq!(json["fault"], serde_json::Value::Null);
    assert_eq!(json["state"], "full");
    let yaw = &json["signals"][0];
    assert_eq!(yaw["values"], serde_json::json!([-0.02, -0.01, 0.0]));
    assert_eq!(
        (&yaw["unit"], &yaw["min"]),
        (&"rad".into(), &(-0.02).into())
    );
}

#[test]
fn a_capture_of_nothing_or_of_something_else_says_so() {
    let told = |channels, bytes: &[u8]| Capture::of(Node(3), &channels, bytes).unwrap_err();
    let ours = [YAW, ANGLE, 0, 0];
    assert!(told(ours, &bytes(0, None)).starts_with("nothing was captured: it was ended"));
    assert!(
        told([YAW, 0, 0, 0], &bytes(1, None)).starts_with("nothing was captured: it was reset")
    );
    assert!(told(ours, &bytes(1, None)[..40]).contains("cut or too long"));
    assert!(told(ours, &[9]).contains("another version"));
}

/// Answers as a vertebra whose scope is full at the third question; returns what was written.
fn serve(mut bus: MemoryBus, record: &[u8]) -> Vec<(u16, u8, u32)> {
    let mut written = Vec::new();
    let mut questions = 0;
    let mut rest = record.chunks(7).enumerate().peekable();
    while let Ok(received) = bus.receive(Duration::from_secs(10)) {
        let Some(frame) = received.as_ref().and_then(|received| received.frame()) else {
            break;
        };
        let &[command, low, high, subindex, a, b, c, d] = frame.data() else {
            continue;
        };
        let index = u16::from_le_bytes([low, high]);
        let mut answer = [0, low, high, subindex, 0, 0, 0, 0];
        match (command >> 5, index) {
            (1, _) => {
                written.push((index, subindex, u32::from_le_bytes([a, b, c, d])));
                answer[0] = 0x60;
            }
            (2, 0x2050) => {
                questions += 1;
                answer[0] = 0x4F;
                answer[4] = if questions < 3 { 1 } else { 4 };
            }
            (2, _) => {
                answer[0] = 0x41;
                answer[4..].copy_from_slice(&(record.len() as u32).to_le_bytes());
            }
            (3, _) => {
                let (number, chunk) = rest.next().expect("a segment");
                let is_last = rest.peek().is_none();
                let toggle = (number as u8 & 1) << 4;
                answer = [0; 8];
                answer[0] = toggle | (7 - chunk.len() as u8) << 1 | u8::from(is_last);
                answer[1..=chunk.len()].copy_from_slice(chunk);
            }
            // That it gives a transfer up is not answered.
            (4, _) => continue,
            // A block transfer is refused, as by a simple node.
            _ => {
                answer[0] = 0x80;
                answer[4..].copy_from_slice(&0x0504_0001_u32.to_le_bytes());
            }
        }
        let frame = Frame::standard(0x583, &answer).expect("eight bytes");
        if bus.send(&frame).is_err() {
            break;
        }
    }
    written
}

#[test]
fn the_scope_is_set_begun_awaited_and_read() {
    let (ours, theirs) = pair();
    let record = bytes(20, None);
    let sent = record.clone();
    let served = thread::spawn(move || serve(theirs, &sent));
    let order = Order {
        node: 3,
        channels: [YAW, ANGLE, 0, 0],
        every: 2,
        trigger: Trigger::Fault,
    };
    let mut client = Client::new(ours);
    client.settings_mut().answer = Duration::from_secs(5);
    let mut rounds = 0;
    let read = order
        .carry_out(&mut client, &mut || {
            rounds += 1;
            true
        })
        .unwrap();
    assert_eq!((read, rounds), (record, 3));
    drop(client);
    let written = served.join().unwrap();
    let expected = [
        (0x2050, 6, 0),
        (0x2050, 1, YAW),
        (0x2050, 2, ANGLE),
        (0x2050, 3, 0),
        (0x2050, 4, 0),
        (0x2050, 5, 2),
        (0x2050, 6, 2),
    ];
    assert_eq!(written, expected);
}

//! The kinds of bus that need no hardware, through the one trait.

use std::io::Cursor;
use std::time::Duration;

use eel_protocol::Frame;
use eel_transport::{Bus, BusError, Content, FileBus, open, pair};

fn recording(text: &'static str) -> FileBus {
    FileBus::new("run.log", Box::new(Cursor::new(text)))
}

#[test]
fn a_recording_gives_its_frames_in_order_then_ends() {
    let mut bus = recording(
        "(1.000000) vcan0 080#01\n\n(1.000001) vcan0 123##1FF\n(1.000500) vcan0 181#0102 R\r\n\
         (2.000000) vcan0 20000004#0004000000000000",
    );
    let first = bus.receive(Duration::ZERO).unwrap().unwrap();
    assert_eq!(first.time_ns, 1_000_000_000);
    assert_eq!(first.frame(), Frame::standard(0x080, &[1]).as_ref());
    let second = bus.receive(Duration::ZERO).unwrap().unwrap();
    assert_eq!(second.frame(), Frame::standard(0x181, &[1, 2]).as_ref());
    assert_eq!(bus.flexible_frames(), 1);
    let third = bus.receive(Duration::ZERO).unwrap().unwrap();
    assert!(matches!(third.content, Content::Error(report) if report.classes == 4));
    assert!(matches!(bus.receive(Duration::ZERO), Err(BusError::Ended)));
    assert!(matches!(bus.receive(Duration::ZERO), Err(BusError::Ended)));
}

#[test]
fn a_bad_line_is_named_and_the_next_call_goes_on() {
    let mut bus = recording("(1.0) vcan0 080#01\n(1.0) vcan0 080#0\n(1.0) vcan0 080#02\n");
    assert!(bus.receive(Duration::ZERO).is_ok());
    let error = bus.receive(Duration::ZERO).unwrap_err();
    assert_eq!(
        error.to_string(),
        "run.log:2:18: expected data bytes of two hexadecimal digits"
    );
    let next = bus.receive(Duration::ZERO).unwrap().unwrap();
    assert_eq!(next.frame(), Frame::standard(0x080, &[2]).as_ref());
}

#[test]
fn a_recording_can_not_be_sent_to() {
    let frame = Frame::standard(1, &[]).unwrap();
    assert!(matches!(
        recording("").send(&frame),
        Err(BusError::ReadOnly)
    ));
}

#[test]
fn what_one_end_of_a_pair_sends_the_other_receives() {
    let (mut left, mut right) = pair();
    let frame = Frame::standard(0x201, &[1, 2, 3]).unwrap();
    left.send(&frame).unwrap();
    assert_eq!(
        right
            .receive(Duration::from_secs(1))
            .unwrap()
            .unwrap()
            .frame(),
        Some(&frame)
    );
    assert_eq!(right.receive(Duration::ZERO).unwrap(), None);
    assert_eq!(left.receive(Duration::from_millis(1)).unwrap(), None);
    drop(right);
    assert!(matches!(left.send(&frame), Err(BusError::Ended)));
    assert!(matches!(left.receive(Duration::ZERO), Err(BusError::Ended)));
}

#[test]
fn a_full_pair_says_so_and_loses_nothing() {
    let (mut left, mut right) = pair();
    let mut sent = 0u32;
    loop {
        let frame = Frame::standard(0x201, &sent.to_be_bytes()).unwrap();
        match left.send(&frame) {
            Ok(()) => sent += 1,
            Err(BusError::Full) => break,
            Err(other) => panic!("{other}"),
        }
    }
    for number in 0..sent {
        let frame = Frame::standard(0x201, &number.to_be_bytes());
        assert_eq!(
            right.receive(Duration::ZERO).unwrap().unwrap().frame(),
            frame.as_ref()
        );
    }
    assert_eq!(right.receive(Duration::ZERO).unwrap(), None);
}

#[test]
fn an_error_names_the_cure() {
    let error = open("tcp://robot:29536").err().unwrap().to_string();
    assert!(
        error.starts_with("can't open tcp://robot:29536: buses over TCP"),
        "{error}"
    );
    let error = open("no/such/file.log").err().unwrap().to_string();
    assert!(
        error.starts_with("can't read no/such/file.log: "),
        "{error}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_missing_interface_is_explained() {
    // Whether the kernel knows CAN at all or not, the error says what to do.
    let error = open("vcan87").err().unwrap().to_string();
    assert!(error.contains("cargo xtask vcan -- COMMAND"), "{error}");
}

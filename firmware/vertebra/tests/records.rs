//! What a vertebra records and streams: freeze frame, scope, the test of transfers, the data sheet.

use eel_canopen::{Frame, NmtCommand};
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::freeze::{FreezeFrame, TimeOfDay};
use eel_protocol::scope::{ScopeHeader, ScopeState};
use eel_protocol::{Condition, Crc32, LimitCode, Mode, State};
use eel_units::{Current, Temperature, Voltage};

use support::{Bench, pose, radians};

mod support;

const NO_DATA: u32 = 0x0800_0024;
const DEVICE_STATE: u32 = 0x0800_0022;

/// Reads the freeze frame.
fn frozen(bench: &mut Bench) -> FreezeFrame {
    let bytes = bench.upload(0x2100, 1).expect("a freeze frame");
    FreezeFrame::from_bytes(&bytes).expect("of this layout")
}

/// Reads the scope: its header, and the numbers of each sample.
fn captured(bench: &mut Bench) -> (ScopeHeader, Vec<Vec<i32>>) {
    let bytes = bench.upload(0x2100, 2).expect("a capture");
    let (header, samples) = ScopeHeader::from_bytes(&bytes).expect("of this layout");
    let (words, _) = samples.as_chunks();
    let words: Vec<i32> = words.iter().copied().map(i32::from_le_bytes).collect();
    let samples = words.chunks(header.width().max(1)).map(<[i32]>::to_vec);
    (header, samples.collect())
}

fn scope(bench: &mut Bench, channels: &[u32], divider: u16, trigger: u8) {
    for (channel, subindex) in channels.iter().zip(1..) {
        bench
            .download(0x2050, subindex, &channel.to_le_bytes())
            .unwrap();
    }
    bench.download(0x2050, 5, &divider.to_le_bytes()).unwrap();
    bench.download(0x2050, 6, &[trigger]).unwrap();
}

#[test]
fn there_is_no_freeze_frame_before_the_first_fault() {
    let mut bench = Bench::running();
    assert_eq!(bench.upload(0x2100, 1), Err(NO_DATA));
    assert_eq!(bench.download(0x2100, 1, &[0; 9]), Err(0x0601_0002));
}

#[test]
fn a_freeze_frame_holds_what_was_when_a_motor_failed() {
    let mut bench = Bench::running();
    bench.target = pose(120, -60, 20);
    bench.vertebra.note_overruns(7, 9);
    let midnight = 86_399_500_u32.to_le_bytes();
    let [a, b, c, d] = midnight;
    bench
        .extra
        .push(Frame::standard(0x100, &[a, b, c, d, 0x35, 0x3D]).unwrap());
    bench.tick();
    let told = bench.millis;
    bench.run(700);
    bench.sample.supply = Voltage::from_millivolts(23_456);
    bench.sample.board_temperature = Temperature::from_decidegrees(-123);
    bench.sample.motor_temperature = [301, 302, 303].map(Temperature::from_decidegrees);
    bench.sample.current = [500, -250, 0].map(Current::from_milliamps);
    bench.run(5);
    let reference = bench.vertebra.reference().unwrap();
    let angles = bench.vertebra.motor_angles();
    bench.sample.bridge_fault[1] = true;
    bench.tick();
    let at = bench.millis;
    assert_eq!(bench.state(), State::Fault);
    // Whatever happens afterwards changes nothing.
    bench.sample.supply = Voltage::from_millivolts(1);
    bench.sample.bridge_fault[1] = false;
    bench.run(2_500);

    let frame = frozen(&mut bench);
    assert_eq!(frame.code, Emergency::BRIDGE_FAULT.code);
    let source = Source {
        motor: 2,
        limit: 0,
        detail: 0,
    };
    assert_eq!((frame.source, frame.state), (source, State::Run));
    assert_eq!((frame.at_us, frame.count), (at * 1_000, 1));
    let passed = u32::try_from(at - told).unwrap();
    let expected = TimeOfDay {
        days: 15_670,
        ms: passed - 500,
    };
    assert_eq!(frame.clock, Some(expected), "past midnight");
    let micro = |radians: f64| (radians * 1e6).round() as i32;
    let near = |found: i32, expected: f64| assert!((found - micro(expected)).abs() <= 150);
    let axes = [reference.yaw, reference.pitch, reference.roll];
    for ((found, pulled), expected) in frame.pose.iter().zip(frame.reference.unwrap()).zip(axes) {
        near(*found, radians(expected));
        near(pulled, radians(expected));
    }
    assert!((frame.reference.unwrap()[0] - 120_000).abs() < 20);
    for (found, expected) in frame.angles.into_iter().zip(angles) {
        near(found, radians(expected));
    }
    assert!(
        frame.speeds.iter().all(|speed| speed.abs() < 50),
        "{frame:?}"
    );
    assert_eq!(frame.currents, [500, -250, 0]);
    assert_eq!(frame.torques, [744, -372, 0]);
    assert!(!frame.limits.contains(&LimitCode::Off), "{frame:?}");
    assert_eq!(frame.supply, 23_456);
    assert_eq!(frame.temperatures, [-123, 301, 302, 303]);
    assert!(frame.status.contains(Condition::Bridge));
    assert_eq!(frame.counters[2..], [7, 9]);
}

#[test]
fn the_last_fault_or_stop_counts_and_outlives_a_reset_of_the_node() {
    let mut bench = Bench::running();
    bench.nmt(NmtCommand::EnterPreOperational);
    bench.run(3);
    let first = frozen(&mut bench);
    assert_eq!(first.code, Emergency::STOPPED_BY_NMT.code);
    assert_eq!((first.count, first.clock), (1, None));
    bench.until(State::StopOff, 3_000);
    bench.operate();
    bench.recover();
    bench.stream = false;
    bench.until(State::StopDamped, 200);
    bench.run(5);
    bench.stream = true;
    let second = frozen(&mut bench);
    assert_eq!(second.code, Emergency::COMMAND_LOST.code);
    assert_eq!((second.count, second.source.detail), (2, 90));
    assert!(second.reference.is_some() && second.at_us > first.at_us);
    bench.until(State::StopOff, 3_000);
    bench.nmt(NmtCommand::ResetNode);
    bench.run(2);
    let third = frozen(&mut bench);
    assert_eq!(third.code, Emergency::RESTARTED.code, "it was latched");
    assert_eq!(third.count, 3);
    bench.power_cycle(eel_vertebra::Settings::prototype(support::node(), 77));
    assert_eq!(bench.upload(0x2100, 1), Err(NO_DATA));
}

#[test]
fn a_head_that_falls_silent_leaves_a_freeze_frame_too() {
    let mut bench = Bench::running();
    // The bench's heart beats each 100 ms, and the first beat starts the watch.
    bench.run(200);
    bench.heartbeat = false;
    bench.until(State::StopDamped, 400);
    bench.heartbeat = true;
    bench.run(5);
    let frame = frozen(&mut bench);
    assert_eq!((frame.code, frame.source.detail), (0x8130, 127));
    assert_eq!(frame.state, State::Run);
}

#[test]
fn the_scope_captures_the_motion_that_was_asked_for() {
    let mut bench = Bench::running();
    scope(&mut bench, &[0x2010_0110, 0x2030_0110], 2, 1);
    bench.target = pose(200, 0, 0);
    let from = bench.millis;
    let mut told = Vec::new();
    for _ in 0..1_100 {
        bench.tick();
        told.push(bench.vertebra.pose().yaw.to_tenth_milliradians());
    }
    assert_eq!(bench.upload(0x2050, 7), Ok(vec![4]), "full");
    let (header, samples) = captured(&mut bench);
    assert_eq!((header.samples, header.divider), (512, 2));
    assert_eq!(
        header.first_us / 1_000,
        from,
        "begun by the turn that wrote the trigger"
    );
    // The first sample was taken before the first of `told`, and each is two ticks after the other.
    for (sample, told) in samples.iter().skip(1).zip(told.iter().skip(1).step_by(2)) {
        assert_eq!(*sample, [i32::from(*told), 24_000]);
    }
    assert!(samples[0][0] < 10 && samples[511][0] > 1_990, "it moved");
    assert_eq!(bench.upload(0x2050, 8), Ok(vec![0, 2]), "it is kept");
}

#[test]
fn the_scope_shows_what_led_to_a_fault_and_what_followed() {
    let mut bench = Bench::running();
    scope(&mut bench, &[0x2030_0110, 0x2011_0110], 1, 2);
    bench.run(1_000);
    assert_eq!(bench.upload(0x2050, 7), Ok(vec![2]), "it waits");
    for volts in (16..24).rev() {
        bench.sample.supply = Voltage::from_millivolts(volts * 1_000);
        bench.run(10);
    }
    assert_eq!(bench.state(), State::Fault);
    bench.run(400);
    let (header, samples) = captured(&mut bench);
    let fault = usize::from(header.fault.unwrap());
    assert_eq!((header.state, fault), (ScopeState::Full, 256));
    let supplies: Vec<i32> = samples.iter().map(|sample| sample[0]).collect();
    assert_eq!(supplies[fault - 1], 18_000);
    assert_eq!(supplies[fault], 17_000, "the tick of the fault itself");
    assert_eq!(supplies[fault - 11], 19_000);
    assert_eq!(supplies[511], 16_000);
    let frame = frozen(&mut bench);
    assert_eq!(header.first_us + 256 * 1_000, frame.at_us);
    assert_eq!(frame.supply, 17_000);
}

#[test]
fn reading_the_scope_ends_it_and_wrong_settings_are_refused() {
    let mut bench = Bench::running();
    assert_eq!(bench.download(0x2050, 6, &[1]), Err(DEVICE_STATE));
    assert_eq!(bench.download(0x2050, 6, &[3]), Err(0x0609_0031));
    let too_long = 0x2010_0120_u32.to_le_bytes();
    assert_eq!(bench.download(0x2050, 1, &too_long), Err(0x0604_0041));
    scope(&mut bench, &[0x2010_0110], 1, 2);
    bench.run(50);
    let (header, samples) = captured(&mut bench);
    assert_eq!(header.state, ScopeState::Waiting);
    assert!(samples.len() > 50);
    let (again, same) = captured(&mut bench);
    assert_eq!((again.state, same), (ScopeState::Stopped, samples));
}

#[test]
fn transfers_of_every_length_arrive_whole() {
    let mut bench = Bench::ready();
    for length in [0, 1, 4, 5, 7, 14, 889, 2_000_u32] {
        bench.download(0x2101, 2, &length.to_le_bytes()).unwrap();
        let bytes = bench.upload(0x2101, 1).unwrap();
        assert_eq!(bytes.len(), length as usize);
        for (k, byte) in bytes.iter().enumerate() {
            assert_eq!(usize::from(*byte), (7 * k + k / 256) % 256);
        }
        if length == 0 {
            continue;
        }
        bench.download(0x2101, 1, &bytes).unwrap();
        let crc = bench.upload(0x2101, 3).unwrap();
        assert_eq!(crc, Crc32::of(&bytes).to_le_bytes(), "{length} bytes");
    }
    assert_eq!(
        bench.download(0x2101, 2, &0x0100_0000_u32.to_le_bytes()),
        Err(0x0609_0031)
    );
}

#[test]
fn the_data_sheet_is_served_while_the_wrist_runs() {
    let mut bench = Bench::running();
    bench.mode = Mode::Run;
    let sheet = bench.upload(0x1021, 0).unwrap();
    let mut expected = String::new();
    eel_protocol::export::write_eds(&mut expected).unwrap();
    assert!(sheet == expected.as_bytes());
    assert_eq!(bench.upload(0x1022, 0), Ok(vec![0]));
    assert_eq!(bench.state(), State::Run);
}

#[test]
fn the_current_loop_s_time_is_read_as_its_platform_told_it() {
    let mut bench = Bench::ready();
    bench.vertebra.note_current_loop(4_321, 9_876);
    assert_eq!(bench.upload(0x2040, 4).unwrap(), 4_321_u16.to_le_bytes());
    assert_eq!(bench.upload(0x2040, 5).unwrap(), 9_876_u16.to_le_bytes());
}

//! The dictionary through the node: every entry is read and written over SDO.

use eel_canopen::{Access, Frame, NmtCommand};
use eel_protocol::dictionary::{self, DataType, Field, Object, Sub, entries};
use eel_protocol::{Condition, Mode, State};
use eel_units::{Current, Duration, Temperature, Voltage};

use eel_vertebra::{Calibration, Settings};
use support::{Bench, NODE, node, pose};

mod support;

const DEVICE_STATE: u32 = 0x0800_0022;
const TOO_LOW: u32 = 0x0609_0032;
const TOO_HIGH: u32 = 0x0609_0031;
const READ_ONLY: u32 = 0x0601_0002;
const NO_SUBINDEX: u32 = 0x0609_0011;
const NO_OBJECT: u32 = 0x0602_0000;

/// Sends an SDO request and returns the answer.
fn ask(bench: &mut Bench, request: [u8; 8]) -> [u8; 8] {
    let from = bench.sent.len();
    bench
        .extra
        .push(Frame::standard(0x600 + u16::from(NODE), &request).unwrap());
    bench.tick();
    let id = 0x580 + u16::from(NODE);
    let mut answers = bench.sent[from..]
        .iter()
        .filter(|sent| sent.frame.cob_id() == Some(id));
    let answer = answers.next().expect("an answer in the same turn").frame;
    assert!(answers.next().is_none());
    answer.data().try_into().unwrap()
}

/// Returns the abort code of an answer, if it is one.
fn abort(answer: [u8; 8]) -> Option<u32> {
    let [command, _, _, _, code @ ..] = answer;
    (command == 0x80).then(|| u32::from_le_bytes(code))
}

/// Reads an entry: its bytes, or the abort code.
fn read(bench: &mut Bench, index: u16, subindex: u8) -> Result<Vec<u8>, u32> {
    let [low, high] = index.to_le_bytes();
    let answer = ask(bench, [0x40, low, high, subindex, 0, 0, 0, 0]);
    if let Some(code) = abort(answer) {
        return Err(code);
    }
    assert_eq!(answer[0] & 0xF3, 0x43, "expedited, with its length");
    assert_eq!(answer[1..4], [low, high, subindex]);
    let length = 4 - usize::from(answer[0] >> 2 & 3);
    Ok(answer[4..4 + length].to_vec())
}

/// Writes an entry; the error is the abort code.
fn write(bench: &mut Bench, index: u16, subindex: u8, data: &[u8]) -> Result<(), u32> {
    let [low, high] = index.to_le_bytes();
    let mut request = [
        0x23 | ((4 - data.len() as u8) << 2),
        low,
        high,
        subindex,
        0,
        0,
        0,
        0,
    ];
    request[4..4 + data.len()].copy_from_slice(data);
    let answer = ask(bench, request);
    match abort(answer) {
        Some(code) => Err(code),
        None => {
            assert_eq!(answer, [0x60, low, high, subindex, 0, 0, 0, 0]);
            Ok(())
        }
    }
}

/// Returns the entries that hold a number.
fn numbers() -> impl Iterator<Item = (&'static Object, &'static Sub)> {
    entries().filter(|(_, sub)| !sub.data_type.is_domain())
}

fn place(field: Field) -> (u16, &'static Sub) {
    let (object, sub) = entries().find(|(_, sub)| sub.field == field).unwrap();
    (object.index, sub)
}

/// Reads an entry as a number.
fn number(bench: &mut Bench, field: Field) -> i64 {
    let (index, sub) = place(field);
    let bytes = read(bench, index, sub.subindex).unwrap();
    sub.data_type.decode(&bytes).unwrap()
}

/// Writes a number to an entry.
fn set(bench: &mut Bench, field: Field, value: i64) -> Result<(), u32> {
    let (index, sub) = place(field);
    write(bench, index, sub.subindex, &encode(sub.data_type, value))
}

fn encode(data_type: DataType, value: i64) -> Vec<u8> {
    value.to_le_bytes()[..usize::from(data_type.length())].to_vec()
}

/// Returns the fields of the settings.
fn settings() -> impl Iterator<Item = (u16, &'static Sub)> {
    dictionary::settings()
        .map(|(index, subindex)| (index, dictionary::find(index, subindex).unwrap().1))
}

#[test]
fn every_entry_is_read_with_its_length() {
    let mut bench = Bench::running();
    for (object, sub) in numbers() {
        let bytes = read(&mut bench, object.index, sub.subindex).unwrap();
        assert_eq!(
            bytes.len(),
            usize::from(sub.data_type.length()),
            "{}",
            object.dotted(sub)
        );
        let highest = read(&mut bench, object.index, 0).unwrap();
        assert_eq!(highest, [object.subs.len() as u8]);
        let beyond = read(&mut bench, object.index, object.highest() + 1);
        assert_eq!(beyond, Err(NO_SUBINDEX));
    }
    assert_eq!(read(&mut bench, 0x2003, 1), Err(NO_OBJECT));
}

#[test]
fn a_fresh_vertebra_has_the_defaults_of_the_table() {
    let mut bench = Bench::with(Settings {
        calibration: Calibration::NONE,
        ..Settings::prototype(node(), 77)
    });
    for (object, sub) in numbers().filter(|(_, sub)| sub.access != Access::ReadOnly) {
        let bytes = read(&mut bench, object.index, sub.subindex).unwrap();
        let value = sub.data_type.decode(&bytes).unwrap();
        assert_eq!(value, sub.default, "{}", object.dotted(sub));
    }
}

#[test]
fn settings_are_written_and_read_back_while_off() {
    for (mut bench, from) in [(Bench::new(), "not ready"), (Bench::ready(), "ready")] {
        bench.maintain();
        for (index, sub) in settings() {
            for value in [sub.default / 2 + 1, sub.min.max(1), sub.max, sub.default] {
                let bytes = encode(sub.data_type, value);
                assert_eq!(
                    write(&mut bench, index, sub.subindex, &bytes),
                    Ok(()),
                    "{from}"
                );
                let back = read(&mut bench, index, sub.subindex).unwrap();
                assert_eq!(back, bytes, "{} = {value}", sub.name);
            }
        }
    }
}

#[test]
fn settings_outside_their_bounds_are_refused_and_unchanged() {
    let mut bench = Bench::ready();
    for (index, sub) in settings() {
        let (lowest, highest) = sub.data_type.range();
        for (value, code) in [
            (sub.min - 1, TOO_LOW),
            (lowest, TOO_LOW),
            (sub.max + 1, TOO_HIGH),
            (highest, TOO_HIGH),
        ] {
            if (sub.min..=sub.max).contains(&value) || !(lowest..=highest).contains(&value) {
                continue;
            }
            let bytes = encode(sub.data_type, value);
            let refused = write(&mut bench, index, sub.subindex, &bytes);
            assert_eq!(refused, Err(code), "{} = {value}", sub.name);
            assert_eq!(number(&mut bench, sub.field), sub.default);
        }
    }
}

#[test]
fn settings_are_refused_in_operation_and_while_anything_drives_the_wrist() {
    for mode in [Mode::Run, Mode::Hold, Mode::Damped, Mode::Brake] {
        let mut bench = Bench::enabled(mode);
        refuses(&mut bench);
    }
    let mut bench = Bench::running();
    bench.stream = false;
    for state in [State::StopDamped, State::StopBrake] {
        bench.until(state, 2_500);
        refuses(&mut bench);
    }
    bench.until(State::StopOff, 2_500);
    refuses(&mut bench);
    bench.maintain();
    assert_eq!(set(&mut bench, Field::StiffnessX, 1_000), Ok(()));
}

fn refuses(bench: &mut Bench) {
    for (index, sub) in settings() {
        let bytes = encode(sub.data_type, sub.max);
        let before = number(bench, sub.field);
        let refused = write(bench, index, sub.subindex, &bytes);
        assert_eq!(
            refused,
            Err(DEVICE_STATE),
            "{} while {:?}",
            sub.name,
            bench.state()
        );
        assert_eq!(number(bench, sub.field), before);
    }
}

#[test]
fn measurements_and_constants_cannot_be_written() {
    let mut bench = Bench::ready();
    for (object, sub) in numbers() {
        if matches!(sub.access, Access::ReadOnly | Access::Constant) {
            let bytes = encode(sub.data_type, 0);
            let refused = write(&mut bench, object.index, sub.subindex, &bytes);
            assert_eq!(refused, Err(READ_ONLY), "{}", object.dotted(sub));
        }
    }
}

#[test]
fn a_setting_takes_effect_and_reset_node_takes_it_back() {
    let mut bench = Bench::ready();
    bench.maintain();
    set(&mut bench, Field::RangeYaw, 1_000).unwrap();
    bench.operate();
    bench.mode = Mode::Run;
    bench.target = pose(300, 0, 0);
    bench.run(300);
    let reference = bench.vertebra.reference().unwrap();
    assert_eq!(
        reference.yaw,
        eel_units::Angle::from_tenth_milliradians(1_000)
    );
    assert!(bench.holds(Condition::TargetLimited));
    bench.nmt(NmtCommand::ResetNode);
    bench.tick();
    assert_eq!(number(&mut bench, Field::RangeYaw), 5_236);
}

/// What can be written can be stored and started with: nothing that is taken is refused later.
#[test]
fn a_setting_that_makes_no_sense_is_refused_and_nothing_changes() {
    const TOO_LOW: u32 = 0x0609_0032;
    let mut bench = Bench::ready();
    bench.maintain();
    for field in [
        Field::PeakTorque,
        Field::RangeYaw,
        Field::RangePitch,
        Field::RangeRoll,
        Field::RateLimit,
    ] {
        let before = number(&mut bench, field);
        assert_eq!(set(&mut bench, field, 0), Err(TOO_LOW), "{field:?}");
        assert_eq!(number(&mut bench, field), before);
        set(&mut bench, field, 1).unwrap();
        bench.run(10);
        assert!(!bench.holds(Condition::Settings), "{field:?}");
    }
}

#[test]
fn the_allocation_tells_what_torque_sharing_could_not_produce() {
    let mut bench = Bench::running();
    bench.follows = false;
    bench.target = pose(50, 0, 0);
    bench.run(200);
    let achieved = number(&mut bench, Field::AchievedX);
    let left = number(&mut bench, Field::UnallocatedX);
    assert!(bench.holds(Condition::MomentLimited));
    // 0.05 rad at 400 N.m/rad asks for 20 N.m; two motors of 3 N.m make 6 about x at home.
    assert!(
        (19_950..=20_050).contains(&(achieved + left)),
        "{achieved} and {left}"
    );
    assert!((5_900..=6_010).contains(&achieved), "{achieved}");
    bench.mode = Mode::Off;
    bench.run(20);
    assert_eq!(number(&mut bench, Field::AchievedX), 0);
    assert_eq!(number(&mut bench, Field::UnallocatedX), 0);
}

#[test]
fn health_tells_what_was_measured_and_counted() {
    let mut bench = Bench::running();
    bench.sample.supply = Voltage::from_millivolts(23_456);
    bench.sample.board_temperature = Temperature::from_decidegrees(-123);
    bench.sample.motor_temperature = [101, 202, 303].map(Temperature::from_decidegrees);
    bench.sample.current = [500, -250, 0].map(Current::from_milliamps);
    bench.vertebra.note_overruns(7, 9);
    bench.damage = 1;
    bench.run(20);
    bench.damage = 0;
    // The counter goes on while two frames are lost.
    let _ = (bench.next_target(), bench.next_target());
    bench.run(20);
    for (field, expected) in [
        (Field::Supply, 23_456),
        (Field::BoardTemperature, -123),
        (Field::MotorTemperature1, 101),
        (Field::MotorTemperature2, 202),
        (Field::MotorTemperature3, 303),
        (Field::BadTargets, 2),
        // The two damaged ones did not count as received.
        (Field::LostTargets, 4),
        (Field::ReceiveOverruns, 7),
        (Field::TransmitOverruns, 9),
        (Field::EffortMotor1, 744),
        (Field::EffortMotor2, -372),
        (Field::EffortMotor3, 0),
        (Field::MotorAngle3, 785_398),
    ] {
        let value = number(&mut bench, field);
        let off = (value - expected).abs();
        let slack = if field == Field::MotorAngle3 { 72 } else { 0 };
        assert!(off <= slack, "{field:?}: {value} instead of {expected}");
    }
}

#[test]
fn timing_tells_how_long_a_turn_takes_and_where_sync_lies() {
    let mut bench = Bench::ready();
    bench.vertebra.note_loop_time(Duration::from_micros(250));
    bench.vertebra.note_loop_time(Duration::from_micros(90));
    assert_eq!(number(&mut bench, Field::LoopLast), 90);
    assert_eq!(number(&mut bench, Field::LoopMax), 250);
    // The platform measures SYNC; what it never tells is never followed.
    bench.run(1_000);
    for field in [Field::SyncPhase, Field::TickTrim, Field::TickLocked] {
        assert_eq!(number(&mut bench, field), 0, "{field:?}");
    }
    let syncs = |bench: &mut Bench, age_us, count| {
        for _ in 0..count {
            bench.sample.sync_age = Some(Duration::from_micros(age_us));
            bench.tick();
            bench.sample.sync_age = None;
            bench.run(9);
        }
    };
    syncs(&mut bench, 380, 3);
    assert_eq!(number(&mut bench, Field::SyncPhase), 80);
    // 80 µs too late: an eighth of it in the 10 ticks until the next SYNC, and a little that is learnt.
    let trim = number(&mut bench, Field::TickTrim);
    assert!((-1_200..=-1_000).contains(&trim), "{trim} ns");
    assert_eq!(trim, i64::from(bench.vertebra.tick_trim_ns()));
    syncs(&mut bench, 310, 20);
    assert_eq!(number(&mut bench, Field::TickLocked), 1);
    bench.run(250);
    assert_eq!(
        number(&mut bench, Field::TickLocked),
        0,
        "no SYNC for 200 ms"
    );
}

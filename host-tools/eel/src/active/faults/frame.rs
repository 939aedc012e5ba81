//! A freeze frame in words and as JSON.

use eel_protocol::emergency::{self, Emergency};
use eel_protocol::freeze::{FreezeFrame, TimeOfDay};
use eel_protocol::{Condition, LimitCode};
use serde_json::json;

use crate::active::Node;

/// Days from 1 January 1970 to 1 January 1984, from which TIME counts.
const DAYS_TO_1984: u64 = 5_113;

/// Returns the name of an emergency; its number where it is not of the catalogue.
pub fn name(code: u16) -> String {
    match emergency::from_code(code) {
        Some(known) => known.name.to_owned(),
        None => format!("0x{code:04X}"),
    }
}

/// Returns a frame for people, line by line.
pub fn lines(node: Node, frame: &FreezeFrame) -> Vec<String> {
    let mut lines = cause(node, frame);
    let rows = |label: &str, names: [&str; 3]| {
        let [a, b, c] = names;
        format!("  {label:<11}{a:>10}{b:>10}{c:>10}")
    };
    let angles = |raw: [i32; 3]| raw.map(|value| format!("{:.4}", f64::from(value) / 1e6));
    let thousandths = |raw: [i32; 3]| raw.map(|value| format!("{:.3}", f64::from(value) / 1e3));
    let row = |label: &str, cells: [String; 3], unit: &str| {
        let [a, b, c] = cells;
        format!("  {label:<11}{a:>10}{b:>10}{c:>10}  {unit}")
            .trim_end()
            .to_owned()
    };
    lines.push(rows("", ["yaw", "pitch", "roll"]));
    lines.push(row("pose", angles(frame.pose), "rad"));
    lines.push(match frame.reference {
        Some(reference) => row("reference", angles(reference), "rad"),
        None => "  reference    none: the wrist was not driven".to_owned(),
    });
    lines.push(rows("", ["motor 1", "motor 2", "motor 3"]));
    lines.push(row("angle", angles(frame.angles), "rad"));
    lines.push(row("speed", thousandths(frame.speeds), "rad/s"));
    lines.push(row("current", thousandths(frame.currents), "A"));
    let torques = frame.torques.map(i32::from);
    lines.push(row("torque", thousandths(torques), "N.m"));
    let limits = frame.limits.map(|limit| limit.name().to_owned());
    lines.push(row("limited by", limits, ""));
    let [board, motors @ ..] = temperatures(frame);
    lines.push(row(
        "temperature",
        motors.map(|value| format!("{value:.1}")),
        &format!("degC, board {board:.1}"),
    ));
    let supply = f64::from(frame.supply) / 1e3;
    lines.push(format!("  supply       {supply:.3} V"));
    let conditions: Vec<_> = frame.status.conditions().map(Condition::name).collect();
    lines.push(if conditions.is_empty() {
        "  status       nothing in the way".to_owned()
    } else {
        format!("  status       {}", conditions.join(", "))
    });
    let [bad, lost, received, sent] = frame.counters;
    lines.push(format!(
        "  counters     targets: {bad} refused, {lost} missed; frames lost: {received} coming in, {sent} \
         going out"
    ));
    lines
}

/// Returns what happened, where, when and what to do.
fn cause(node: Node, frame: &FreezeFrame) -> Vec<String> {
    let (code, count) = (frame.code, frame.count);
    let known = emergency::from_code(code);
    let title = known.map_or("an error of another version", |known| known.name);
    let mut lines = vec![format!(
        "{node}: {title} (0x{code:04X}), fault or stop {count} since power-up"
    )];
    let up = uptime(frame.at_us);
    lines.push(match frame.clock {
        Some(time) => format!("  when         {up} after power-up, {}", calendar(time)),
        None => format!("  when         {up} after power-up; the date is not known"),
    });
    lines.push(format!("  state        {} before", frame.state.name()));
    let source = frame.source;
    let limit = match LimitCode::from_code(source.limit) {
        Some(limit) if source.limit != 0 => format!(", limit {}", limit.name()),
        _ => String::new(),
    };
    lines.push(match source.motor {
        0 => format!("  where        the whole wrist{limit}"),
        motor => format!("  where        motor {motor}{limit}"),
    });
    let meaning = known.map_or("", |known: &Emergency| known.detail);
    if !meaning.is_empty() || source.detail != 0 {
        let line = format!("  detail       {}  {meaning}", source.detail);
        lines.push(line.trim_end().to_owned());
    }
    if let Some(known) = known {
        lines.push(format!("  advice       {}", known.sentence));
    }
    lines
}

/// Returns the temperatures in degrees, the board's first.
fn temperatures(frame: &FreezeFrame) -> [f64; 4] {
    frame.temperatures.map(|raw| f64::from(raw) / 10.0)
}

/// Returns a time since power-up as hours, minutes and seconds.
fn uptime(at_us: u64) -> String {
    let ms = at_us / 1_000;
    let (hours, rest) = (ms / 3_600_000, ms % 3_600_000);
    let (minutes, rest) = (rest / 60_000, rest % 60_000);
    format!(
        "{hours}:{minutes:02}:{:02}.{:03}",
        rest / 1_000,
        rest % 1_000
    )
}

/// Returns a moment as a date and a time of day.
fn calendar(time: TimeOfDay) -> String {
    // Howard Hinnant, chrono-compatible low-level date algorithms: civil_from_days, for years from 1 on.
    let days = u64::from(time.days) + DAYS_TO_1984 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + 400 * era + u64::from(month <= 2);
    let of_day = u64::from(time.ms);
    let (hours, minutes) = (of_day / 3_600_000, of_day / 60_000 % 60);
    let (seconds, ms) = (of_day / 1_000 % 60, of_day % 1_000);
    format!("{year}-{month:02}-{day:02} {hours:02}:{minutes:02}:{seconds:02}.{ms:03}")
}

/// Returns a frame for programs.
pub fn json(frame: &FreezeFrame) -> serde_json::Value {
    let known = emergency::from_code(frame.code);
    let millionths = |raw: [i32; 3]| raw.map(|value| f64::from(value) / 1e6);
    let thousandths = |raw: [i32; 3]| raw.map(|value| f64::from(value) / 1e3);
    let [board, motors @ ..] = temperatures(frame);
    let [bad, lost, received, sent] = frame.counters;
    let status: Vec<_> = frame.status.conditions().map(Condition::name).collect();
    json!({
        "code": frame.code, "name": known.map(|known| known.name),
        "advice": known.map(|known| known.sentence), "count": frame.count,
        "uptime_s": frame.at_us as f64 / 1e6, "time": frame.clock.map(calendar),
        "state": frame.state.name(), "motor": frame.source.motor, "limit": frame.source.limit,
        "detail": frame.source.detail, "detail_unit": known.map(|known| known.detail),
        "pose": millionths(frame.pose), "reference": frame.reference.map(millionths),
        "angles": millionths(frame.angles), "speeds": thousandths(frame.speeds),
        "currents": thousandths(frame.currents), "torques": thousandths(frame.torques.map(i32::from)),
        "limits": frame.limits.map(LimitCode::name), "supply": f64::from(frame.supply) / 1e3,
        "board_temperature": board, "motor_temperatures": motors, "status": status,
        "bad_targets": bad, "lost_targets": lost,
        "receive_overruns": received, "transmit_overruns": sent,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame as it comes over the bus: motor 2 blocked at 4 A while it ran.
    const BYTES: [u8; 128] = {
        let mut bytes = [0; 128];
        let head = [
            1, 3, 2, 3, 0x10, 0x23, 0xA0, 0x0F, // version, state, motor, limit, code, detail
            0x40, 0x39, 0x9B, 0xD8, 0, 0, 0, 0, // 3 634 051 392 µs
            9, 0, 0, 0, 3, 0, // ninth, with a clock and a reference
            0x35, 0x3D, 0xFF, 0x5B, 0x26, 0x05, // day 15 669, the last millisecond
        ];
        let mut place = 0;
        while place < head.len() {
            bytes[place] = head[place];
            place += 1;
        }
        // Yaw −10 000 µrad, reference of roll 65 536 µrad, current of motor 2 4 000 mA, supply 24 000 mV.
        (bytes[28], bytes[29], bytes[30], bytes[31]) = (0xF0, 0xD8, 0xFF, 0xFF);
        bytes[50] = 1;
        (bytes[80], bytes[81]) = (0xA0, 0x0F);
        (bytes[96], bytes[97]) = (0xC0, 0x5D);
        (bytes[100], bytes[101]) = (0x9C, 0xFF);
        bytes[102] = 250;
        bytes[109] = 2;
        bytes[112] = 7;
        bytes
    };

    fn frame() -> FreezeFrame {
        FreezeFrame::from_bytes(&BYTES).unwrap()
    }

    #[test]
    fn a_frame_says_what_happened_when_where_and_what_to_do() {
        let text = lines(Node(3), &frame()).join("\n");
        let limit = LimitCode::from_code(3).unwrap().name();
        let state = frame().state.name();
        let expected = format!(
            "\
vertebra 3: over-current (0x2310), fault or stop 9 since power-up
  when         1:00:34.051 after power-up, 2026-11-25 23:59:59.999
  state        {state} before
  where        motor 2, limit {limit}
  detail       4000  current in mA
  advice       A motor's current passed its hard limit: look for a blocked crank or a shorted winding.
                    yaw     pitch      roll
  pose          -0.0100    0.0000    0.0000  rad
  reference      0.0000    0.0000    0.0655  rad
                motor 1   motor 2   motor 3
  angle          0.0000    0.0000    0.0000  rad
  speed           0.000     0.000     0.000  rad/s
  current         0.000     4.000     0.000  A
  torque          0.000     0.000     0.000  N.m
  limited by       none      none      none
  temperature      25.0       0.0       0.0  degC, board -10.0
  supply       24.000 V
  status       latched
  counters     targets: 7 refused, 0 missed; frames lost: 0 coming in, 0 going out"
        );
        assert_eq!(text, expected);
    }

    #[test]
    fn what_is_not_known_is_told_instead_of_zeros() {
        let bare = FreezeFrame {
            clock: None,
            reference: None,
            code: 0x1234,
            ..frame()
        };
        let text = lines(Node(12), &bare).join("\n");
        assert!(text.starts_with("node 12: an error of another version (0x1234)"));
        assert!(text.contains("after power-up; the date is not known"));
        assert!(text.contains("reference    none"));
        assert!(!text.contains("advice"));
        let json = json(&bare);
        assert!(json["time"].is_null() && json["reference"].is_null() && json["name"].is_null());
    }

    #[test]
    fn json_has_the_same_numbers() {
        let json = json(&frame());
        assert_eq!(json["name"], "over-current");
        assert_eq!(json["currents"], json!([0.0, 4.0, 0.0]));
        assert_eq!(json["pose"], json!([-0.01, 0.0, 0.0]));
        assert_eq!(json["board_temperature"], -10.0);
        assert_eq!(json["status"], json!(["latched"]));
        assert_eq!(
            (&json["bad_targets"], &json["supply"]),
            (&json!(7), &json!(24.0))
        );
    }

    #[test]
    fn dates_are_those_of_the_calendar() {
        let date = |days| calendar(TimeOfDay { days, ms: 0 });
        assert_eq!(date(0), "1984-01-01 00:00:00.000");
        assert_eq!(date(59), "1984-02-29 00:00:00.000");
        assert_eq!(date(60), "1984-03-01 00:00:00.000");
        assert_eq!(date(365), "1984-12-31 00:00:00.000");
        assert_eq!(date(5_844), "2000-01-01 00:00:00.000");
    }
}

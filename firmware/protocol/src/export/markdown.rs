//! The tables as a page of the documentation.

use core::fmt::{Result, Write};

use super::Decimal;
use super::communication::communication_name;
use crate::communication::{self, Entry};
use crate::dictionary::{OBJECTS, Pdo, Sub};
use crate::emergency::CATALOGUE;
use crate::messages::{MESSAGES, Sender};
use crate::pdo::{PdoDefault, RPDOS, TPDOS};
use crate::procedure::{Check, Reason};
use crate::status::Condition;
use eel_canopen::Access;

/// Writes the page: messages, PDOs, dictionary, status word, emergencies.
///
/// # Errors
/// Those of `out`.
pub fn write_markdown(out: &mut dyn Write) -> Result {
    writeln!(out, "# The vertebra on the bus\n")?;
    writeln!(
        out,
        "Generated from `firmware/protocol` by `cargo xtask gen`; do not edit.\n"
    )?;
    writeln!(
        out,
        "Numbers are little-endian. Node ids: vertebrae 1 (behind the head) to 10, head 127."
    )?;
    write_messages(out)?;
    write_pdos(out)?;
    write_dictionary(out)?;
    write_status(out)?;
    write_emergencies(out)?;
    write_procedure(out)
}

fn write_messages(out: &mut dyn Write) -> Result {
    for message in MESSAGES {
        let node = if message.sender == Sender::Head {
            ""
        } else {
            " + node id"
        };
        writeln!(
            out,
            "\n## Message `{}`: 0x{:03X}{node}\n",
            message.name, message.cob_id_base
        )?;
        write!(out, "{} {} bytes", message.description, message.length)?;
        match message.period_ms {
            0 => writeln!(out, ", on event or request.\n")?,
            period => writeln!(out, ", every {period} ms.\n")?,
        }
        writeln!(
            out,
            "| signal | bits | step | unit | meaning |\n|---|---|---|---|---|"
        )?;
        for signal in message.signals {
            let last = signal.start + signal.bits - 1;
            let sign = if signal.signed { " signed" } else { "" };
            write!(
                out,
                "| `{}` | {}-{last}{sign} | {} | ",
                signal.name,
                signal.start,
                Decimal(signal.scale)
            )?;
            write!(out, "{} | {}", signal.unit, signal.description)?;
            if signal.name != "code" {
                for (place, (code, name)) in signal.choices.iter().enumerate() {
                    let lead = if place == 0 { " Codes: " } else { ", " };
                    write!(out, "{lead}{code} {name}")?;
                }
            }
            writeln!(out, " |")?;
        }
    }
    Ok(())
}

fn write_pdos(out: &mut dyn Write) -> Result {
    writeln!(out, "\n## PDOs at power-up\n")?;
    writeln!(
        out,
        "| PDO | COB-ID | transmission | on | mapping |\n|---|---|---|---|---|"
    )?;
    let row = |out: &mut dyn Write, kind: &str, number: usize, pdo: &PdoDefault| {
        let on = if pdo.enabled { "yes" } else { "no" };
        write!(
            out,
            "| {kind}{number} | 0x{:03X} + node id | type {} | {on} |",
            pdo.cob_id_base, pdo.transmission
        )?;
        for mapped in pdo.mapping {
            write!(
                out,
                " {:04X}:{} ({} bit)",
                mapped.index, mapped.subindex, mapped.bits
            )?;
        }
        writeln!(out, " |")
    };
    for (number, pdo) in (1..).zip(RPDOS) {
        row(out, "RPDO", number, pdo)?;
    }
    for (number, pdo) in (1..).zip(TPDOS) {
        row(out, "TPDO", number, pdo)?;
    }
    Ok(())
}

fn write_communication(out: &mut dyn Write) -> Result {
    writeln!(out, "\n## Objects 0x1000-0x1FFF\n")?;
    writeln!(
        out,
        "| entry | name | type | access | step | unit | meaning |\n|---|---|---|---|---|---|---|"
    )?;
    for (name, entry) in communication::entries() {
        let Entry {
            index, subindex, ..
        } = entry;
        let is_mapping = matches!(index & 0xFF00, 0x1600 | 0x1A00);
        if is_mapping && subindex > 1 {
            continue;
        }
        let access = if entry.is_writable { "rw" } else { "ro" };
        write!(
            out,
            "| {index:04X}:{subindex} | `{name}` | {} | {access} | {} | {} | ",
            entry.type_name(),
            Decimal(entry.scale),
            entry.unit
        )?;
        let title = communication_name(index).unwrap_or(entry.title);
        write!(out, "{title}")?;
        if title != entry.title {
            write!(out, ": {}", entry.title)?;
        }
        if is_mapping && subindex == 1 {
            write!(out, "; up to `.8`")?;
        }
        writeln!(out, " |")?;
    }
    Ok(())
}

fn write_dictionary(out: &mut dyn Write) -> Result {
    write_communication(out)?;
    for object in OBJECTS {
        writeln!(
            out,
            "\n## Object {:04X} `{}`\n\n{}\n",
            object.index, object.name, object.description
        )?;
        writeln!(
            out,
            "| entry | name | type | access | PDO | step | unit | default | range | meaning |"
        )?;
        writeln!(out, "|---|---|---|---|---|---|---|---|---|---|")?;
        for sub in object.subs {
            write!(
                out,
                "| {:04X}:{} | `{}` ",
                object.index,
                sub.subindex,
                object.dotted(sub)
            )?;
            write_row(out, sub)?;
        }
    }
    Ok(())
}

fn write_row(out: &mut dyn Write, sub: &Sub) -> Result {
    let access = match sub.access {
        Access::Constant => "const",
        Access::ReadOnly => "ro",
        Access::WriteOnly => "wo",
        Access::ReadWrite => "rw",
    };
    let pdo = match sub.pdo {
        Pdo::No => "",
        Pdo::Receive => "RPDO",
        Pdo::Transmit => "TPDO",
    };
    let data_type = sub.data_type.name();
    if sub.data_type.is_domain() {
        return writeln!(
            out,
            "| {data_type} | {access} | | | | | | {} |",
            sub.description
        );
    }
    let step = Decimal(sub.scale);
    write!(out, "| {data_type} | {access} | {pdo} | {step} ")?;
    write!(out, "| {} | {} ", sub.unit, sub.default)?;
    writeln!(out, "| {} to {} | {} |", sub.min, sub.max, sub.description)
}

fn write_status(out: &mut dyn Write) -> Result {
    writeln!(out, "\n## Status word, object 2010:6\n")?;
    writeln!(
        out,
        "| bit | name | refuses enabling | meaning |\n|---|---|---|---|"
    )?;
    for condition in Condition::ALL {
        let refuses = if condition.refuses() { "yes" } else { "no" };
        let (bit, name) = (condition.bit(), condition.name());
        writeln!(
            out,
            "| {bit} | {name} | {refuses} | {} |",
            condition.sentence()
        )?;
    }
    Ok(())
}

fn write_emergencies(out: &mut dyn Write) -> Result {
    writeln!(out, "\n## Emergencies\n")?;
    writeln!(
        out,
        "Bytes 3-7 of the message: motor (0 is the whole wrist), limit code, detail u16, reserved.\n"
    )?;
    writeln!(
        out,
        "| code | name | severity | register | detail | meaning |\n|---|---|---|---|---|---|"
    )?;
    for entry in CATALOGUE {
        write!(
            out,
            "| {:04X} | {} | {} ",
            entry.code,
            entry.name,
            entry.severity.name()
        )?;
        writeln!(
            out,
            "| {:02X} | {} | {} |",
            entry.register, entry.detail, entry.sentence
        )?;
    }
    Ok(())
}

fn write_procedure(out: &mut dyn Write) -> Result {
    writeln!(out, "\n## Why a procedure failed, object 2060:3\n")?;
    writeln!(out, "| number | meaning |\n|---|---|")?;
    for reason in Reason::ALL {
        writeln!(out, "| {} | {} |", *reason as u8, reason.sentence())?;
    }
    writeln!(out, "\n## Checks of the self test, objects 2060:5 and :6\n")?;
    writeln!(out, "| bit | name | what it looks at |\n|---|---|---|")?;
    for check in Check::ALL {
        let (bit, name) = (*check as u8, check.name());
        writeln!(out, "| {bit} | {name} | {} |", check.sentence())?;
    }
    Ok(())
}

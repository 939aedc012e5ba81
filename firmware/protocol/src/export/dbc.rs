//! The CAN database (Vector's DBC format), with the messages of all ten vertebrae.

use core::fmt::{Result, Write};

use super::Decimal;
use crate::ids::{HEAD_HEARTBEAT_MS, HEAD_NODE, NodeId};
use crate::messages::{MESSAGES, Message, Sender, Signal};

/// Writes the database: every message of every node under a name such as `vertebra3_pose`.
///
/// # Errors
/// Those of `out`.
pub fn write_dbc(out: &mut dyn Write) -> Result {
    write!(
        out,
        "VERSION \"{}\"\n\nNS_ :\n\nBS_:\n\nBU_: head",
        crate::identity::SOFTWARE_VERSION
    )?;
    for node in NodeId::all() {
        write!(out, " vertebra{}", node.get())?;
    }
    write!(out, "\n\n")?;
    each(|instance| instance.definition(out))?;
    each(|instance| instance.comments(out))?;
    write!(
        out,
        "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n"
    )?;
    each(|instance| instance.period(out))?;
    each(|instance| instance.values(out))
}

/// One message under one identifier; node 0 is a message that is not a node's.
struct Instance {
    message: &'static Message,
    node: u8,
}

/// Calls `act` for every message of every node, by rising identifier of node 0.
fn each(mut act: impl FnMut(&Instance) -> Result) -> Result {
    for message in MESSAGES {
        if message.sender == Sender::Head {
            act(&Instance { message, node: 0 })?;
            continue;
        }
        for node in NodeId::all() {
            act(&Instance {
                message,
                node: node.get(),
            })?;
        }
        if message.sender == Sender::Every {
            act(&Instance {
                message,
                node: HEAD_NODE,
            })?;
        }
    }
    Ok(())
}

impl Instance {
    fn id(&self) -> u16 {
        self.message.cob_id_base + u16::from(self.node)
    }

    fn owner(&self, out: &mut dyn Write) -> Result {
        match self.node {
            0 | HEAD_NODE => out.write_str("head"),
            node => write!(out, "vertebra{node}"),
        }
    }

    fn definition(&self, out: &mut dyn Write) -> Result {
        write!(out, "BO_ {} ", self.id())?;
        if self.node != 0 {
            self.owner(out)?;
            out.write_str("_")?;
        }
        write!(out, "{}: {} ", self.message.name, self.message.length)?;
        match self.message.sender {
            Sender::Head | Sender::HeadToEach => out.write_str("head")?,
            Sender::Vertebra | Sender::Every => self.owner(out)?,
        }
        writeln!(out)?;
        for signal in self.message.signals {
            self.signal(out, signal)?;
        }
        writeln!(out)
    }

    fn signal(&self, out: &mut dyn Write, signal: &Signal) -> Result {
        let Signal {
            name,
            start,
            bits,
            scale,
            unit,
            ..
        } = signal;
        let sign = if signal.signed { '-' } else { '+' };
        write!(
            out,
            " SG_ {name} : {start}|{bits}@1{sign} ({},0) ",
            Decimal(*scale)
        )?;
        // [0|0] says that the type's own range holds.
        write!(out, "[0|0] \"{unit}\" ")?;
        match self.message.sender {
            Sender::Head => out.write_str("Vector__XXX")?,
            Sender::HeadToEach => self.owner(out)?,
            Sender::Vertebra | Sender::Every => out.write_str("head")?,
        }
        writeln!(out)
    }

    fn comments(&self, out: &mut dyn Write) -> Result {
        let id = self.id();
        writeln!(out, "CM_ BO_ {id} \"{}\";", self.message.description)?;
        for signal in self.message.signals {
            writeln!(
                out,
                "CM_ SG_ {id} {} \"{}\";",
                signal.name, signal.description
            )?;
        }
        Ok(())
    }

    fn period(&self, out: &mut dyn Write) -> Result {
        let period = match (self.message.sender, self.node) {
            (Sender::Every, HEAD_NODE) => HEAD_HEARTBEAT_MS,
            _ => self.message.period_ms,
        };
        if period == 0 {
            return Ok(());
        }
        writeln!(out, "BA_ \"GenMsgCycleTime\" BO_ {} {period};", self.id())
    }

    fn values(&self, out: &mut dyn Write) -> Result {
        for signal in self.message.signals {
            if signal.choices.at(0).is_none() {
                continue;
            }
            write!(out, "VAL_ {} {}", self.id(), signal.name)?;
            for (code, name) in signal.choices.iter() {
                write!(out, " {code} \"{name}\"")?;
            }
            writeln!(out, " ;")?;
        }
        Ok(())
    }
}

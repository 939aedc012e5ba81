//! Which handler can interrupt which: the priorities that a board's source gives.

use std::fs;

use anyhow::{Context, Result, ensure};

use crate::firmware::Board;
use crate::process::clean_root;

/// Places in the vector table: the start, and what is above every interrupt.
const RESET: usize = 1;
const NON_MASKABLE: usize = 2;
const HARD_FAULT: usize = 3;

/// The interrupts that get another priority than 0, which each has after reset.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Priorities(Vec<(String, i32)>);

/// Reads a board's source.
///
/// # Errors
/// When it gives a priority in another way than `interrupt::UART4.set_priority(Priority::P5)`.
pub fn read(board: Board) -> Result<Priorities> {
    let folder = clean_root()
        .join("firmware")
        .join(board.package())
        .join("src");
    let mut priorities = Vec::new();
    let entries = fs::read_dir(&folder).with_context(|| format!("no {}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "rs") {
            priorities.extend(read_text(&fs::read_to_string(path)?)?.0);
        }
    }
    Ok(Priorities(priorities))
}

fn read_text(text: &str) -> Result<Priorities> {
    let mut priorities = Vec::new();
    for line in text.lines().filter(|line| line.contains("set_priority(")) {
        let found = line.trim().strip_prefix("interrupt::").and_then(|rest| {
            let (name, rest) = rest.split_once(".set_priority(Priority::P")?;
            Some((name.to_owned(), rest.strip_suffix(");")?.parse().ok()?))
        });
        priorities.push(found.with_context(|| {
            format!("write `{line}` as `interrupt::NAME.set_priority(Priority::P1);`")
        })?);
    }
    Ok(Priorities(priorities))
}

/// Names a handler by its place in the vector table and its symbols.
pub fn name(place: usize, symbols: &[&str]) -> String {
    let is_interrupt = |name: &str| {
        let mut letters = name.bytes();
        letters.all(|it| it.is_ascii_uppercase() || it.is_ascii_digit() || it == b'_')
    };
    let name = match place {
        RESET => "main thread",
        _ if symbols.iter().any(|it| it.starts_with("DefaultHandler")) => "DefaultHandler",
        NON_MASKABLE => "NonMaskableInt",
        HARD_FAULT => "HardFault",
        _ => {
            let mut symbols = symbols.iter().copied();
            symbols.find(|it| is_interrupt(it)).unwrap_or("?")
        }
    };
    name.to_owned()
}

impl Priorities {
    /// Returns the priority of a handler; the lower number interrupts the higher. The main thread has
    /// none.
    pub fn of(&self, place: usize, symbols: &[&str]) -> Option<i32> {
        let mut given = self.0.iter();
        match place {
            RESET => None,
            NON_MASKABLE => Some(-2),
            HARD_FAULT => Some(-1),
            _ => Some(
                given
                    .find(|(name, _)| symbols.contains(&name.as_str()))
                    .map_or(0, |(_, priority)| *priority),
            ),
        }
    }

    /// Looks for a priority that is given to an interrupt without a handler.
    ///
    /// # Errors
    /// When there is one.
    pub fn complain_unless_used(&self, handlers: &[&str]) -> Result<()> {
        for (name, _) in &self.0 {
            ensure!(
                handlers.contains(&name.as_str()),
                "{name} gets a priority, and has no handler"
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_priorities_and_refuses_another_way_to_give_them() {
        let text = "    interrupt::UART4.set_priority(Priority::P5);\n    other();\n\
                    interrupt::ADC1_2.set_priority(Priority::P4);";
        let priorities = read_text(text).unwrap();
        let given = [("UART4".to_owned(), 5), ("ADC1_2".to_owned(), 4)];
        assert_eq!(priorities, Priorities(given.into()));
        assert!(read_text("nvic.set_priority(Interrupt::UART4, 80);").is_err());
        assert!(
            priorities
                .complain_unless_used(&["ADC1_2", "UART4"])
                .is_ok()
        );
        assert!(priorities.complain_unless_used(&["ADC1_2"]).is_err());
    }

    #[test]
    fn a_handler_has_the_priority_that_is_given_or_that_of_a_reset() {
        let priorities = Priorities(vec![("UART4".to_owned(), 5)]);
        assert_eq!(priorities.of(1, &["Reset"]), None);
        assert_eq!(priorities.of(2, &["NonMaskableInt"]), Some(-2));
        assert_eq!(priorities.of(68, &["UART4"]), Some(5));
        assert_eq!(priorities.of(66, &["TIM5"]), Some(0));
    }

    #[test]
    fn names_handlers_as_the_manual_does() {
        assert_eq!(name(1, &["__stext", "Reset"]), "main thread");
        assert_eq!(name(38, &["DefaultPreInit", "FDCAN1_IT1"]), "FDCAN1_IT1");
        assert_eq!(name(4, &["ADC3", "DefaultHandler"]), "DefaultHandler");
    }
}

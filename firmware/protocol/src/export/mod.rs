//! The tables as files that other tools read: EDS, DBC, markdown.
//!
//! The files depend on the tables alone, so that a checked-in copy can be held against them byte
//! for byte.

mod communication;
mod dbc;
mod eds;
mod markdown;

use core::fmt;

use crate::dictionary::Scale;

#[cfg(test)]
pub(crate) use communication::Shape;
pub use communication::communication_name;
pub(crate) use communication::{AREA, Item, MAPPED, PARAMETERS};
pub use dbc::write_dbc;
pub use eds::write_eds;
pub use markdown::write_markdown;

/// A fraction written out as a decimal number, exactly where it ends within 20 digits.
struct Decimal(Scale);

impl fmt::Display for Decimal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Scale {
            numerator,
            denominator,
        } = self.0;
        let (whole, mut rest) = (numerator / denominator, u64::from(numerator % denominator));
        write!(out, "{whole}")?;
        let mut digits = 0;
        while rest != 0 && digits < 20 {
            if digits == 0 {
                out.write_str(".")?;
            }
            rest *= 10;
            write!(out, "{}", rest / u64::from(denominator))?;
            rest %= u64::from(denominator);
            digits += 1;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::string::{String, ToString};

    use super::*;
    use crate::dictionary::entries;

    #[test]
    fn every_scale_of_the_dictionary_is_written_exactly() {
        for (object, sub) in entries() {
            let text = Decimal(sub.scale).to_string();
            let (whole, digits) = text.split_once('.').unwrap_or((&text, ""));
            assert!(digits.len() < 20, "{}: {text}", object.dotted(sub));
            let all: u128 = (String::from(whole) + digits).parse().unwrap();
            let power = 10_u128.pow(digits.len() as u32);
            let exact = u128::from(sub.scale.numerator) * power;
            assert_eq!(all * u128::from(sub.scale.denominator), exact, "{text}");
        }
    }

    #[test]
    fn a_decimal_is_written_as_people_write_it() {
        let text = |numerator, denominator| {
            Decimal(Scale {
                numerator,
                denominator,
            })
            .to_string()
        };
        assert_eq!(text(1, 10_000), "0.0001");
        assert_eq!(text(1, 32_768), "0.000030517578125");
        assert_eq!(text(5, 2), "2.5");
        assert_eq!(text(3, 1), "3");
    }

    /// Files are read by tools on any system: ASCII, no trailing blanks, a newline at the end.
    #[test]
    fn files_are_plain_text() {
        let mut files = [const { String::new() }; 3];
        write_eds(&mut files[0]).unwrap();
        write_dbc(&mut files[1]).unwrap();
        write_markdown(&mut files[2]).unwrap();
        for file in files {
            assert!(file.is_ascii());
            assert!(file.ends_with('\n') && !file.ends_with("\n\n"));
            assert!(file.lines().all(|line| line.trim_end() == line));
        }
    }
}

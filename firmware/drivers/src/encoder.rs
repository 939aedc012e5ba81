//! An absolute magnetic encoder on SPI: AMS AS5047P (data sheet DS000324 v1-13, 5 and 6).
//!
//! A word of 16 bits goes out and the answer to the word before it comes in. Every reading asks for
//! the angle and then for the diagnostics, whose answer comes in with the next reading: two words a
//! reading, and a line that is stuck low can't pass for an angle of 0.

use eel_units::Angle;
use embedded_hal::spi::SpiDevice;

/// Reads register 0x3FFF: the angle, corrected for speed.
const READ_ANGLE: u16 = command(0x3FFF);
/// Reads register 0x3FFC: diagnostics and gain control.
const READ_DIAGNOSTICS: u16 = command(0x3FFC);

/// An answer's bit that reports an error of the word before.
const ERROR_FLAG: u16 = 1 << 14;
const MAGNET_TOO_WEAK: u16 = 1 << 11;
const MAGNET_TOO_STRONG: u16 = 1 << 10;
const OVERFLOW: u16 = 1 << 9;
const READY: u16 = 1 << 8;

/// Why there is no angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EncoderError {
    /// The SPI failed.
    Bus,
    /// A word's parity is wrong.
    Parity,
    /// The encoder did not understand what it was sent.
    Refused,
    /// The encoder is starting up, or nothing answers.
    NotReady,
    /// The magnet is too far away or too close.
    Magnet,
}

/// One encoder, whose zero is programmed to the crank's.
#[derive(Debug)]
pub struct AbsoluteEncoder<Spi> {
    spi: Spi,
    has_asked: bool,
}

impl<Spi: SpiDevice> AbsoluteEncoder<Spi> {
    /// Takes an encoder's connection, SPI mode 1 at 10 MHz or less; the first reading is not ready.
    pub const fn new(spi: Spi) -> Self {
        Self {
            spi,
            has_asked: false,
        }
    }

    /// Returns the angle, −π to π in steps of 2π/2¹⁴.
    ///
    /// # Errors
    /// Says why there is none; the next reading may work.
    pub fn read(&mut self) -> Result<Angle, EncoderError> {
        let had_asked = core::mem::replace(&mut self.has_asked, false);
        let diagnostics = self.exchange(READ_ANGLE)?;
        let angle = self.exchange(READ_DIAGNOSTICS)?;
        self.has_asked = true;
        if !had_asked {
            return Err(EncoderError::NotReady);
        }
        check_answer(diagnostics)?;
        check_answer(angle)?;
        if diagnostics & READY == 0 {
            return Err(EncoderError::NotReady);
        }
        if diagnostics & (MAGNET_TOO_WEAK | MAGNET_TOO_STRONG | OVERFLOW) != 0 {
            return Err(EncoderError::Magnet);
        }
        Ok(to_angle(angle))
    }

    /// Sends a word and returns the answer to the word before.
    fn exchange(&mut self, word: u16) -> Result<u16, EncoderError> {
        let mut bytes = word.to_be_bytes();
        self.spi
            .transfer_in_place(&mut bytes)
            .map_err(|_| EncoderError::Bus)?;
        Ok(u16::from_be_bytes(bytes))
    }
}

/// Returns the word that reads a register, with its parity.
const fn command(register: u16) -> u16 {
    let word = register | 1 << 14;
    word | ((word.count_ones() as u16 & 1) << 15)
}

/// Checks what every answer has: even parity and no error reported.
const fn check_answer(word: u16) -> Result<(), EncoderError> {
    if word.count_ones() & 1 != 0 {
        Err(EncoderError::Parity)
    } else if word & ERROR_FLAG != 0 {
        Err(EncoderError::Refused)
    } else {
        Ok(())
    }
}

/// Makes an angle of the lower 14 bits, wrong by at most one step of [`Angle`].
const fn to_angle(word: u16) -> Angle {
    // Sign-extends 14 bits to 16, which leaves the value times 4: 2¹⁵ is half a turn.
    let quadruple = (word << 2) as i16;
    Angle::from_q29(((quadruple as i64 * Angle::PI.to_q29() as i64) >> 15) as i32)
}

#[cfg(test)]
mod tests {
    use embedded_hal_mock::eh1::spi::{Mock as Spi, Transaction};

    use super::*;

    /// Answers of an encoder in good health.
    const HEALTHY: u16 = with_parity(READY | 0x80);

    const fn with_parity(word: u16) -> u16 {
        word | ((word.count_ones() as u16 & 1) << 15)
    }

    /// Reads as often as there are pairs of answers: diagnostics, angle.
    fn read_all(answers: &[(u16, u16)]) -> Result<Angle, EncoderError> {
        let mut expected = std::vec::Vec::new();
        for &(diagnostics, angle) in answers {
            for (word, answer) in [(0xFFFF, diagnostics), (0xFFFC, angle)] {
                let (word, answer) = (u16::to_be_bytes(word), answer.to_be_bytes());
                expected.push(Transaction::transaction_start());
                expected.push(Transaction::transfer_in_place(
                    word.to_vec(),
                    answer.to_vec(),
                ));
                expected.push(Transaction::transaction_end());
            }
        }
        let mut spi = Spi::new(&expected);
        let mut encoder = AbsoluteEncoder::new(spi.clone());
        let mut last = Err(EncoderError::Bus);
        for _ in answers {
            last = encoder.read();
        }
        spi.done();
        last
    }

    /// Reads twice, the second time with these answers.
    fn read(diagnostics: u16, angle: u16) -> Result<Angle, EncoderError> {
        read_all(&[(0, 0), (diagnostics, angle)])
    }

    #[test]
    fn sends_the_words_of_the_data_sheet() {
        // ANGLECOM and DIAAGC with the read bit and even parity.
        assert_eq!((READ_ANGLE, READ_DIAGNOSTICS), (0xFFFF, 0xFFFC));
    }

    #[test]
    fn turns_every_word_into_its_angle() {
        for raw in 0..1_u16 << 14 {
            let signed = if raw < 1 << 13 {
                i32::from(raw)
            } else {
                i32::from(raw) - (1 << 14)
            };
            let exact = f64::from(signed) / f64::from(1 << 13) * core::f64::consts::PI;
            let error = f64::from(to_angle(raw).to_q29()) - exact * f64::from(1 << 29);
            assert!(error.abs() <= 1.5, "{raw}: {error}");
        }
    }

    #[test]
    fn reads_a_quarter_of_a_turn() {
        let angle = read(HEALTHY, with_parity(1 << 12)).unwrap();
        assert!((angle - Angle::FRAC_PI_2).abs() <= Angle::from_q29(1));
    }

    #[test]
    fn gives_no_angle_before_diagnostics_were_asked_for() {
        let first = read_all(&[(HEALTHY, HEALTHY)]);
        assert_eq!(first, Err(EncoderError::NotReady));
    }

    #[test]
    fn takes_no_stuck_line_for_an_angle() {
        assert_eq!(read(0x0000, 0x0000), Err(EncoderError::NotReady));
        assert_eq!(read(0xFFFF, 0xFFFF), Err(EncoderError::Refused));
    }

    #[test]
    fn finds_every_single_bit_error() {
        let angle = with_parity(0x1234);
        assert!(read(HEALTHY, angle).is_ok());
        for bit in 0..16 {
            assert_eq!(read(HEALTHY, angle ^ 1 << bit), Err(EncoderError::Parity));
            assert_eq!(read(HEALTHY ^ 1 << bit, angle), Err(EncoderError::Parity));
        }
    }

    #[test]
    fn refuses_an_angle_of_a_bad_magnet() {
        for fault in [MAGNET_TOO_WEAK, MAGNET_TOO_STRONG, OVERFLOW] {
            let diagnostics = with_parity(READY | fault);
            assert_eq!(read(diagnostics, 0), Err(EncoderError::Magnet));
        }
    }
}

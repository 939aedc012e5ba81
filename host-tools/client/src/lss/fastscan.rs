//! Fastscan: finding nodes without an id bit by bit (CiA 305, 5.4.5).
//!
//! A node answers when the upper bits of one of its four numbers are those that the master sends.
//! Several that agree answer together, so silence means that no node agrees. What is sent with
//! all 32 bits moves those that agree on to their next number; the others fall out.

use std::time::{Duration, Instant};

use eel_protocol::Cob;
use eel_transport::Bus;

use super::{Lss, LssAddress};
use crate::error::{ClientError, LssFailure};

const FASTSCAN: u8 = 0x51;
const IDENTIFIED: u8 = 0x4F;
/// The number of bits that starts the scan anew.
const RESET: u8 = 0x80;
/// Numbers of an identity.
const NUMBERS: u8 = 4;
/// How often a scan whose steps contradict each other is begun anew, with twice the patience.
const ATTEMPTS: u32 = 3;
/// Most nodes that are listed.
const MOST: usize = 127;

/// What one attempt found.
enum Attempt<T> {
    /// It went through.
    Done(T),
    /// No node without an id answered.
    Nobody,
    /// An answer that must come did not come.
    Contradiction,
}

/// One question of the scan.
#[derive(Clone, Copy)]
struct Question {
    number: u32,
    bits: u8,
    place: u8,
    next: u8,
}

impl<B: Bus> Lss<'_, B> {
    /// Finds one node without an id and puts it into configuration; `None` where there is none.
    ///
    /// `guess` is an identity that it probably has, but for the serial number: where it holds, the
    /// scan takes a quarter of the time. Takes about a step of [`Settings::lss`](crate::Settings)
    /// for each bit that is 1.
    ///
    /// # Errors
    /// [`LssFailure::Unsteady`], and what the bus fails with.
    pub fn scan(&mut self, guess: Option<LssAddress>) -> Result<Option<LssAddress>, ClientError> {
        self.repeat(|scan, patience| {
            if !scan.begin(patience)? {
                return Ok(Attempt::Nobody);
            }
            let guesses = guess.map_or([None; 4], |guess| {
                let [vendor, product, revision, _] = guess.numbers().map(Some);
                [vendor, product, revision, None]
            });
            let mut numbers = [0; NUMBERS as usize];
            for ((place, slot), guess) in (0..).zip(&mut numbers).zip(guesses) {
                let next = (place + 1) % NUMBERS;
                if let Some(number) = guess
                    && scan.confirm(number, place, next, patience)?
                {
                    *slot = number;
                    continue;
                }
                *slot = scan.lowest(place, patience)?;
                if !scan.confirm(*slot, place, next, patience)? {
                    return Ok(Attempt::Contradiction);
                }
            }
            Ok(Attempt::Done(LssAddress::from_numbers(numbers)))
        })
    }

    /// Lists all nodes without an id and changes nothing.
    ///
    /// # Errors
    /// [`LssFailure::Unsteady`], and what the bus fails with.
    pub fn list(&mut self) -> Result<Vec<LssAddress>, ClientError> {
        let found = self.repeat(|scan, patience| {
            let mut prefixes = vec![vec![]];
            for place in 0..NUMBERS {
                let mut longer = Vec::new();
                for prefix in prefixes {
                    if !scan.walk(&prefix, patience)? {
                        // Where there is nobody at all, nothing contradicts anything.
                        return Ok(if place == 0 {
                            Attempt::Nobody
                        } else {
                            Attempt::Contradiction
                        });
                    }
                    let numbers = scan.all(place, patience)?;
                    if numbers.is_empty() {
                        return Ok(Attempt::Contradiction);
                    }
                    longer.extend(numbers.into_iter().map(|number| {
                        let mut all = prefix.clone();
                        all.push(number);
                        all
                    }));
                }
                prefixes = longer;
                prefixes.truncate(MOST);
            }
            Ok(Attempt::Done(prefixes))
        })?;
        // Leaves the nodes at their first number.
        let patience = self.client.settings().lss;
        let found = found.unwrap_or_default();
        if !found.is_empty() {
            self.begin(patience)?;
        }
        let addresses = found
            .into_iter()
            .filter_map(|numbers| numbers.try_into().ok());
        Ok(addresses.map(LssAddress::from_numbers).collect())
    }

    /// Tries until an attempt goes through.
    fn repeat<T>(
        &mut self,
        mut attempt: impl FnMut(&mut Self, Duration) -> Result<Attempt<T>, ClientError>,
    ) -> Result<Option<T>, ClientError> {
        for number in 0..ATTEMPTS {
            let patience = self.client.settings().lss * (1 << number);
            match attempt(self, patience)? {
                Attempt::Done(found) => return Ok(Some(found)),
                Attempt::Nobody if number == 0 => return Ok(None),
                // Somebody answered before.
                Attempt::Nobody | Attempt::Contradiction => {}
            }
        }
        Err(LssFailure::Unsteady.into())
    }

    /// Leads all nodes to their first number, and tells whether there are any; silence is asked
    /// twice, as nothing else shows that an answer got lost.
    fn begin(&mut self, patience: Duration) -> Result<bool, ClientError> {
        Ok(
            self.question(Question::RESET, patience)?
                || self.question(Question::RESET, patience)?,
        )
    }

    /// Begins anew and leads the nodes with these first numbers to the number after them.
    fn walk(&mut self, prefix: &[u32], patience: Duration) -> Result<bool, ClientError> {
        if !self.begin(patience)? {
            return Ok(false);
        }
        for (place, number) in (0..).zip(prefix) {
            if !self.confirm(*number, place, place + 1, patience)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Finds the lowest number at `place`; where nobody answers all bits are 1.
    fn lowest(&mut self, place: u8, patience: Duration) -> Result<u32, ClientError> {
        let mut number = 0;
        for bits in (0..32).rev() {
            let question = Question {
                number,
                bits,
                place,
                next: place,
            };
            if !self.question(question, patience)? {
                number |= 1 << bits;
            }
        }
        Ok(number)
    }

    /// Finds all numbers at `place`, each bit being asked for both of its values.
    fn all(&mut self, place: u8, patience: Duration) -> Result<Vec<u32>, ClientError> {
        let mut found = vec![0_u32];
        for bits in (0..32).rev() {
            let mut longer = Vec::new();
            for number in found {
                for number in [number, number | 1 << bits] {
                    let question = Question {
                        number,
                        bits,
                        place,
                        next: place,
                    };
                    if self.question(question, patience)? {
                        longer.push(number);
                    }
                }
            }
            found = longer;
            found.truncate(MOST);
        }
        Ok(found)
    }

    /// Asks for a whole number and moves those that have it on.
    fn confirm(
        &mut self,
        number: u32,
        place: u8,
        next: u8,
        patience: Duration,
    ) -> Result<bool, ClientError> {
        let question = Question {
            number,
            bits: 0,
            place,
            next,
        };
        self.question(question, patience)
    }

    /// Asks one question and tells whether anybody answered.
    fn question(&mut self, question: Question, patience: Duration) -> Result<bool, ClientError> {
        let Question {
            number,
            bits,
            place,
            next,
        } = question;
        let [a, b, c, d] = number.to_le_bytes();
        self.client.drain()?;
        self.send([FASTSCAN, a, b, c, d, bits, place, next])?;
        let deadline = Instant::now() + patience;
        let id = Cob::LssResponse.id();
        while let Some([command, ..]) = self.client.await_frame(id, deadline)? {
            if command == IDENTIFIED {
                let settle = self.client.settings().lss_settle;
                self.client.listen(settle)?;
                return Ok(true);
            }
        }
        Ok(false)
    }
}

impl Question {
    const RESET: Self = Self {
        number: 0,
        bits: RESET,
        place: 0,
        next: 0,
    };
}

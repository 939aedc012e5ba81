//! The electronic data sheet as the vertebra carries it, for object 0x1021.
//!
//! The text is kept as a grammar: a short list of symbols stands for it, and a rule for each symbol
//! that is no character says which two symbols it stands for. Reading expands one symbol after the
//! other with a small stack and no window, so a reader takes 48 bytes of RAM and goes forwards only;
//! going back begins anew. `cargo xtask gen` writes the grammar from the same table as
//! docs/generated/vertebra.eds, which is the text byte for byte.
//!
//! Layout, little-endian: length of the text u32, count of characters u8, of rules u16, of symbols u16,
//! bits of a code u8; the characters, rising; then codes of that many bits, lowest bit first: two for
//! each rule, then the symbols. A code below the count of characters is a character, one above is a
//! rule; a rule names only characters and the rules before it.

use heapless::Vec;

/// The data sheet, compressed.
pub const COMPRESSED: &[u8] = include_bytes!("vertebra.grammar");

/// Length of what stands before the characters, in bytes.
pub const HEADER: usize = 10;
/// The most symbols that wait while one is expanded; the compressor keeps to it.
pub const DEPTH: usize = 20;

/// The grammar of a text.
#[derive(Clone, Copy, Debug)]
pub struct Grammar<'a> {
    length: u32,
    rules: u16,
    symbols: u16,
    width: u8,
    characters: &'a [u8],
    codes: &'a [u8],
}

/// Reads a text from its start to its end.
#[derive(Clone, Debug, Default)]
pub struct Reader {
    /// How many bytes of the text have been read.
    offset: u32,
    /// How many symbols have been taken.
    taken: u16,
    waiting: Vec<u16, DEPTH>,
}

impl<'a> Grammar<'a> {
    /// Takes a grammar apart; `None` where the bytes are none, or not all of it.
    pub fn new(bytes: &'a [u8]) -> Option<Self> {
        let (header, rest) = bytes.split_first_chunk::<HEADER>()?;
        let &[a, b, c, d, characters, r0, r1, s0, s1, width] = header;
        let (rules, symbols) = (u16::from_le_bytes([r0, r1]), u16::from_le_bytes([s0, s1]));
        let (characters, codes) = rest.split_at_checked(usize::from(characters))?;
        let count = 2 * usize::from(rules) + usize::from(symbols);
        let is_whole =
            (1..=16).contains(&width) && codes.len() == (count * usize::from(width)).div_ceil(8);
        is_whole.then_some(Self {
            length: u32::from_le_bytes([a, b, c, d]),
            rules,
            symbols,
            width,
            characters,
            codes,
        })
    }

    /// Returns the length of the text in bytes.
    pub const fn length(&self) -> u32 {
        self.length
    }

    /// Returns the code at a place among all codes.
    fn code(&self, place: usize) -> Option<u16> {
        let start = place.checked_mul(usize::from(self.width))?;
        let mut bits = 0_u32;
        for (shift, at) in (0..3).zip(start / 8..) {
            let byte = self.codes.get(at).copied().unwrap_or_default();
            bits |= u32::from(byte) << (8 * shift);
        }
        let mask = (1_u32 << self.width) - 1;
        Some((bits >> (start % 8) & mask) as u16)
    }

    /// Returns the two codes of a rule.
    fn rule(&self, number: u16) -> Option<(u16, u16)> {
        let place = 2 * usize::from(number);
        (number < self.rules).then_some((self.code(place)?, self.code(place + 1)?))
    }

    /// Returns a symbol of the text.
    fn symbol(&self, number: u16) -> Option<u16> {
        let place = 2 * usize::from(self.rules) + usize::from(number);
        (number < self.symbols).then(|| self.code(place))?
    }
}

impl Reader {
    /// Returns how many bytes have been read.
    pub const fn offset(&self) -> u32 {
        self.offset
    }

    /// Reads the text from `offset` on into `out` and returns how many bytes: fewer than fit only at the
    /// end, or where the grammar is broken. Going back costs reading from the start.
    pub fn read(&mut self, grammar: &Grammar<'_>, offset: u32, out: &mut [u8]) -> usize {
        if offset < self.offset {
            *self = Self::default();
        }
        while self.offset < offset {
            if self.next(grammar).is_none() {
                return 0;
            }
        }
        let mut count = 0;
        for to in out {
            let Some(byte) = self.next(grammar) else {
                break;
            };
            *to = byte;
            count += 1;
        }
        count
    }

    /// Returns the next byte. Expands at most [`DEPTH`] rules: each takes a place of the stack.
    fn next(&mut self, grammar: &Grammar<'_>) -> Option<u8> {
        if self.offset >= grammar.length {
            return None;
        }
        let mut code = match self.waiting.pop() {
            Some(code) => code,
            None => {
                let code = grammar.symbol(self.taken)?;
                self.taken += 1;
                code
            }
        };
        for _ in 0..=DEPTH {
            let Some(rule) = code.checked_sub(grammar.characters.len() as u16) else {
                self.offset += 1;
                return grammar.characters.get(usize::from(code)).copied();
            };
            let (first, second) = grammar.rule(rule)?;
            self.waiting.push(second).ok()?;
            code = first;
        }
        None
    }
}

#[cfg(test)]
mod tests;

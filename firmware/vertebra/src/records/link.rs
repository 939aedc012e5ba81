//! The test of transfers, object 0x2101: a pattern to read, a check of what is written.

use eel_protocol::Crc32;
use eel_protocol::dictionary::Field;

/// What is read and what came.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Link {
    /// Length of what is read; that of an open transfer is its own.
    pub length: u32,
    /// Check of the last bytes that came whole.
    pub crc: u32,
    opened: u32,
    coming: Crc32,
}

impl Default for Link {
    fn default() -> Self {
        Self {
            length: const { Field::LinkLength.sub().default as u32 },
            crc: 0,
            opened: 0,
            coming: Crc32::default(),
        }
    }
}

impl Link {
    /// Opens the pattern and returns its length.
    pub fn open(&mut self) -> u32 {
        self.opened = self.length;
        self.opened
    }

    /// Copies the pattern from `offset` on.
    pub fn read(&self, offset: u32, out: &mut [u8]) -> usize {
        let mut count = 0;
        for (to, place) in out.iter_mut().zip(offset..self.opened) {
            *to = pattern(place);
            count += 1;
        }
        count
    }

    /// Begins to take bytes.
    pub fn begin(&mut self) {
        self.coming = Crc32::default();
    }

    /// Takes bytes.
    pub fn write(&mut self, bytes: &[u8]) {
        self.coming.update(bytes);
    }

    /// Ends the bytes: all came, or they are void.
    pub const fn end(&mut self, is_whole: bool) {
        if is_whole {
            self.crc = self.coming.value();
        }
    }
}

/// Returns a byte of the pattern: (7·k + k/256) mod 256.
const fn pattern(place: u32) -> u8 {
    place.wrapping_mul(7).wrapping_add(place >> 8) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pattern_is_what_the_dictionary_says() {
        let mut link = Link {
            length: 2_000,
            ..Link::default()
        };
        assert_eq!(link.open(), 2_000);
        link.length = 3;
        let mut out = [0; 2_100];
        assert_eq!(link.read(0, &mut out), 2_000);
        for (k, byte) in out[..2_000].iter().enumerate() {
            assert_eq!(usize::from(*byte), (7 * k + k / 256) % 256);
        }
        let mut rest = [0; 7];
        assert_eq!(link.read(1_996, &mut rest), 4);
        assert_eq!(rest[..4], out[1_996..2_000]);
        assert_eq!(link.read(2_000, &mut rest), 0);
        assert_eq!(link.read(9_999, &mut rest), 0);
    }

    #[test]
    fn only_what_came_whole_is_checked() {
        let mut link = Link::default();
        for (text, is_whole) in [(&b"123456789"[..], true), (b"other", false)] {
            link.begin();
            let (one, two) = text.split_at(3);
            link.write(one);
            link.write(two);
            link.end(is_whole);
        }
        assert_eq!(link.crc, 0xCBF4_3926);
    }
}

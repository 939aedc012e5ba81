//! An SDO client on the bench: one transfer at a time, expedited or in segments.

use eel_canopen::Frame;

use super::{Bench, NODE};

/// Milliseconds that an answer may take.
const PATIENCE: u32 = 20;

impl Bench {
    /// Sends an SDO request and returns the answer.
    pub fn ask(&mut self, request: [u8; 8]) -> [u8; 8] {
        let from = self.sent.len();
        let id = 0x580 + u16::from(NODE);
        self.extra
            .push(Frame::standard(0x600 + u16::from(NODE), &request).unwrap());
        for _ in 0..PATIENCE {
            self.tick();
            let mut answers = self.sent[from..]
                .iter()
                .filter(|sent| sent.frame.cob_id() == Some(id));
            if let Some(answer) = answers.next() {
                assert!(answers.next().is_none(), "one answer to a request");
                return answer.frame.data().try_into().unwrap();
            }
        }
        panic!("no answer to {request:X?}");
    }

    /// Reads an object of any length; the error is the abort code.
    pub fn upload(&mut self, index: u16, subindex: u8) -> Result<Vec<u8>, u32> {
        let [low, high] = index.to_le_bytes();
        let [command, _, _, _, data @ ..] = self.ask([0x40, low, high, subindex, 0, 0, 0, 0]);
        let word = u32::from_le_bytes(data);
        match command {
            0x80 => return Err(word),
            0x41 => {}
            _ => return Ok(data[..4 - usize::from(command >> 2 & 3)].to_vec()),
        }
        let mut bytes = Vec::new();
        for toggle in [0x60, 0x70].into_iter().cycle() {
            let [command, data @ ..] = self.ask([toggle, 0, 0, 0, 0, 0, 0, 0]);
            assert_eq!(command & 0xF0, toggle & 0x10, "a segment");
            bytes.extend(&data[..7 - usize::from(command >> 1 & 7)]);
            if command & 1 != 0 {
                break;
            }
        }
        assert_eq!(bytes.len(), word as usize);
        Ok(bytes)
    }

    /// Writes an object of any length; the error is the abort code.
    pub fn download(&mut self, index: u16, subindex: u8, data: &[u8]) -> Result<(), u32> {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x21, low, high, subindex, 0, 0, 0, 0];
        if data.len() <= 4 {
            request[0] = 0x23 | (4 - data.len() as u8) << 2;
            request[4..4 + data.len()].copy_from_slice(data);
            return self.confirm(request);
        }
        request[4..].copy_from_slice(&(data.len() as u32).to_le_bytes());
        self.confirm(request)?;
        let count = data.len().div_ceil(7);
        for ((number, part), toggle) in data
            .chunks(7)
            .enumerate()
            .zip([0, 0x10].into_iter().cycle())
        {
            let is_last = u8::from(number + 1 == count);
            let mut segment = [0; 8];
            segment[0] = toggle | (7 - part.len() as u8) << 1 | is_last;
            segment[1..=part.len()].copy_from_slice(part);
            self.confirm(segment)?;
        }
        Ok(())
    }

    fn confirm(&mut self, request: [u8; 8]) -> Result<(), u32> {
        match self.ask(request) {
            [0x80, _, _, _, code @ ..] => Err(u32::from_le_bytes(code)),
            [command, ..] => {
                assert!(matches!(command & 0xE0, 0x20 | 0x60), "{command:X}");
                Ok(())
            }
        }
    }
}

//! An SDO client on a line that loses, repeats and bends frames, by CiA 301, 7.2.4.3, without a look at
//! the server.

use std::collections::VecDeque;

use eel_canopen::Frame;

use crate::bench::{Bench, ID};

/// How long the client waits for an answer, in µs.
const TIMEOUT_US: u64 = 3_000_000;
/// The step in which it waits.
const STEP_US: u64 = 50_000;
/// How often it tries a block again.
const TRIES: u32 = 12;
/// What a segment carries.
const SEGMENT: usize = 7;

/// How an object is transferred.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// In one message.
    Expedited,
    /// Segment by segment; with its size said first or not.
    Segmented {
        /// Whether the size is said first.
        sized: bool,
    },
    /// In blocks of at most so many segments.
    Block {
        /// Segments in a block, 1–127.
        size: u8,
        /// Whether there is a CRC.
        crc: bool,
    },
}

/// What happens to a frame on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrives.
    Arrives,
    /// It is lost.
    Lost,
    /// It arrives twice.
    Twice,
    /// It arrives late, by so many µs.
    Late(u32),
    /// A bit of it is another, by its number.
    Bent(u8),
}

/// Who sends a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Client,
    Server,
}

/// The transfer did not succeed, which it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Failed;

/// A client, the line and the server behind it.
pub struct Client<'a> {
    bench: &'a mut Bench,
    /// What happens to the next frames, both ways; those after them arrive.
    fates: &'a [Fate],
    /// Whether a frame was bent: one is enough, for a CRC finds one burst and no more.
    bent: bool,
    /// How many bytes of a frame may be bent now: of what names the object none, for nothing protects it;
    /// of a segment only the command, unless a CRC protects the data.
    bendable: usize,
    answers: VecDeque<[u8; 8]>,
    /// Who sends segments of a block now, which a block transfer sends again.
    in_block: Option<Side>,
    /// Whether anything else was lost.
    lost_for_good: bool,
}

impl<'a> Client<'a> {
    pub fn new(bench: &'a mut Bench, fates: &'a [Fate]) -> Self {
        // What came before, an abort of the transfer before it, say, is no answer to anything it asks.
        bench.sent();
        Self {
            bench,
            fates,
            bent: false,
            bendable: 0,
            answers: VecDeque::new(),
            in_block: None,
            lost_for_good: false,
        }
    }

    /// Writes an object.
    ///
    /// # Errors
    /// [`Failed`], and the client has told the server so.
    pub fn download(&mut self, object: (u16, u8), data: &[u8], way: Way) -> Result<(), Failed> {
        let done = match way {
            Way::Expedited => self.download_expedited(object, data),
            Way::Segmented { sized } => self.download_segments(object, data, sized),
            Way::Block { crc, .. } => self.download_blocks(object, data, crc),
        };
        done.inspect_err(|_| self.abort(object))
    }

    /// Reads an object.
    ///
    /// # Errors
    /// [`Failed`], and the client has told the server so.
    pub fn upload(&mut self, object: (u16, u8), way: Way) -> Result<Vec<u8>, Failed> {
        let done = match way {
            Way::Block { size, crc } => self.upload_blocks(object, size, crc),
            _ => self.upload_segments(object),
        };
        done.inspect_err(|_| self.abort(object))
    }

    /// Tells whether something was lost that no block transfer sends again.
    pub const fn has_lost_for_good(&self) -> bool {
        self.lost_for_good
    }

    fn download_expedited(&mut self, object: (u16, u8), data: &[u8]) -> Result<(), Failed> {
        expect(matches!(data.len(), 1..=4))?;
        let mut value = [0; 4];
        value
            .get_mut(..data.len())
            .ok_or(Failed)?
            .copy_from_slice(data);
        let command = 0x23 | ((4 - data.len()) << 2) as u8;
        let answer = self.ask(named(command, object, value))?;
        expect(answer == named(0x60, object, [0; 4]))
    }

    fn download_segments(
        &mut self,
        object: (u16, u8),
        data: &[u8],
        sized: bool,
    ) -> Result<(), Failed> {
        let size = if sized { data.len() as u32 } else { 0 };
        let start = named(0x20 | u8::from(sized), object, size.to_le_bytes());
        expect(self.ask(start)? == named(0x60, object, [0; 4]))?;
        self.bendable = usize::from(sized);
        let mut toggle = 0;
        let mut rest = data;
        loop {
            let (now, later) = rest.split_at(rest.len().min(SEGMENT));
            let last = u8::from(later.is_empty());
            let unused = (SEGMENT - now.len()) as u8;
            let request = filled(toggle | unused << 1 | last, now);
            expect(self.ask(request)? == [0x20 | toggle, 0, 0, 0, 0, 0, 0, 0])?;
            if last == 1 {
                return Ok(());
            }
            toggle ^= 0x10;
            rest = later;
        }
    }

    fn upload_segments(&mut self, object: (u16, u8)) -> Result<Vec<u8>, Failed> {
        let [command, a, b, c, value @ ..] = self.ask(named(0x40, object, [0; 4]))?;
        let [_, x, y, z, ..] = named(0, object, [0; 4]);
        expect([a, b, c] == [x, y, z] && command >> 5 == 2)?;
        if command & 2 != 0 {
            expect(command & 1 != 0)?;
            return Ok(value[..4 - usize::from(command >> 2 & 3)].to_vec());
        }
        expect(command == 0x41)?;
        let size = u32::from_le_bytes(value) as usize;
        self.bendable = 1;
        let (mut data, mut toggle) = (Vec::new(), 0);
        loop {
            let [command, bytes @ ..] = self.ask([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0])?;
            expect(command & 0xF0 == toggle)?;
            let count = SEGMENT - usize::from(command >> 1 & 7);
            data.extend_from_slice(&bytes[..count]);
            if command & 1 != 0 {
                expect(data.len() == size)?;
                return Ok(data);
            }
            toggle ^= 0x10;
        }
    }

    fn download_blocks(&mut self, object: (u16, u8), data: &[u8], crc: bool) -> Result<(), Failed> {
        let size = (data.len() as u32).to_le_bytes();
        let command = 0xC2 | u8::from(crc) << 2;
        let [answer, a, b, c, block, ..] = self.ask(named(command, object, size))?;
        let [_, x, y, z, ..] = named(0, object, [0; 4]);
        expect(answer & 0xFB == 0xA0 && [a, b, c] == [x, y, z])?;
        self.bendable = if crc { 8 } else { 0 };
        let segments: Vec<&[u8]> = match data {
            [] => vec![&[]],
            _ => data.chunks(SEGMENT).collect(),
        };
        let (mut first, mut block) = (0, usize::from(block));
        let mut tries = 0;
        while first < segments.len() {
            expect((1..=127).contains(&block) && tries < TRIES)?;
            tries += 1;
            let end = segments.len().min(first + block);
            let mut lost = 0;
            for (sequence, segment) in (1..).zip(&segments[first..end]) {
                let last = if first + usize::from(sequence) == segments.len() {
                    0x80
                } else {
                    0
                };
                self.in_block = Some(Side::Client);
                let is_lost = self.fates.first() == Some(&Fate::Lost);
                lost += usize::from(is_lost);
                self.send(filled(last | sequence, segment));
            }
            self.in_block = None;
            // Of a block that is lost as a whole the server knows nothing.
            self.lost_for_good |= lost == end - first;
            let answer = self.answer()?;
            expect(answer[0] == 0xA2 && usize::from(answer[1]) <= end - first)?;
            if answer[1] > 0 {
                tries = 0;
            }
            first += usize::from(answer[1]);
            block = usize::from(answer[2]);
        }
        let unused = (segments.len() * SEGMENT - data.len()) as u8;
        let [low, high] = if crc { crc16(data) } else { 0 }.to_le_bytes();
        let end = [0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0];
        expect(self.ask(end)? == [0xA1, 0, 0, 0, 0, 0, 0, 0])
    }

    fn upload_blocks(
        &mut self,
        object: (u16, u8),
        block: u8,
        crc: bool,
    ) -> Result<Vec<u8>, Failed> {
        let command = 0xA0 | u8::from(crc) << 2;
        let [answer, a, b, c, size @ ..] = self.ask(named(command, object, [block, 0, 0, 0]))?;
        let [_, x, y, z, ..] = named(0, object, [0; 4]);
        expect(answer & 0xFB == 0xC2 && [a, b, c] == [x, y, z])?;
        self.bendable = if crc { 8 } else { 0 };
        let size = u32::from_le_bytes(size) as usize;
        self.send([0xA3, 0, 0, 0, 0, 0, 0, 0]);
        let (mut data, mut tries, mut ended) = (Vec::new(), 0, false);
        while !ended {
            expect(tries < TRIES)?;
            tries += 1;
            let mut good = 0;
            self.in_block = Some(Side::Server);
            // A block ends with its last segment, or with silence.
            while let Some([first, bytes @ ..]) = self.segment() {
                expect(first != 0x80)?;
                if first & 0x7F == good + 1 {
                    good += 1;
                    data.extend_from_slice(&bytes);
                    ended = first & 0x80 != 0;
                    tries = 0;
                }
                if first & 0x7F == block || first & 0x80 != 0 {
                    break;
                }
            }
            self.in_block = None;
            self.send([0xA2, good, block, 0, 0, 0, 0, 0]);
        }
        let [end, low, high, ..] = self.answer()?;
        expect(end & 0xE3 == 0xC1)?;
        let unused = usize::from(end >> 2 & 7);
        data.truncate(data.len().checked_sub(unused).ok_or(Failed)?);
        expect(data.len() == size)?;
        expect(!crc || u16::from_le_bytes([low, high]) == crc16(&data))?;
        self.send([0xA1, 0, 0, 0, 0, 0, 0, 0]);
        Ok(data)
    }

    fn abort(&mut self, object: (u16, u8)) {
        self.fates = &[];
        self.send(named(0x80, object, [0, 0, 4, 5]));
        self.answers.clear();
    }

    /// Sends a request and waits for its answer.
    fn ask(&mut self, request: [u8; 8]) -> Result<[u8; 8], Failed> {
        self.send(request);
        self.answer()
    }

    fn send(&mut self, request: [u8; 8]) {
        let id = u16::from(ID);
        for request in self.on_the_line(request, Side::Client) {
            let frame = Frame::standard(0x600 + id, &request).expect("eight bytes");
            self.bench.hear(&frame);
            self.collect();
        }
    }

    /// Waits for an answer.
    fn answer(&mut self) -> Result<[u8; 8], Failed> {
        for _ in 0..TIMEOUT_US / STEP_US {
            if let Some(answer) = self.answers.pop_front() {
                return Ok(answer);
            }
            self.bench.tick(STEP_US);
            self.collect();
        }
        Err(Failed)
    }

    /// Waits for a segment of a block, for a time that ends before the server's patience does.
    fn segment(&mut self) -> Option<[u8; 8]> {
        for _ in 0..4 {
            if let Some(answer) = self.answers.pop_front() {
                return Some(answer);
            }
            self.bench.tick(STEP_US);
            self.collect();
        }
        None
    }

    /// Takes what the server has sent.
    fn collect(&mut self) {
        for frame in self.bench.sent() {
            if frame.cob_id() == Some(0x580 + u16::from(ID)) {
                let answer = frame.data().try_into().expect("eight bytes");
                let arrived = self.on_the_line(answer, Side::Server);
                self.answers.extend(arrived);
            }
        }
    }

    /// Returns what arrives of a frame.
    fn on_the_line(&mut self, mut frame: [u8; 8], from: Side) -> Vec<[u8; 8]> {
        let Some((fate, rest)) = self.fates.split_first() else {
            return vec![frame];
        };
        self.fates = rest;
        match *fate {
            Fate::Arrives => vec![frame],
            Fate::Lost => {
                self.lost_for_good |= self.in_block != Some(from);
                Vec::new()
            }
            Fate::Twice => vec![frame, frame],
            Fate::Late(micros) => {
                self.bench.tick(u64::from(micros));
                vec![frame]
            }
            Fate::Bent(bit) => {
                let byte = usize::from(bit >> 3 & 7);
                // Without a CRC nobody sees that a last segment no longer says so.
                let is_last_bit = self.bendable == 1 && bit & 7 == 0;
                if byte < self.bendable && !is_last_bit && !self.bent {
                    self.bent = true;
                    frame[byte] ^= 1 << (bit & 7);
                }
                vec![frame]
            }
        }
    }
}

fn expect(is_so: bool) -> Result<(), Failed> {
    if is_so { Ok(()) } else { Err(Failed) }
}

/// Makes a message that names an object.
fn named(command: u8, (index, subindex): (u16, u8), data: [u8; 4]) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = data;
    [command, low, high, subindex, a, b, c, d]
}

/// Makes a segment.
fn filled(first: u8, data: &[u8]) -> [u8; 8] {
    let mut message = [0; 8];
    message[0] = first;
    message[1..=data.len()].copy_from_slice(data);
    message
}

/// The CRC of a block transfer, bit by bit.
fn crc16(data: &[u8]) -> u16 {
    data.iter().fold(0, |crc, byte| {
        (0..8).fold(crc ^ u16::from(*byte) << 8, |crc, _| {
            let shifted = crc << 1;
            if crc & 0x8000 == 0 {
                shifted
            } else {
                shifted ^ 0x1021
            }
        })
    })
}

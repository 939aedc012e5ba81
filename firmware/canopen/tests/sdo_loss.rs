//! A client on a bad line: frames get lost, come twice or change places, in both directions. A
//! transfer may fail; one that ends well has delivered exactly the bytes.

mod streams;

use streams::{Call, DOMAIN, Line, Random, VALUE, abort, about, crc};

/// How bad the line is, each in thousandths of the frames.
#[derive(Clone, Copy, Debug)]
struct Noise {
    lost: u64,
    doubled: u64,
    swapped: u64,
}

/// One direction of the line.
#[derive(Default)]
struct Wire {
    late: Option<[u8; 8]>,
}

impl Wire {
    /// Passes a frame on, or not.
    fn pass(&mut self, frame: [u8; 8], noise: Noise, random: &mut Random) -> Vec<[u8; 8]> {
        if random.below(1_000) < noise.lost {
            return Vec::from_iter(self.late.take());
        }
        if self.late.is_none() && random.below(1_000) < noise.swapped {
            self.late = Some(frame);
            return Vec::new();
        }
        let mut out = vec![frame];
        if random.below(1_000) < noise.doubled {
            out.push(frame);
        }
        out.extend(self.late.take());
        out
    }
}

/// A client, written after CiA 301 and not after the server.
struct Client {
    line: Line,
    random: Random,
    noise: Noise,
    up: Wire,
    down: Wire,
    inbox: Vec<[u8; 8]>,
    segments_again: u32,
}

/// The transfer failed, or so it seems to the client.
#[derive(Debug)]
struct Failed;

impl Client {
    fn new(noise: Noise, seed: u64) -> Self {
        Self {
            line: Line::new(),
            random: Random(seed),
            noise,
            up: Wire::default(),
            down: Wire::default(),
            inbox: Vec::new(),
            segments_again: 0,
        }
    }

    fn send(&mut self, request: [u8; 8]) {
        for frame in self.up.pass(request, self.noise, &mut self.random) {
            self.line.hear(0x605, &frame);
        }
        self.fetch();
    }

    fn fetch(&mut self) {
        for message in self.line.messages() {
            let passed = self.down.pass(message, self.noise, &mut self.random);
            self.inbox.extend(passed);
        }
    }

    /// Waits for a frame at most so many milliseconds.
    fn wait(&mut self, milliseconds: u32) -> Option<[u8; 8]> {
        for _ in 0..=milliseconds {
            if !self.inbox.is_empty() {
                return Some(self.inbox.remove(0));
            }
            self.line.now_us += 1_000;
            self.line.node.tick(self.line.now_us, &mut self.line.app);
            self.fetch();
        }
        None
    }

    /// Waits for an answer whose command is `command` where `mask` has bits.
    fn answer(&mut self, mask: u8, command: u8) -> Result<[u8; 8], Failed> {
        self.wait(500)
            .filter(|answer| answer[0] & mask == command)
            .ok_or(Failed)
    }

    /// Gives up: tells the server, and throws away what still comes.
    fn give_up(&mut self, index: u16, subindex: u8) {
        self.send(abort(index, subindex, 0x0504_0000));
        for _ in 0..self.random.below(300) {
            self.wait(1);
        }
        self.inbox.clear();
        // No frame stays on the line for longer than a client waits.
        self.up.late = None;
        self.down.late = None;
    }

    fn download_blocks(
        &mut self,
        (index, subindex): (u16, u8),
        bytes: &[u8],
        with_crc: bool,
        sized: bool,
    ) -> Result<(), Failed> {
        let flags = u8::from(with_crc) << 2 | u8::from(sized) << 1;
        let size = if sized { bytes.len() as u32 } else { 0 };
        self.send(about(0xC0 | flags, index, subindex, size));
        let started = self.answer(0xFB, 0xA0)?;
        if started[1..4] != about(0, index, subindex, 0)[1..4] {
            return Err(Failed);
        }
        let mut block = usize::from(started[4]);
        let mut sent = 0;
        while sent < bytes.len() {
            for (number, part) in (1..).zip(bytes[sent..].chunks(7).take(block)) {
                let last = sent + usize::from(number) * 7 >= bytes.len();
                let mut segment = [0xEE; 8];
                segment[0] = u8::from(last) << 7 | number;
                segment[1..=part.len()].copy_from_slice(part);
                self.send(segment);
            }
            let out = bytes[sent..].len().div_ceil(7).min(block);
            let [_, acknowledged, next, ..] = self.answer(0xFF, 0xA2)?;
            if usize::from(acknowledged) > out || next == 0 {
                return Err(Failed);
            }
            if usize::from(acknowledged) < out {
                self.segments_again += 1;
            }
            sent += usize::from(acknowledged) * 7;
            block = usize::from(next);
        }
        let unused = (sent - bytes.len()) as u8;
        let [low, high] = if with_crc {
            crc(bytes).to_le_bytes()
        } else {
            [0, 0]
        };
        self.send([0xC1 | unused << 2, low, high, 0, 0, 0, 0, 0]);
        self.answer(0xFF, 0xA1).map(|_| ())
    }

    fn upload_blocks(
        &mut self,
        (index, subindex): (u16, u8),
        with_crc: bool,
    ) -> Result<Vec<u8>, Failed> {
        let mut size = self.random.below(127) as u8 + 1;
        let flag = u8::from(with_crc) << 2;
        self.send(about(0xA0 | flag, index, subindex, u32::from(size)));
        let started = self.answer(0xF9, 0xC0)?;
        let length = u32::from_le_bytes([started[4], started[5], started[6], started[7]]);
        self.send([0xA3, 0, 0, 0, 0, 0, 0, 0]);
        let mut bytes = Vec::new();
        let mut at_end = false;
        while !at_end {
            let mut good = 0;
            let mut heard = 0;
            // A block ends with its last segment, or with silence.
            while let Some([first, data @ ..]) = self.wait(50) {
                let number = first & 0x7F;
                if number == 0 {
                    return Err(Failed);
                }
                heard += 1;
                if number == good + 1 {
                    good = number;
                    bytes.extend(data);
                    at_end = first & 0x80 != 0;
                }
                if first & 0x80 != 0 || number == size {
                    break;
                }
            }
            if heard == 0 {
                // Was the acknowledgement lost, or all that followed?
                return Err(Failed);
            }
            if !at_end && good < size {
                self.segments_again += 1;
            }
            size = self.random.below(127) as u8 + 1;
            self.send([0xA2, good, size, 0, 0, 0, 0, 0]);
        }
        let [command, low, high, ..] = self.answer(0xE3, 0xC1)?;
        let unused = usize::from(command >> 2 & 7);
        bytes.truncate(bytes.len().saturating_sub(unused));
        if with_crc && u16::from_le_bytes([low, high]) != crc(&bytes)
            || bytes.len() != length as usize
        {
            return Err(Failed);
        }
        self.send([0xA1, 0, 0, 0, 0, 0, 0, 0]);
        Ok(bytes)
    }

    fn download_segments(
        &mut self,
        (index, subindex): (u16, u8),
        bytes: &[u8],
    ) -> Result<(), Failed> {
        self.send(about(0x21, index, subindex, bytes.len() as u32));
        self.answer(0xFF, 0x60)?;
        let count = bytes.len().div_ceil(7);
        for (number, part) in bytes.chunks(7).enumerate() {
            let toggle = (number as u8 & 1) << 4;
            let mut segment = [0; 8];
            segment[0] = toggle | (7 - part.len() as u8) << 1 | u8::from(number + 1 == count);
            segment[1..=part.len()].copy_from_slice(part);
            self.send(segment);
            self.answer(0xFF, 0x20 | toggle)?;
        }
        Ok(())
    }

    fn upload_segments(&mut self, (index, subindex): (u16, u8)) -> Result<Vec<u8>, Failed> {
        self.send(about(0x40, index, subindex, 0));
        let started = self.answer(0xFF, 0x41)?;
        let length = u32::from_le_bytes([started[4], started[5], started[6], started[7]]);
        let mut bytes = Vec::new();
        for toggle in [0x00, 0x10].into_iter().cycle() {
            self.send([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]);
            let [flags, data @ ..] = self.answer(0xF0, toggle)?;
            bytes.extend(&data[..7 - usize::from(flags >> 1 & 7)]);
            if flags & 1 != 0 {
                break;
            }
        }
        if bytes.len() != length as usize {
            return Err(Failed);
        }
        Ok(bytes)
    }
}

/// Transfers in one run; `SDO_TRANSFERS` asks for more.
fn transfers() -> u32 {
    let asked = std::env::var("SDO_TRANSFERS").ok();
    asked.and_then(|text| text.parse().ok()).unwrap_or(2_000)
}

/// Runs transfers and returns how many ended well for the client, and how many blocks arrived in part.
fn run(noise: Noise, seed: u64, always_crc: bool) -> (u32, u32) {
    println!("seed {seed:#X}, {noise:?}");
    let mut client = Client::new(noise, seed);
    let mut well = 0;
    for number in 0..transfers() {
        let object = client.random.pick(&[(DOMAIN, 1), (VALUE, 0)]);
        let most = if object == (VALUE, 0) { 884 } else { 2_500 };
        let length = 5 + client.random.below(most) as usize;
        let bytes: Vec<u8> = (0..length).map(|_| client.random.next() as u8).collect();
        let with_crc = always_crc || client.random.below(2) == 0;
        let result = if client.random.below(2) == 0 {
            download(&mut client, object, &bytes, with_crc, number)
        } else {
            upload(&mut client, object, bytes, with_crc, number)
        };
        well += u32::from(result.is_ok());
    }
    (well, client.segments_again)
}

fn download(
    client: &mut Client,
    object: (u16, u8),
    bytes: &[u8],
    with_crc: bool,
    number: u32,
) -> Result<(), Failed> {
    let sized = client.random.below(2) == 0;
    let result = if client.random.below(3) == 0 {
        client.download_segments(object, bytes)
    } else {
        client.download_blocks(object, bytes, with_crc, sized)
    };
    if result.is_err() {
        client.give_up(object.0, object.1);
    }
    // Whatever the client believes, what the server took over is what was sent.
    let app = &mut client.line.app;
    let end = Call::End(object.0, object.1, Some(bytes.len() as u32));
    let complete = app.calls().contains(&end);
    let written = std::mem::take(&mut app.values_written) > 0;
    if object == (VALUE, 0) {
        let right = app.value == bytes;
        assert!(right || !written && result.is_err(), "transfer {number}");
    } else {
        let right = app.domain == bytes;
        assert!(right || !complete && result.is_err(), "transfer {number}");
    }
    result
}

fn upload(
    client: &mut Client,
    object: (u16, u8),
    bytes: Vec<u8>,
    with_crc: bool,
    number: u32,
) -> Result<(), Failed> {
    let app = &mut client.line.app;
    // A domain stays as it is while the server still believes in a download.
    let expected = if object == (DOMAIN, 1) && app.is_writing() {
        app.domain.clone()
    } else {
        bytes
    };
    if object == (VALUE, 0) {
        app.value.clone_from(&expected);
    } else {
        app.domain.clone_from(&expected);
    }
    let result = if client.random.below(3) == 0 {
        client.upload_segments(object)
    } else {
        client.upload_blocks(object, with_crc)
    };
    let Ok(received) = result else {
        client.give_up(object.0, object.1);
        return Err(Failed);
    };
    assert!(received == expected, "transfer {number}");
    Ok(())
}

#[test]
fn everything_succeeds_on_a_good_line() {
    let noise = Noise {
        lost: 0,
        doubled: 0,
        swapped: 0,
    };
    assert_eq!(run(noise, 1, false), (transfers(), 0));
}

#[test]
fn what_is_lost_is_sent_again() {
    for (lost, at_least) in [(2, 1_500), (10, 900), (50, 300)] {
        let noise = Noise {
            lost,
            doubled: 0,
            swapped: 0,
        };
        let (well, again) = run(noise, 0xA11 + lost, false);
        println!(
            "{well} of {} ended well, {again} blocks in part",
            transfers()
        );
        assert!(well > at_least && again > 100, "{well} {again}");
    }
}

#[test]
fn the_crc_finds_what_a_worse_line_does() {
    for (lost, doubled, swapped) in [(0, 10, 0), (0, 0, 10), (5, 5, 5), (30, 30, 30)] {
        let noise = Noise {
            lost,
            doubled,
            swapped,
        };
        let (well, again) = run(noise, 0xBAD + lost, true);
        println!(
            "{well} of {} ended well, {again} blocks in part",
            transfers()
        );
        assert!(well > 100, "{well}");
    }
}

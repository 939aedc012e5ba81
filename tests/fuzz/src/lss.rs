//! Layer setting services in any order: answers only where CiA 305 has one, an id that changes only when it
//! may, and a node that a master finds and configures afterwards.

use eel_canopen::{Abort, Frame, NmtState};

use crate::bench::{Bench, ID, IDENTITY, NO_ID};
use crate::draw;
use crate::input::Input;

/// A slave as a master that sees all its answers knows it.
struct Watched {
    bench: Bench,
    /// Whether it is in the configuration state.
    configuring: bool,
}

/// Does what the bytes say, and has a master look for the node.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let id = if input.byte() & 1 == 0 { NO_ID } else { ID };
    let mut watched = Watched {
        bench: Bench::new(id, &[]),
        configuring: false,
    };
    watched.bench.sent();
    while !input.is_empty() {
        watched.step(&mut input);
    }
    watched.lose_id();
    watched.scan();
    watched.bench.check_alive();
}

impl Watched {
    fn step(&mut self, input: &mut Input<'_>) {
        match input.below(16) {
            0 => {
                let frame = draw::frame(input, self.bench.node.node_id());
                // What draws a request of LSS by chance is seen like every other.
                match frame.data().try_into() {
                    Ok(request) if frame.cob_id() == Some(0x7E5) && !frame.is_remote() => {
                        self.request(request);
                    }
                    _ => self.other(&frame),
                }
            }
            1 => {
                let reset = [input.pick(&[129, 130]), 0];
                self.other(&Frame::standard(0, &reset).expect("two bytes"));
            }
            2 => {
                self.bench.tick(u64::from(input.byte()) * 10_000);
                self.bench.sent();
            }
            3 => {
                let outcome = input.pick(&[Ok(()), Err(Abort::Hardware)]);
                self.bench.finish_store(outcome);
                self.bench.sent();
            }
            4 => self.request([4, input.byte() & 3, 0, 0, 0, 0, 0, 0]),
            _ => {
                let request = draw::lss(input);
                self.request(request);
            }
        }
    }

    /// Hands the node something else.
    fn other(&mut self, frame: &Frame) {
        let is_silent = self.bench.node.nmt_state() == NmtState::Initialising;
        let before = self.bench.node.node_id();
        self.bench.hear(frame);
        let sent = self.bench.sent();
        let is_reset = matches!((frame.cob_id(), frame.data()), (Some(0), [129 | 130, _]));
        if is_silent {
            assert!(sent.is_empty(), "without an id: {frame:02X?}: {sent:02X?}");
        }
        if is_silent || !is_reset {
            assert_eq!(before, self.bench.node.node_id(), "{frame:02X?}");
        }
        let is_own = matches!(frame.data(), [_, addressee] if [0, before].contains(addressee));
        if is_reset && is_own && frame.data()[0] == 129 && !is_silent {
            // A reset of the node ends the configuration; of the communication does not.
            self.configuring = false;
        }
    }

    /// Hands the node a request and checks what comes of it.
    fn request(&mut self, request: [u8; 8]) {
        let before = self.bench.node.node_id();
        let sent = self.bench.ask(0x7E5, &request);
        let answers: Vec<[u8; 8]> = sent
            .iter()
            .filter(|frame| frame.cob_id() == Some(0x7E4))
            .map(|frame| frame.data().try_into().expect("eight bytes"))
            .collect();
        assert!(answers.len() <= 1, "{request:02X?}: {answers:02X?}");
        let answer = answers.first().copied();
        let [command, first, second, ..] = request;
        match command {
            0x04 if first < 2 => self.configuring = first == 1,
            0x11 if self.configuring => {
                let is_right = matches!(first, 1..=127 | NO_ID);
                let error = u8::from(!is_right);
                assert_eq!(answer, Some([0x11, error, 0, 0, 0, 0, 0, 0]));
            }
            0x13 if self.configuring => {
                let error = u8::from((first, second) != (0, 0));
                assert_eq!(answer, Some([0x13, error, 0, 0, 0, 0, 0, 0]));
            }
            0x5A..=0x5D if self.configuring => {
                let [a, b, c, d] = IDENTITY[usize::from(command - 0x5A)].to_le_bytes();
                assert_eq!(answer, Some([command, a, b, c, d, 0, 0, 0]));
            }
            0x5E if self.configuring => {
                assert_eq!(answer, Some([0x5E, before, 0, 0, 0, 0, 0, 0]));
            }
            0x11 | 0x13 | 0x17 | 0x5A..=0x5E if !self.configuring => {
                assert_eq!(answer, None, "{request:02X?} while waiting");
            }
            0x43 if answer.is_some() => {
                assert!(!self.configuring, "selected twice");
                self.configuring = true;
            }
            0x51 => self.check_scan(request, answer),
            _ => {}
        }
        let leaves = command == 0x04 && first == 0;
        if !leaves || matches!(before, 1..=127) {
            assert_eq!(before, self.bench.node.node_id(), "{request:02X?}");
        }
    }

    /// Checks the answer to a fastscan, whose last number ends in the configuration state.
    fn check_scan(&mut self, request: [u8; 8], answer: Option<[u8; 8]>) {
        let [_, a, b, c, d, bit, place, next] = request;
        if answer.is_none() {
            return;
        }
        assert_eq!(answer, Some([0x4F, 0, 0, 0, 0, 0, 0, 0]));
        assert!(!self.configuring && !matches!(self.bench.node.node_id(), 1..=127));
        if bit == 0x80 {
            return;
        }
        let found = IDENTITY[usize::from(place)] ^ u32::from_le_bytes([a, b, c, d]);
        assert_eq!(found >> bit, 0, "{request:02X?} is not this node");
        self.configuring = bit == 0 && next < place;
    }

    /// Takes the node's id away, as a master can.
    fn lose_id(&mut self) {
        self.bench.app.refuse = false;
        self.request([4, 1, 0, 0, 0, 0, 0, 0]);
        self.request([0x11, NO_ID, 0, 0, 0, 0, 0, 0]);
        self.request([4, 0, 0, 0, 0, 0, 0, 0]);
        self.other(&Frame::standard(0, &[130, 0]).expect("two bytes"));
        assert_eq!(self.bench.node.nmt_state(), NmtState::Initialising);
        assert!(!matches!(self.bench.node.node_id(), 1..=127));
    }

    /// Looks for the node by its numbers, bit by bit, and gives it an id.
    fn scan(&mut self) {
        assert!(self.is_there(0, 0x80, 0, 0), "an unconfigured node answers");
        for place in 0..4 {
            let mut number = 0;
            for bit in (0..32).rev() {
                if !self.is_there(number, bit, place, place) {
                    number |= 1 << bit;
                }
            }
            assert!(self.is_there(number, 0, place, (place + 1) & 3));
            assert_eq!(number, IDENTITY[usize::from(place)]);
        }
        assert!(self.configuring, "found, it can be configured");
        self.request([0x11, ID, 0, 0, 0, 0, 0, 0]);
        self.request([4, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(self.bench.node.node_id(), ID);
    }

    fn is_there(&mut self, number: u32, bit: u8, place: u8, next: u8) -> bool {
        let [a, b, c, d] = number.to_le_bytes();
        let request = [0x51, a, b, c, d, bit, place, next];
        let sent = self.bench.ask(0x7E5, &request);
        let answer = sent.first().map(|frame| frame.data().try_into());
        self.check_scan(request, answer.map(|data| data.expect("eight bytes")));
        !sent.is_empty()
    }
}

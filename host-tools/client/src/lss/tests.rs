//! The LSS master against literal bytes, and its scan against nodes written from CiA 305.

use std::collections::VecDeque;
use std::time::Duration;

use eel_protocol::Frame;
use eel_transport::{Bus, BusError, Content, Received};

use super::LssAddress;
use crate::client::{Client, Settings};
use crate::error::{ClientError, LssFailure};
use crate::script::{Script, client};

const ADDRESS: LssAddress = LssAddress {
    vendor: 0x0102_0304,
    product: 0x6565_6C01,
    revision: 0x0001_0000,
    serial: 0xDEAD_BEEF,
};

type Step = ([u8; 8], &'static [[u8; 8]]);

fn script(steps: &[Step]) -> Script {
    let mut script = Script::default();
    for (request, answers) in steps {
        let answers: Vec<_> = answers.iter().map(|data| (0x7E4, &data[..])).collect();
        script.add((0x7E5, request), &answers);
    }
    script
}

#[test]
fn a_node_is_selected_by_its_identity_given_an_id_and_stores_it() {
    let mut client = client(script(&[
        ([0x40, 4, 3, 2, 1, 0, 0, 0], &[]),
        ([0x41, 1, 0x6C, 0x65, 0x65, 0, 0, 0], &[]),
        ([0x42, 0, 0, 1, 0, 0, 0, 0], &[]),
        (
            [0x43, 0xEF, 0xBE, 0xAD, 0xDE, 0, 0, 0],
            &[[0x44, 0, 0, 0, 0, 0, 0, 0]],
        ),
        ([0x11, 7, 0, 0, 0, 0, 0, 0], &[[0x11, 0, 0, 0, 0, 0, 0, 0]]),
        ([0x13, 0, 0, 0, 0, 0, 0, 0], &[[0x13, 0, 0, 0, 0, 0, 0, 0]]),
        ([0x17, 0, 0, 0, 0, 0, 0, 0], &[[0x17, 0, 0, 0, 0, 0, 0, 0]]),
        ([0x5E, 0, 0, 0, 0, 0, 0, 0], &[[0x5E, 7, 0, 0, 0, 0, 0, 0]]),
        (
            [0x5E, 0, 0, 0, 0, 0, 0, 0],
            &[[0x5E, 0xFF, 0, 0, 0, 0, 0, 0]],
        ),
        ([0x5A, 0, 0, 0, 0, 0, 0, 0], &[[0x5A, 4, 3, 2, 1, 0, 0, 0]]),
        (
            [0x5B, 0, 0, 0, 0, 0, 0, 0],
            &[[0x5B, 1, 0x6C, 0x65, 0x65, 0, 0, 0]],
        ),
        ([0x5C, 0, 0, 0, 0, 0, 0, 0], &[[0x5C, 0, 0, 1, 0, 0, 0, 0]]),
        (
            [0x5D, 0, 0, 0, 0, 0, 0, 0],
            &[[0x5D, 0xEF, 0xBE, 0xAD, 0xDE, 0, 0, 0]],
        ),
        ([0x04, 0, 0, 0, 0, 0, 0, 0], &[]),
        ([0x4C, 0, 0, 0, 0, 0, 0, 0], &[[0x50, 0, 0, 0, 0, 0, 0, 0]]),
        ([0x4C, 0, 0, 0, 0, 0, 0, 0], &[]),
    ]));
    let mut lss = client.lss();
    lss.switch_to(ADDRESS).unwrap();
    lss.set_node_id(7).unwrap();
    lss.set_bit_timing(0, 0).unwrap();
    lss.store().unwrap();
    assert_eq!(lss.node_id().unwrap(), Some(7));
    assert_eq!(lss.node_id().unwrap(), None);
    assert_eq!(lss.identity().unwrap(), ADDRESS);
    lss.switch_all(false).unwrap();
    assert!(lss.any_without_id().unwrap());
    assert!(!lss.any_without_id().unwrap());
    client.into_bus().finish();
}

#[test]
fn refusals_and_silence_are_told_apart() {
    let mut client = client(script(&[
        (
            [0x11, 200, 0, 0, 0, 0, 0, 0],
            &[[0x11, 1, 0, 0, 0, 0, 0, 0]],
        ),
        (
            [0x17, 0, 0, 0, 0, 0, 0, 0],
            &[[0x17, 0xFF, 9, 0, 0, 0, 0, 0]],
        ),
        ([0x5E, 0, 0, 0, 0, 0, 0, 0], &[[0x4F, 0, 0, 0, 0, 0, 0, 0]]),
    ]));
    let mut lss = client.lss();
    let failure = |result: Result<(), ClientError>| match result {
        Err(ClientError::Lss(failure)) => failure,
        other => panic!("{other:?}"),
    };
    let refused = |service, code, detail| LssFailure::Refused {
        service,
        code,
        detail,
    };
    assert_eq!(failure(lss.set_node_id(200)), refused(0x11, 1, 0));
    assert_eq!(failure(lss.store()), refused(0x17, 0xFF, 9));
    assert_eq!(failure(lss.node_id().map(|_| ())), LssFailure::Silence);
    client.into_bus().finish();
}

/// A node without an id, as CiA 305, 5.4.5 describes it.
struct Slave {
    numbers: [u32; 4],
    place: u8,
    id: u8,
    in_configuration: bool,
}

impl Slave {
    fn take(&mut self, data: [u8; 8]) -> Option<[u8; 8]> {
        let [command, a, b, c, d, bits, place, next] = data;
        let number = u32::from_le_bytes([a, b, c, d]);
        let answer = |command| Some([command, 0, 0, 0, 0, 0, 0, 0]);
        match command {
            0x04 => {
                self.in_configuration = a == 1;
                None
            }
            0x11 if self.in_configuration => {
                self.id = a;
                answer(0x11)
            }
            0x51 if self.id == 0xFF && !self.in_configuration => {
                if bits == 0x80 {
                    self.place = 0;
                    return answer(0x4F);
                }
                let own = self.numbers[usize::from(self.place)];
                if place != self.place || own >> bits != number >> bits {
                    return None;
                }
                if bits == 0 && next < place {
                    self.in_configuration = true;
                } else if bits == 0 {
                    self.place = next;
                }
                answer(0x4F)
            }
            _ => None,
        }
    }
}

/// A bus with several such nodes; each answers with a frame of its own.
struct Slaves {
    nodes: Vec<Slave>,
    coming: VecDeque<Frame>,
    questions: u32,
    /// How many answers get lost.
    lost: u32,
}

impl Bus for Slaves {
    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        assert_eq!(frame.cob_id(), Some(0x7E5));
        let data = frame.data().try_into().unwrap();
        self.questions += 1;
        for answer in self.nodes.iter_mut().filter_map(|node| node.take(data)) {
            if self.questions > 40 && self.lost > 0 {
                self.lost -= 1;
                continue;
            }
            self.coming
                .push_back(Frame::standard(0x7E4, &answer).unwrap());
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<Received>, BusError> {
        let Some(frame) = self.coming.pop_front() else {
            std::thread::sleep(timeout);
            return Ok(None);
        };
        Ok(Some(Received {
            time_ns: 0,
            content: Content::Frame(frame),
            direction: None,
        }))
    }
}

fn slaves(all: &[[u32; 4]], lost: u32) -> Client<Slaves> {
    let nodes = all.iter().map(|numbers| Slave {
        numbers: *numbers,
        place: 0,
        id: 0xFF,
        in_configuration: false,
    });
    let bus = Slaves {
        nodes: nodes.collect(),
        coming: VecDeque::new(),
        questions: 0,
        lost,
    };
    let settings = Settings {
        lss: Duration::from_micros(20),
        lss_settle: Duration::ZERO,
        ..Settings::default()
    };
    Client::with_settings(bus, settings)
}

const FOUR: [[u32; 4]; 4] = [
    [0x0102_0304, 0x6565_6C01, 0x0001_0000, 0x8000_0001],
    [0x0102_0304, 0x6565_6C01, 0x0001_0000, 0x8000_0003],
    [0x0102_0304, 0x6565_6C02, 0x0001_0000, 0xFFFF_FFFF],
    [0xFFFF_FFFF, 0x0000_0000, 0x0000_0000, 0x0000_0000],
];

#[test]
fn all_nodes_are_found_and_given_ids_one_after_another() {
    for guess in [None, Some(ADDRESS)] {
        let mut client = slaves(&FOUR, 0);
        let mut found = Vec::new();
        while let Some(address) = client.lss().scan(guess).unwrap() {
            found.push(address.numbers());
            let mut lss = client.lss();
            lss.set_node_id(found.len() as u8).unwrap();
            lss.switch_all(false).unwrap();
            assert!(found.len() <= 4);
        }
        assert_eq!(found, FOUR);
        let bus = client.into_bus();
        let ids: Vec<_> = bus.nodes.iter().map(|node| node.id).collect();
        assert_eq!(ids, [1, 2, 3, 4]);
        // A start, and for each of four numbers 32 bits and a confirmation; two starts at the end.
        assert!(guess.is_some() || bus.questions == 4 * (1 + 4 * 33 + 2) + 2);
    }
}

#[test]
fn a_right_guess_spares_three_quarters_of_the_questions() {
    let mut client = slaves(&FOUR[..1], 0);
    let found = client.lss().scan(Some(ADDRESS)).unwrap();
    assert_eq!(found.unwrap().numbers(), FOUR[0]);
    assert_eq!(client.into_bus().questions, 1 + 3 + 33);
}

#[test]
fn all_nodes_are_listed_and_nothing_is_changed() {
    let mut client = slaves(&FOUR, 0);
    let listed = client.lss().list().unwrap();
    assert_eq!(
        listed
            .iter()
            .map(|address| address.numbers())
            .collect::<Vec<_>>(),
        FOUR
    );
    let bus = client.into_bus();
    assert!(
        bus.nodes
            .iter()
            .all(|node| node.id == 0xFF && !node.in_configuration)
    );
    assert_eq!(slaves(&[], 0).lss().list().unwrap(), []);
}

#[test]
fn a_lost_answer_makes_the_scan_begin_anew() {
    let mut client = slaves(&FOUR[..1], 1);
    let found = client.lss().scan(None).unwrap().unwrap();
    assert_eq!(found.numbers(), FOUR[0]);
    assert!(client.into_bus().questions > 135);
    let never = slaves(&FOUR[..1], u32::MAX).lss().scan(None).unwrap_err();
    assert!(matches!(never, ClientError::Lss(LssFailure::Unsteady)));
}

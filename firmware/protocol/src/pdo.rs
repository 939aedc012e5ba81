//! What each PDO carries and when, as a vertebra leaves the factory.

use crate::dictionary::{self, Pdo};
use crate::ids::Cob;

pub use eel_canopen::{Mapped, PdoDefault};

/// Makes a mapping from `(index, subindex)` pairs; the length comes from the dictionary.
///
/// # Panics
/// Only while compiling: where an object is not in the dictionary, or not made for `direction`.
const fn mapped<const N: usize>(direction: Pdo, pairs: [(u16, u8); N]) -> [Mapped; N] {
    let mut mapping = [Mapped {
        index: 0,
        subindex: 0,
        bits: 0,
    }; N];
    let mut total = 0;
    let mut place = 0;
    while place < N {
        let (index, subindex) = pairs[place];
        let Some(sub) = dictionary::lookup(index, subindex) else {
            panic!("no such object")
        };
        assert!(matches!(
            (sub.pdo, direction),
            (Pdo::Receive, Pdo::Receive) | (Pdo::Transmit, Pdo::Transmit)
        ));
        let bits = sub.data_type.bits();
        total += bits as usize;
        mapping[place] = Mapped {
            index,
            subindex,
            bits,
        };
        place += 1;
    }
    assert!(total == 64, "a frame of this bus is full");
    mapping
}

/// What RPDO1 carries where it is not mapped otherwise.
pub const TARGET: &[Mapped] = &mapped(
    Pdo::Receive,
    [
        (0x2000, 1),
        (0x2000, 2),
        (0x2000, 3),
        (0x2000, 4),
        (0x2000, 5),
    ],
);
const MOMENT: &[Mapped] = &mapped(
    Pdo::Receive,
    [(0x2001, 1), (0x2001, 2), (0x2001, 3), (0x2001, 4)],
);
/// What TPDO1 carries where it is not mapped otherwise.
pub const POSE: &[Mapped] = &mapped(
    Pdo::Transmit,
    [
        (0x2010, 1),
        (0x2010, 2),
        (0x2010, 3),
        (0x2010, 4),
        (0x2010, 5),
    ],
);
/// What TPDO2 carries where it is not mapped otherwise.
pub const EFFORT: &[Mapped] = &mapped(
    Pdo::Transmit,
    [(0x2011, 1), (0x2011, 2), (0x2011, 3), (0x2011, 4)],
);

/// The PDOs that a vertebra receives: RPDO1 target, latched at each SYNC, and RPDO2 moment, off.
pub const RPDOS: &[PdoDefault] = &[
    PdoDefault {
        cob_id_base: Cob::Target(0).id(),
        transmission: 1,
        enabled: true,
        mapping: TARGET,
    },
    PdoDefault {
        cob_id_base: Cob::Moment(0).id(),
        transmission: 1,
        enabled: false,
        mapping: MOMENT,
    },
];

/// The PDOs that a vertebra sends: TPDO1 pose at each SYNC, TPDO2 effort at every second.
pub const TPDOS: &[PdoDefault] = &[
    PdoDefault {
        cob_id_base: Cob::Pose(0).id(),
        transmission: 1,
        enabled: true,
        mapping: POSE,
    },
    PdoDefault {
        cob_id_base: Cob::Effort(0).id(),
        transmission: 2,
        enabled: true,
        mapping: EFFORT,
    },
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mapping_has_the_lengths_of_the_dictionary_in_the_order_asked_for() {
        let pose = mapped(
            Pdo::Transmit,
            [
                (0x2011, 2),
                (0x2010, 4),
                (0x2010, 5),
                (0x2011, 1),
                (0x2010, 3),
            ],
        );
        assert_eq!(
            pose.map(|it| (it.index, it.subindex))[1..3],
            [(0x2010, 4), (0x2010, 5)]
        );
        assert_eq!(pose.map(|it| it.bits), [16, 8, 8, 16, 16]);
    }

    #[test]
    #[should_panic(expected = "no such object")]
    fn what_is_not_in_the_dictionary_is_not_mapped() {
        mapped(Pdo::Transmit, [(0x2010, 99)]);
    }

    #[test]
    #[should_panic(expected = "direction")]
    fn what_is_received_is_not_mapped_to_be_sent() {
        mapped(Pdo::Transmit, [(0x2000, 1)]);
    }

    #[test]
    #[should_panic(expected = "a frame of this bus is full")]
    fn a_frame_that_is_not_full_is_not_mapped() {
        mapped(Pdo::Receive, [(0x2000, 1), (0x2000, 2)]);
    }
}

use std::string::{String, ToString};
use std::vec::Vec;

use super::*;

#[test]
fn every_entry_is_found_where_it_stands_and_nothing_else_is() {
    let mut found = 0;
    for index in 0..=u16::MAX {
        for subindex in 0..=u8::MAX {
            let by_search = OBJECTS
                .iter()
                .find(|object| object.index == index)
                .map(|object| object.subs.iter().find(|sub| sub.subindex == subindex));
            match (by_search, find(index, subindex)) {
                (None, answer) => {
                    assert_eq!(answer, Err(Abort::NoObject));
                    assert!(lookup(index, subindex).is_none());
                    assert_eq!(served(index, subindex), Err(Abort::NoObject));
                }
                (Some(None), answer) => {
                    assert_eq!(answer, Err(Abort::NoSubindex));
                    assert!(lookup(index, subindex).is_none());
                    assert_eq!(served(index, subindex), Err(Abort::NoSubindex));
                }
                (Some(Some(sub)), answer) => {
                    assert_eq!(answer.map(|(_, sub)| sub), Ok(sub));
                    assert_eq!(lookup(index, subindex), Some(sub));
                    serves_as_the_table_says(sub, served(index, subindex).unwrap());
                    found += 1;
                }
            }
        }
    }
    assert_eq!(found, entries().count());
}

/// Holds what is served of an entry against its place in the table.
fn serves_as_the_table_says(sub: &Sub, served: &Served) {
    assert_eq!(served.field, sub.field);
    assert_eq!(served.data_type, sub.data_type);
    assert_eq!(served.bounds(), (sub.min, sub.max));
    let entry = served.entry();
    assert_eq!(entry.length, sub.data_type.length());
    assert_eq!(entry.access, sub.access);
    assert_eq!(entry.tpdo, sub.pdo == Pdo::Transmit);
    assert_eq!(entry.rpdo, sub.pdo == Pdo::Receive);
    let writable = !matches!(sub.access, Access::Constant | Access::ReadOnly);
    if !writable || sub.data_type.is_domain() {
        return;
    }
    let (least, most) = sub.data_type.range();
    for value in [sub.min - 1, sub.min, sub.default, sub.max, sub.max + 1] {
        if !(least..=most).contains(&value) {
            continue;
        }
        let bytes = value.to_le_bytes();
        let expected = if value < sub.min {
            Err(Abort::ValueTooLow)
        } else if value > sub.max {
            Err(Abort::ValueTooHigh)
        } else {
            Ok(value)
        };
        let bytes = &bytes[..usize::from(sub.data_type.length())];
        assert_eq!(served.accept(bytes), expected);
    }
}

#[test]
fn entry_zero_is_a_constant_byte() {
    for object in OBJECTS {
        let zero = entry(object.index, 0).unwrap();
        assert_eq!((zero.length, zero.access), (1, Access::Constant));
        assert!(entry(object.index, object.highest()).is_ok());
        assert_eq!(
            entry(object.index, object.highest() + 1),
            Err(Abort::NoSubindex)
        );
    }
    assert_eq!(entry(0x1FFF, 0), Err(Abort::NoObject));
}

#[test]
fn dotted_names_are_unique_and_plain() {
    let names: Vec<_> = entries()
        .map(|(object, sub)| object.dotted(sub).to_string())
        .collect();
    for (place, name) in names.iter().enumerate() {
        assert!(!names[..place].contains(name), "{name} twice");
        let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '.';
        assert!(name.chars().all(plain), "{name}");
    }
    assert!(names.contains(&String::from("pose.yaw")));
}

#[test]
fn an_rpdo_carries_what_is_written_and_a_tpdo_what_is_read() {
    for (object, sub) in entries() {
        let name = object.dotted(sub);
        match sub.pdo {
            Pdo::Receive => assert_eq!(sub.access, Access::ReadWrite, "{name}"),
            Pdo::Transmit => assert_eq!(sub.access, Access::ReadOnly, "{name}"),
            Pdo::No => {}
        }
    }
}

#[test]
fn numbers_survive_the_way_to_bytes_and_back() {
    for (_, sub) in entries().filter(|(_, sub)| !sub.data_type.is_domain()) {
        let (low, high) = sub.data_type.range();
        for value in [low, low / 3, -1, 0, 1, sub.default, high / 7, high] {
            let mut bytes = [0xEE; 8];
            let length = sub.data_type.encode(value, &mut bytes).unwrap();
            assert_eq!(length, usize::from(sub.data_type.length()));
            assert_eq!(
                sub.data_type.decode(&bytes[..length]),
                Ok(value.clamp(low, high))
            );
            assert!(bytes[length..].iter().all(|byte| *byte == 0xEE));
            assert_eq!(
                sub.data_type.encode(value, &mut bytes[..length - 1]),
                Err(Abort::OutOfMemory)
            );
            assert_eq!(
                sub.data_type.decode(&bytes[..length - 1]),
                Err(Abort::TooShort)
            );
            assert_eq!(
                sub.data_type.decode(&bytes[..length + 1]),
                Err(Abort::TooLong)
            );
        }
    }
}

#[test]
fn a_domain_has_no_number_and_says_so() {
    let domains: Vec<_> = entries()
        .filter(|(_, sub)| sub.data_type.is_domain())
        .collect();
    assert_eq!(domains.len(), 3);
    for (object, sub) in domains {
        let described = entry(object.index, sub.subindex).unwrap();
        assert!(described.domain && described.length == 0);
        assert!(!described.tpdo && !described.rpdo);
        assert_eq!(sub.data_type.decode(&[]), Err(Abort::UnsupportedAccess));
        assert_eq!(
            sub.data_type.encode(0, &mut [0; 8]),
            Err(Abort::UnsupportedAccess)
        );
    }
}

#[test]
fn a_value_outside_the_bounds_is_refused_with_the_code_that_says_so() {
    let yaw = served(0x2020, 8).unwrap();
    assert_eq!(yaw.accept(&5_236_i16.to_le_bytes()), Ok(5_236));
    assert_eq!(
        yaw.accept(&5_237_i16.to_le_bytes()),
        Err(Abort::ValueTooHigh)
    );
    assert_eq!(yaw.accept(&(-1_i16).to_le_bytes()), Err(Abort::ValueTooLow));
    assert_eq!(yaw.accept(&[1]), Err(Abort::TooShort));
    assert_eq!(yaw.accept(&[1, 2, 3]), Err(Abort::TooLong));
    let pose = served(0x2010, 1).unwrap();
    assert_eq!(pose.accept(&[0, 0]), Err(Abort::ReadOnly));
}

#[test]
fn each_field_leads_to_its_entry() {
    for (_, sub) in entries() {
        assert_eq!(sub.field.sub(), sub);
    }
}

//! The ring on its own: which samples it keeps, and in which order they are read.

use std::vec;
use std::vec::Vec;

use super::*;

const YAW: i64 = 0x2010_0110;
const SUPPLY: i64 = 0x2030_0110;

/// Lets ticks pass; a sample's numbers are its tick, and ten thousand more in each channel.
fn run(scope: &mut Scope, ticks: core::ops::Range<u64>, fault_at: Option<u64>) {
    for tick in ticks {
        if scope.due(fault_at == Some(tick)).is_some() {
            let values = [0, 10_000, 20_000, 30_000].map(|base| base + tick as i32);
            scope.take(Instant::from_micros(tick * 1_000), values);
        }
    }
}

/// Reads the capture in odd pieces: its header and each sample.
fn read(scope: &mut Scope) -> (ScopeHeader, Vec<Vec<i32>>) {
    let length = scope.open();
    let mut bytes = Vec::new();
    let mut piece = [0; 13];
    loop {
        let count = scope.read(bytes.len() as u32, &mut piece);
        bytes.extend(&piece[..count]);
        if count < piece.len() {
            break;
        }
    }
    assert_eq!(bytes.len(), length as usize);
    let (header, samples) = ScopeHeader::from_bytes(&bytes).unwrap();
    let width = header.width();
    let words: Vec<i32> = samples
        .as_chunks()
        .0
        .iter()
        .map(|word| i32::from_le_bytes(*word))
        .collect();
    (
        header,
        words.chunks(width.max(1)).map(<[i32]>::to_vec).collect(),
    )
}

#[test]
fn a_capture_fills_memory_once_and_ends() {
    for (channels, room) in [(1, 1_024), (2, 512), (3, 341), (4, 256)] {
        let mut scope = Scope::default();
        let fields = [
            Field::ScopeChannel1,
            Field::ScopeChannel2,
            Field::ScopeChannel3,
            Field::ScopeChannel4,
        ];
        // The first channels stay empty.
        for field in fields.into_iter().skip(4 - channels) {
            scope.set(field, YAW).unwrap();
        }
        scope.set(Field::ScopeTrigger, 1).unwrap();
        run(&mut scope, 100..5_000, None);
        assert_eq!(scope.value(Field::ScopeState), 4);
        let (header, samples) = read(&mut scope);
        assert_eq!((header.samples, samples.len()), (room, usize::from(room)));
        assert_eq!((header.first_us, header.fault), (100_000, None));
        for (sample, tick) in samples.iter().zip(100..) {
            let expected: Vec<i32> = (4 - channels..4)
                .map(|channel| 10_000 * channel as i32 + tick)
                .collect();
            assert_eq!(*sample, expected);
        }
    }
}

#[test]
fn a_divider_leaves_ticks_out() {
    let mut scope = Scope::default();
    scope.set(Field::ScopeChannel1, YAW).unwrap();
    scope.set(Field::ScopeDivider, 7).unwrap();
    scope.set(Field::ScopeTrigger, 1).unwrap();
    run(&mut scope, 0..70, None);
    let (header, samples) = read(&mut scope);
    assert_eq!((header.state, header.divider), (ScopeState::Filling, 7));
    assert!(
        samples
            .into_iter()
            .eq((0..70).step_by(7).map(|tick| vec![tick]))
    );
    assert_eq!(scope.value(Field::ScopeState), 0, "reading ended it");
}

#[test]
fn a_fault_stands_in_the_middle_of_what_is_kept() {
    let mut scope = Scope::default();
    scope.set(Field::ScopeChannel2, SUPPLY).unwrap();
    scope.set(Field::ScopeChannel4, YAW).unwrap();
    scope.set(Field::ScopeTrigger, 2).unwrap();
    run(&mut scope, 0..3_000, Some(2_000));
    let (header, samples) = read(&mut scope);
    assert_eq!((header.state, header.samples), (ScopeState::Full, 512));
    let fault = header.fault.unwrap();
    assert_eq!(fault, 256);
    assert_eq!(samples[usize::from(fault)], [12_000, 32_000]);
    assert_eq!(header.first_us, (2_000 - 256) * 1_000);
    for (sample, tick) in samples.iter().zip(2_000 - 256..) {
        assert_eq!(*sample, [10_000 + tick, 30_000 + tick]);
    }
}

/// The head tells the time of the first sample and the time between two: they must hold for all.
#[test]
fn a_fault_does_not_change_the_time_between_two_samples() {
    for end in [2_005, 2_006, 2_030] {
        let mut scope = Scope::default();
        scope.set(Field::ScopeChannel1, YAW).unwrap();
        scope.set(Field::ScopeDivider, 10).unwrap();
        scope.set(Field::ScopeTrigger, 2).unwrap();
        run(&mut scope, 0..end, Some(2_004));
        let (header, samples) = read(&mut scope);
        assert_eq!(header.first_us, 0);
        let times = (0..).step_by(10).map(|tick| vec![tick]);
        assert!(samples.iter().cloned().eq(times.take(samples.len())));
        let fault = header.fault.map(usize::from);
        assert_eq!(fault, (end == 2_030).then_some(201));
    }
}

#[test]
fn an_early_fault_has_less_before_it() {
    let mut scope = Scope::default();
    scope.set(Field::ScopeChannel1, YAW).unwrap();
    scope.set(Field::ScopeTrigger, 2).unwrap();
    run(&mut scope, 0..2_000, Some(3));
    let (header, samples) = read(&mut scope);
    assert_eq!((header.samples, header.fault), (3 + 512, Some(3)));
    assert!(samples.into_iter().eq((0..515).map(|tick| vec![tick])));
}

#[test]
fn settings_stay_while_it_captures_and_change_what_is_kept() {
    let mut scope = Scope::default();
    assert_eq!(
        scope.set(Field::ScopeTrigger, 1),
        Err(Abort::DeviceState),
        "no channel"
    );
    for wrong in [0x2010_0120, 0x2101_0100, 0x1001_0008, 5] {
        assert_eq!(
            scope.set(Field::ScopeChannel1, wrong),
            Err(Abort::NotMappable)
        );
    }
    scope.set(Field::ScopeChannel1, YAW).unwrap();
    scope.set(Field::ScopeTrigger, 2).unwrap();
    run(&mut scope, 0..10, None);
    for field in [Field::ScopeChannel1, Field::ScopeDivider] {
        assert_eq!(scope.set(field, 0), Err(Abort::DeviceState));
    }
    scope.set(Field::ScopeTrigger, 0).unwrap();
    assert_eq!(scope.value(Field::ScopeSamples), 10);
    scope.set(Field::ScopeDivider, 2).unwrap();
    assert_eq!(scope.value(Field::ScopeSamples), 0);
    let (header, samples) = read(&mut scope);
    assert_eq!((header.samples, samples.len()), (0, 0));
}

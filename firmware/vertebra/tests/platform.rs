//! What a platform is told beside drives and frames: what to let pass, and what was lost.

use eel_protocol::{Cob, Mode, State};

use support::{Bench, node};

mod support;

#[test]
fn the_identifiers_to_let_pass_follow_the_parameters() {
    let mut bench = Bench::ready();
    let own = node().get();
    let hears = |bench: &Bench, cob: Cob| bench.vertebra.identifiers().contains(&cob.id());
    for cob in [
        Cob::Nmt,
        Cob::Sync,
        Cob::LssRequest,
        Cob::SdoRequest(own),
        Cob::Target(own),
    ] {
        assert!(hears(&bench, cob), "{cob:?}");
    }
    for cob in [Cob::Moment(own), Cob::Target(own + 1), Cob::Pose(own)] {
        assert!(!hears(&bench, cob), "{cob:?}");
    }
    bench.maintain();
    let moment = u32::from(Cob::Moment(own).id());
    bench.download(0x1401, 1, &moment.to_le_bytes()).unwrap();
    assert!(hears(&bench, Cob::Moment(own)));
}

#[test]
fn events_that_nobody_polls_are_forgotten_and_counted() {
    let mut bench = Bench::ready();
    while bench.vertebra.poll_event().is_some() {}
    assert_eq!(bench.vertebra.events_dropped(), 0);
    for _ in 0..20 {
        bench.mode = Mode::Run;
        bench.until(State::Run, 100);
        bench.mode = Mode::Off;
        bench.until(State::Ready, 3_000);
    }
    let kept = std::iter::from_fn(|| bench.vertebra.poll_event()).count();
    let dropped = bench.vertebra.events_dropped() as usize;
    assert!(kept <= 16, "{kept}");
    // To Run and back are at least two changes of the state.
    assert!(dropped + kept >= 40, "{dropped} and {kept}");
}

#[test]
fn a_target_that_never_arrives_is_counted_once() {
    let mut bench = Bench::running();
    let before = bench.vertebra.targets_lost();
    bench.run(100);
    assert_eq!(bench.vertebra.targets_lost(), before);
    let _ = bench.next_target();
    bench.run(100);
    assert_eq!(bench.vertebra.targets_lost(), before + 1);
    let _ = (bench.next_target(), bench.next_target());
    bench.run(100);
    assert_eq!(bench.vertebra.targets_lost(), before + 3);
}

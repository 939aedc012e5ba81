//! How soon vertebrae react: the promises, over more than a thousand injections.

use hil_sim::reactions::{CLASSES, Options, run};

#[test]
fn every_promise_is_kept_in_over_a_thousand_injections() {
    let options = Options { cases: 60, seed: 7 };
    let report = run(&options, |_| {}).expect("a robot");
    println!("{report}");
    assert!(report.injections >= 1_000);
    assert_eq!(report.injections, 60 * CLASSES.len());
    assert!(
        report.passed,
        "see the lines with BROKEN or EXCEEDED above; `hil-sim reactions` measures again"
    );
    // A table that measured nothing would pass, too.
    for row in &report.rows {
        assert!(
            row.worst_ms > 0.0 && row.median_ms <= row.worst_ms,
            "{row:?}"
        );
    }
    assert!(report.extremes.iter().all(|it| it.worst > 0.0));
}

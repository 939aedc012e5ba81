//! The main job as a user runs it, with the bands that real eels and the model's authors set.

use eel_head::Gait;
use hil_sim::swim::{Options, Summary, run};

fn options(seconds: f64, seed: u64) -> Options {
    Options {
        seconds,
        gait: Gait::SWIM,
        frequency_hz: 1.0,
        amplitude: 0.08,
        wavelength: 0.8,
        seed,
        out: None,
        faults: Vec::new(),
        emulated: None,
        progress: false,
    }
}

fn swim(seconds: f64, seed: u64) -> Summary {
    run(&options(seconds, seed)).expect("nothing is written")
}

#[test]
fn ten_vertebrae_swim_as_eels_do() {
    let summary = swim(20.0, 1);
    println!("{summary}");
    let figures = summary.figures;
    let within = |name: &str, value: Option<f64>, low: f64, high: f64| {
        let value = value.unwrap_or_else(|| panic!("{name} is missing"));
        assert!(
            (low..=high).contains(&value),
            "{name} is {value}, not in {low}..{high}"
        );
    };
    // Kern & Koumoutsakos 2006; Borazjani & Sotiropoulos 2009; Carling et al. 1998.
    within("stride", figures.stride_body_lengths, 0.26, 0.55);
    within("Strouhal number", figures.strouhal, 0.30, 0.50);
    within("slip", figures.slip, 0.45, 0.77);
    within("unsteadiness", figures.unsteadiness, 0.0, 0.03);
    assert_eq!(summary.nodes_operational, 10);
    assert_eq!(summary.frames_lost, 0);
    assert_eq!((summary.boots, summary.emergencies), (10, 0));
    assert!(summary.stopped_in_order);
    assert!(
        summary.bus_load_percent < 35.0,
        "{}",
        summary.bus_load_percent
    );
    for node in &summary.nodes {
        assert!(
            node.peak_yaw_rad < std::f64::consts::FRAC_PI_6,
            "{node:?} left the workspace"
        );
        assert!(node.peak_torque_nm < 2.6, "{node:?}");
        assert!(
            node.max_tracking_error_rad
                .is_some_and(|error| error < 0.02),
            "{node:?}"
        );
    }
}

#[test]
fn the_same_seed_gives_the_same_frames_and_another_seed_others() {
    let [first, second, other] = [3, 3, 4].map(|seed| swim(3.0, seed).frame_log_sha256);
    assert_eq!(first, second);
    assert_ne!(first, other);
}

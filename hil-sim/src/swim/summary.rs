//! What came of a run, as JSON and as a table.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use eel_protocol::emergency::{CATALOGUE, Emergency, Severity};
use serde::Serialize;

use crate::plant::measures::Figures;
use crate::robot::NODES;

/// What came of a run. The fields are the keys of `--json`.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Simulated time of swimming before the stop, s.
    pub seconds: f64,
    /// Whether the stop began earlier than planned.
    pub interrupted: bool,
    /// Simulated time with the stop, s.
    pub simulated_s: f64,
    /// Cycles a second, Hz.
    pub frequency_hz: f64,
    /// Amplitude that was asked for, body lengths.
    pub amplitude_body_lengths: f64,
    /// Length of the wave, body lengths.
    pub wavelength_body_lengths: f64,
    /// The seed.
    pub seed: u64,
    /// How the eel swam.
    #[serde(flatten)]
    pub figures: SwimFigures,
    /// Largest torque of any motor, N·m.
    pub peak_torque_nm: f64,
    /// Largest angle between a reference and the true pose, rad.
    pub max_tracking_error_rad: f64,
    /// Vertebrae that followed the gait when the stop began.
    pub nodes_operational: usize,
    /// Whether the eel was straightened and switched off at the end.
    pub stopped_in_order: bool,
    /// Emergency frames other than "cleared".
    pub emergencies: u32,
    /// How many of them have which name.
    pub emergency_names: BTreeMap<String, u32>,
    /// Times that vertebrae booted.
    pub boots: u32,
    /// Frames on the bus.
    pub frames: u64,
    /// Frames lost: in full FIFOs and queues, and by gaps in counters.
    pub frames_lost: u64,
    /// Share of the time in which the bus was busy, exact from the bits of its frames, %.
    pub bus_load_percent: f64,
    /// Simulated time over the time it took.
    pub real_time_factor: f64,
    /// SHA-256 of the frame log.
    pub frame_log_sha256: String,
    /// Each vertebra.
    pub nodes: Vec<NodeSummary>,
    /// Files written.
    pub files: Vec<PathBuf>,
}

/// How the eel swam over its last six cycles; `null` where it swam for less than that.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct SwimFigures {
    /// Speed of the centre of mass, m/s.
    pub speed_m_s: Option<f64>,
    /// Way per cycle, body lengths.
    pub stride_body_lengths: Option<f64>,
    /// Speed over that of the body wave.
    pub slip: Option<f64>,
    /// Strouhal number 2 f A/U.
    pub strouhal: Option<f64>,
    /// Half the excursion of the tail edge, body lengths.
    pub tail_amplitude_body_lengths: Option<f64>,
    /// Mechanical power of the joints, W.
    pub mean_power_w: Option<f64>,
    /// Difference of the speeds of the first and last three cycles over their mean.
    pub unsteadiness: Option<f64>,
}

/// One vertebra.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct NodeSummary {
    /// Its node id.
    pub node: u8,
    /// Largest torque of its motors, N·m.
    pub peak_torque_nm: f64,
    /// Largest angle between reference and true pose, rad.
    pub max_tracking_error_rad: Option<f64>,
    /// Largest yaw, rad.
    pub peak_yaw_rad: f64,
}

impl From<Option<Figures>> for SwimFigures {
    fn from(figures: Option<Figures>) -> Self {
        let Some(figures) = figures else {
            return Self::default();
        };
        Self {
            speed_m_s: Some(figures.speed_m_s),
            stride_body_lengths: Some(figures.stride_body_lengths),
            slip: Some(figures.slip),
            strouhal: Some(figures.strouhal),
            tail_amplitude_body_lengths: Some(figures.tail_amplitude_body_lengths),
            mean_power_w: Some(figures.mean_power_w),
            unsteadiness: Some(figures.unsteadiness),
        }
    }
}

impl Summary {
    /// Returns what is not as it should be, a sentence each.
    pub fn complaints(&self) -> Vec<String> {
        let Self {
            nodes_operational,
            frames_lost,
            seconds,
            ..
        } = self;
        let mut complaints = Vec::new();
        if self.interrupted {
            complaints.push(format!(
                "stopped early, after {seconds:.2} s; the records hold what happened until then"
            ));
        }
        if *nodes_operational < NODES {
            complaints.push(format!(
                "{nodes_operational} of {NODES} vertebrae followed the gait when the stop began; \
                 states.csv shows the state of each"
            ));
        }
        if let Some(first) = self.emergency_names.keys().find(|name| is_failure(name)) {
            complaints.push(format!(
                "vertebrae did not do what the gait asked ({first}); ask for less: a lower \
                 --frequency or --amplitude"
            ));
        }
        if *frames_lost > 0 {
            complaints.push(format!(
                "{frames_lost} frames were lost on the bus or in queues"
            ));
        }
        if !self.stopped_in_order {
            complaints.push("the eel was not straightened and switched off at the end".to_owned());
        }
        complaints
    }
}

/// Tells whether an emergency means that a vertebra did not follow: faults, and the following error.
fn is_failure(name: &str) -> bool {
    let known = CATALOGUE.iter().find(|known| known.name == name);
    known.is_none_or(|known| {
        known.severity == Severity::Fault || *known == Emergency::FOLLOWING_ERROR
    })
}

impl fmt::Display for Summary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { figures, .. } = self;
        writeln!(
            out,
            "Swam {} s at {} Hz, amplitude {} L, wavelength {} L (seed {})\n",
            self.seconds,
            self.frequency_hz,
            self.amplitude_body_lengths,
            self.wavelength_body_lengths,
            self.seed,
        )?;
        match figures.speed_m_s {
            Some(_) => swimming(out, figures)?,
            None => writeln!(
                out,
                "  speed and stride   need six cycles after the start: swim for longer"
            )?,
        }
        row(
            out,
            "bus load",
            format_args!("{:.2} %", self.bus_load_percent),
        )?;
        row(
            out,
            "frames",
            format_args!("{} ({} lost)", self.frames, self.frames_lost),
        )?;
        row(
            out,
            "vertebrae",
            format_args!("{} operational", self.nodes_operational),
        )?;
        row(out, "emergencies", format_args!("{}", self.emergencies))?;
        for (name, count) in &self.emergency_names {
            row(out, "", format_args!("{count} {name}"))?;
        }
        let stop = if self.stopped_in_order {
            "straightened, switched off"
        } else {
            "not in order"
        };
        row(out, "stop", format_args!("{stop}"))?;
        row(
            out,
            "real-time factor",
            format_args!("{:.1}", self.real_time_factor),
        )?;
        writeln!(
            out,
            "\n  vertebra   peak yaw   peak torque   worst tracking error"
        )?;
        for node in &self.nodes {
            let error = node.max_tracking_error_rad.map_or_else(
                || "   in QEMU".to_owned(),
                |error| format!("{:8.2} mrad", error * 1e3),
            );
            writeln!(
                out,
                "  {:8}   {:6.2}°   {:7.2} N·m   {error}",
                node.node,
                node.peak_yaw_rad.to_degrees(),
                node.peak_torque_nm,
            )?;
        }
        writeln!(out, "\n  frame log SHA-256  {}", self.frame_log_sha256)?;
        for path in &self.files {
            writeln!(out, "  {}", path.display())?;
        }
        Ok(())
    }
}

/// Writes the figures of the swim.
fn swimming(out: &mut fmt::Formatter<'_>, figures: &SwimFigures) -> fmt::Result {
    let number = |value: Option<f64>| value.unwrap_or(f64::NAN);
    row(
        out,
        "forward speed",
        format_args!("{:.3} m/s", number(figures.speed_m_s)),
    )?;
    row(
        out,
        "stride",
        format_args!("{:.3} L per cycle", number(figures.stride_body_lengths)),
    )?;
    row(out, "slip", format_args!("{:.3}", number(figures.slip)))?;
    row(
        out,
        "Strouhal number",
        format_args!("{:.3}", number(figures.strouhal)),
    )?;
    let tail = number(figures.tail_amplitude_body_lengths);
    row(out, "tail amplitude", format_args!("{tail:.4} L"))?;
    row(
        out,
        "mechanical power",
        format_args!("{:.2} W", number(figures.mean_power_w)),
    )
}

fn row(out: &mut fmt::Formatter<'_>, name: &str, value: fmt::Arguments<'_>) -> fmt::Result {
    writeln!(out, "  {name:18} {value}")
}

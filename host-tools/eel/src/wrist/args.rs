//! The arguments of `eel wrist`.

use clap::{Args, Subcommand, ValueEnum};
use eel_kinematics::design::{AssemblyMode, Geometry, WorkingMode};
use serde::Serialize;

const AFTER: &str = "\
Angles are in radians (--degrees: all of them, in and out), moments and torques in N·m, in the base
frame: x dorsoventral, y lateral, z along the body. A pose is R = Rx(yaw) Ry(pitch) Rz(roll) Rz(π/4), or
the paper's R = Rz(theta3) Ry(phi) Rx(psi). Home is yaw = pitch = roll = 0, theta = (0, 0, π/4).

Working modes name the inverse solutions by the signs of (l×r)·i on legs 1 and 2: ++ (home), +-, -+, --.
Assembly modes name the direct ones: home (det A > 0), other-psi (det A < 0), and with leg 1's other phi
other-phi (det A > 0) and other-both (det A < 0). The home branch is ++ and home, with cos phi > 0.

Exit codes: 0 answered; 1 a claim that should hold does not (paper); 2 wrong usage, or no
configuration answers; 3 a file can't be written.

Examples:
  eel wrist ik --yaw 20 --pitch 5 --degrees          motor angles, fixed point beside double precision
  eel wrist ik --theta3 0.7854 --phi 0.2618 --psi 0.2618 --all --json
  eel wrist fk --theta 0.1,0.2,0.785398 --all        the four platforms of Fig. 12
  eel wrist torque --moment 2,0.5,0 --limits -0.8,0.8
  eel wrist workspace                                margin and conditioning over yaw and pitch
  eel wrist draw --figure 12                         the same four, drawn
  eel wrist paper                                    what the paper says, and what is true";

const IK_JSON: &str = "\
--json: architecture, kernel (who gave theta), unit, pose, working_mode, assembly_mode (null on a
singularity), theta (in that working mode), theta_f64, theta_fixed (null where the kernel does not answer;
fixed_refusal says why, nearest what it reaches instead), det_a, b, condition (of A), condition_of_rates
(of B⁻¹A), isotropy and isotropy_of_rates (their inverses), manipulability (|det A|) and
manipulability_of_rates (of A⁻¹B), margin (1 at home, 0 where a crank and its rod line up), travel (within,
and the limit with the least room: coordinate, side, room); with --all solutions (four, home first) and
working_modes (their names).";

const FK_JSON: &str = "\
--json: architecture, kernel (who gave the pose), unit, theta, assembly_mode, phi, psi, yaw, pitch, roll,
det_a, fixed and f64 (both answers), fixed_refusal, solutions (all that exist, home first, each with
assembly_mode and det_a).";

const JACOBIAN_JSON: &str = "\
A ω = B θ̇ with rows of A: p1×r1, p2×r2, z''. Computed in double precision.

--json: architecture, unit (of theta), theta, a (rows), b (the diagonal of B), rate_map (B⁻¹A: θ̇ from ω,
null entries at a serial singularity), torque_map (B A⁻ᵀ: τ from M), torque_map_fixed (the kernel's, or
null), det_a, condition, condition_of_rates.";

const TORQUE_JSON: &str = "\
--policy yaw-first grants yaw, then pitch, then roll, each as large a fraction as the motors allow;
keep-direction grants the same fraction of all three.

--json: architecture, kernel (who gave tau), policy, tau, achieved, unallocated (N·m), bound (per motor: null,
low or high), tau_f64, tau_fixed (null where the kernel does not answer; fixed_refusal says why).";

const MARGIN_JSON: &str = "\
Each margin is 1 at home and 0 at its singularity, and varies continuously between.

--json: architecture, kernel (who gave margin), margin (the lesser of serial 1 and 2), serial (legs 1
and 2 by (l×r)·i over home's, leg 3 by cos phi), assembly (det A over home's), depths (its two factors, by
leg), least_singular (the least singular value of A), least (of serial and assembly; negative outside
home's assembly mode), travel (within, and the limit with the least room), fixed_refusal.";

const WORKSPACE_JSON: &str = "\
Home's working mode. Hatched: a leg does not reach; grey: beyond a parallel singularity. On the terminal:
the least margin and the worst condition number in the paper's box (yaw ±30°, pitch ±15°, roll ±4°), and how
far the box may grow before it meets a singularity.

--json: architecture, unit, roll, yaw and pitch (the grid's coordinates), of (for each measure its values,
one row per pitch, null out of reach), reach (is it in reach), summary: box, at_roll and any_roll
(least_margin and worst_condition, each with its value, null where infinite, yaw, pitch and roll),
largest_box (by how much the box may grow), global_isotropy and global_isotropy_of_rates (means over the
box). No SVG is written with --json unless --out names a file.

Examples:
  eel wrist workspace                                          the prototype, to workspace.svg
  eel wrist workspace --architecture orthogonal-axes --roll 4 --degrees --out map.svg
  eel wrist workspace --of serial,parallel --yaw-range -90,90 --degrees --out - > map.svg";

const DRAW_JSON: &str = "\
A pose (home if none is given) is drawn in one working mode, motor angles (--theta) in one assembly mode;
--all draws all four of either. Blue: leg 1; orange: leg 2; green: leg 3 and its axes z, y', x''.

--json: unit, title, panels: architecture, working_mode, assembly_mode (null on a singularity), theta, phi,
psi, yaw, pitch, roll, det_a, points (a, b, c of legs 1 and 2, in arms, in the base frame). No SVG is written
with --json unless --out names a file.

Examples:
  eel wrist draw --yaw 20 --pitch -10 --degrees
  eel wrist draw --theta 0.1,0.2,0.785398 --all --out solutions.svg
  eel wrist draw --figure 13 --out - > figure-13.svg";

/// The questions one can ask the wrist.
#[derive(Debug, Args)]
#[command(after_help = AFTER)]
pub struct Wrist {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Motor angles for a pose
    #[command(after_help = IK_JSON)]
    Ik(Ik),
    /// The pose for motor angles
    #[command(after_help = FK_JSON)]
    Fk(Fk),
    /// A, B, their maps and condition numbers at a pose
    #[command(after_help = JACOBIAN_JSON)]
    Jacobian(At),
    /// Motor torques for a moment at a pose, within bounds
    #[command(after_help = TORQUE_JSON)]
    Torque(Torque),
    /// How far a pose is from each singularity
    #[command(after_help = MARGIN_JSON)]
    Margin(At),
    /// A map of margin and conditioning over yaw and pitch, as SVG
    #[command(after_help = WORKSPACE_JSON)]
    Workspace(Workspace),
    /// The mechanism in a pose, in all its solutions, or as a figure of the paper, as SVG
    #[command(after_help = DRAW_JSON)]
    Draw(Draw),
    /// Every claim of the paper: printed, computed, verdict, errata
    Paper(Paper),
}

/// The three wrists of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Architecture {
    /// Both crank axes along x, crank 1
    ParallelAxes,
    /// Crank axes at right angles through the centre, crank √2
    OrthogonalAxes,
    /// The prototype's: crank √½
    ParallelActuators,
}

/// Who answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// The firmware's fixed-point kernel: parallel-actuators, home branch
    Fixed,
    /// The general model in double precision
    F64,
}

/// What all questions have in common.
#[derive(Clone, Copy, Debug, Args)]
pub struct Subject {
    /// Which wrist
    #[arg(
        long,
        value_enum,
        value_name = "NAME",
        default_value = "parallel-actuators"
    )]
    pub architecture: Architecture,
    /// Angles in degrees, in and out
    #[arg(long)]
    pub degrees: bool,
    /// Write one JSON object (keys below)
    #[arg(long)]
    pub json: bool,
}

/// What the questions have in common that the firmware's kernel can answer.
#[derive(Clone, Copy, Debug, Args)]
pub struct Common {
    #[command(flatten)]
    pub subject: Subject,
    /// Who answers [default: fixed where it can, else f64]
    #[arg(long, value_enum, value_name = "KERNEL")]
    pub kernel: Option<Kernel>,
}

/// A pose; angles that are left out are home's.
#[derive(Clone, Copy, Debug, Args)]
pub struct PoseArguments {
    /// Lateral bending, about x
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number, conflicts_with_all = ["theta3", "phi", "psi"])]
    pub yaw: Option<f64>,
    /// Dorsoventral bending, about the yawed y
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number, conflicts_with_all = ["theta3", "phi", "psi"])]
    pub pitch: Option<f64>,
    /// Torsion, about the yawed and pitched z
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number, conflicts_with_all = ["theta3", "phi", "psi"])]
    pub roll: Option<f64>,
    /// The paper's first angle, about z; home has π/4
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number)]
    pub theta3: Option<f64>,
    /// The paper's second angle, about y', within ±π/2
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number)]
    pub phi: Option<f64>,
    /// The paper's third angle, about x''
    #[arg(long, value_name = "ANGLE", allow_hyphen_values = true, value_parser = number)]
    pub psi: Option<f64>,
}

/// A question at a pose.
#[derive(Debug, Args)]
pub struct At {
    #[command(flatten)]
    pub common: Common,
    #[command(flatten)]
    pub pose: PoseArguments,
}

#[derive(Debug, Args)]
pub struct Ik {
    #[command(flatten)]
    pub at: At,
    /// Which inverse solution: signs of (l×r)·i on legs 1 and 2, one of ++, +-, -+, --
    #[arg(long, value_name = "SIGNS", default_value = "++", allow_hyphen_values = true, value_parser = working_mode)]
    pub working_mode: WorkingMode,
    /// All four solutions too
    #[arg(long)]
    pub all: bool,
}

#[derive(Debug, Args)]
pub struct Fk {
    #[command(flatten)]
    pub common: Common,
    /// The three motor angles, as in 0.1,0.2,0.785
    #[arg(long, value_name = "A,B,C", required = true, value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub theta: Vec<f64>,
    /// Which direct solution: home, other-psi, other-phi, other-both
    #[arg(long, value_name = "MODE", default_value = "home", value_parser = assembly_mode)]
    pub assembly_mode: AssemblyMode,
    /// All solutions too (--json always has them)
    #[arg(long)]
    pub all: bool,
}

#[derive(Debug, Args)]
pub struct Torque {
    #[command(flatten)]
    pub at: At,
    /// The moment on the platform about x (yaw), y (pitch), z (roll), in N·m
    #[arg(long, value_name = "X,Y,Z", required = true, value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub moment: Vec<f64>,
    /// Torque bounds in N·m: LOW,HIGH for all motors, or three such pairs; LOW ≤ 0 ≤ HIGH
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub limits: Vec<f64>,
    /// What gives way when a motor runs out
    #[arg(long, value_enum, value_name = "POLICY", default_value = "yaw-first")]
    pub policy: Policy,
}

/// What gives way when a motor runs out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Policy {
    /// Roll before pitch before yaw: each gets the largest fraction that the motors still allow
    YawFirst,
    /// All three by one fraction: the moment keeps its direction
    KeepDirection,
}

/// What a map shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// The least margin: 1 at home, 0 at a singularity
    Margin,
    /// The least of the three serial margins
    Serial,
    /// The parallel margin, det A over home's
    Parallel,
    /// The inverse condition number of the rate map B⁻¹A
    Isotropy,
    /// The inverse condition number of A
    IsotropyOfA,
    /// The condition number of the rate map B⁻¹A
    Condition,
    /// The condition number of A
    ConditionOfA,
    /// Manipulability of the velocity map A⁻¹B, √det(J Jᵀ)
    Manipulability,
}

#[derive(Debug, Args)]
pub struct Workspace {
    #[command(flatten)]
    pub subject: Subject,
    /// The roll at which yaw and pitch are mapped
    #[arg(long, value_name = "ANGLE", default_value = "0", allow_hyphen_values = true, value_parser = number)]
    pub roll: f64,
    /// Yaw from LOW to HIGH, or one number for both sides [default: ±75°]
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub yaw_range: Vec<f64>,
    /// Pitch from LOW to HIGH, or one number for both sides, within ±90° [default: ±50°]
    #[arg(long, value_name = "LOW,HIGH", value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub pitch_range: Vec<f64>,
    /// What is mapped, a panel each
    #[arg(
        long,
        value_enum,
        value_name = "MEASURE",
        value_delimiter = ',',
        default_value = "margin,isotropy"
    )]
    pub of: Vec<Measure>,
    /// Cells of the grid along each axis
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(4..=2000))]
    pub cells: u32,
    /// Where the SVG goes, - for the terminal [default: workspace.svg]
    #[arg(long, value_name = "FILE")]
    pub out: Option<String>,
}

/// A figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Figure {
    /// The first two architectures, parallel axes and orthogonal axes, at home
    #[value(name = "4")]
    Four,
    /// The prototype, with parallel actuators, at home
    #[value(name = "10")]
    Ten,
    /// The four direct solutions for theta = (0.1, 0.2, π/4)
    #[value(name = "12")]
    Twelve,
    /// The four inverse solutions for (theta3, phi, psi) = (π/4, π/12, π/12)
    #[value(name = "13")]
    Thirteen,
}

#[derive(Debug, Args)]
pub struct Draw {
    #[command(flatten)]
    pub subject: Subject,
    #[command(flatten)]
    pub pose: PoseArguments,
    /// Three motor angles instead of a pose, as in 0.1,0.2,0.785
    #[arg(long, value_name = "A,B,C", value_delimiter = ',', allow_hyphen_values = true, value_parser = number, conflicts_with_all = ["yaw", "pitch", "roll", "theta3", "phi", "psi", "working_mode"])]
    pub theta: Vec<f64>,
    /// Which inverse solution of a pose: one of ++, +-, -+, --
    #[arg(long, value_name = "SIGNS", default_value = "++", allow_hyphen_values = true, value_parser = working_mode)]
    pub working_mode: WorkingMode,
    /// Which direct solution for --theta: home, other-psi, other-phi, other-both
    #[arg(long, value_name = "MODE", default_value = "home", value_parser = assembly_mode, requires = "theta")]
    pub assembly_mode: AssemblyMode,
    /// All solutions, a panel each
    #[arg(long, conflicts_with_all = ["working_mode", "assembly_mode"])]
    pub all: bool,
    /// A figure of the paper
    #[arg(long, value_enum, value_name = "NUMBER", conflicts_with_all = ["architecture", "yaw", "pitch", "roll", "theta3", "phi", "psi", "theta", "all", "working_mode", "assembly_mode"])]
    pub figure: Option<Figure>,
    /// Where the SVG goes, - for the terminal [default: wrist.svg]
    #[arg(long, value_name = "FILE")]
    pub out: Option<String>,
}

#[derive(Debug, Args)]
pub struct Paper {
    /// Write a JSON array of claims: source, claim, printed, computed, verdict, erratum
    #[arg(long)]
    pub json: bool,
}

fn number(text: &str) -> Result<f64, String> {
    let number = text
        .trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.abs() <= 1e6);
    number.ok_or_else(|| "expected a number within ±1000000, such as 0.25 or -1e-3".to_owned())
}

fn working_mode(text: &str) -> Result<WorkingMode, String> {
    let mut all = WorkingMode::ALL.into_iter();
    let found = all.find(|mode| mode.name() == text);
    found.ok_or_else(|| {
        "expected the signs of (l×r)·i on legs 1 and 2: ++ (home), +-, -+ or --".to_owned()
    })
}

fn assembly_mode(text: &str) -> Result<AssemblyMode, String> {
    let mut all = AssemblyMode::ALL.into_iter();
    let found = all.find(|mode| mode.name() == text);
    found.ok_or_else(|| {
        let names = AssemblyMode::ALL.map(AssemblyMode::name);
        format!("expected one of {}", names.join(", "))
    })
}

impl Architecture {
    /// Returns its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::ParallelAxes => "parallel-axes",
            Self::OrthogonalAxes => "orthogonal-axes",
            Self::ParallelActuators => "parallel-actuators",
        }
    }

    /// Returns the paper's geometry.
    pub const fn geometry(self) -> Geometry {
        match self {
            Self::ParallelAxes => Geometry::PARALLEL_AXES,
            Self::OrthogonalAxes => Geometry::ORTHOGONAL_AXES,
            Self::ParallelActuators => Geometry::PARALLEL_ACTUATORS,
        }
    }
}

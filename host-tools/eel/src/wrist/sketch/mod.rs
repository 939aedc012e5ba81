//! `eel wrist draw`: the mechanism in a pose, in all its solutions, or as a figure of the paper.

mod labels;
mod order;
mod panel;
mod scene;
mod view;

use std::f64::consts::{FRAC_PI_4, PI};
use std::io::Write;

use anyhow::Result;
use eel_kinematics::design::{self, AssemblyMode, Geometry, Matrix3, WorkingMode};
use serde::Serialize;

use super::args::{Architecture, Draw, Figure};
use super::direct::{Platform, is_joined, no_platform, phi_psi};
use super::number::{Unit, signed};
use super::place::Place;
use super::{check_out, deliver, refused};
use panel::Panel;
use scene::{Points, Scene};

/// Where the drawing goes if nothing is said.
const OUT: &str = "wrist.svg";

/// A configuration to draw.
struct Configuration {
    architecture: Architecture,
    rotation: Matrix3<f64>,
    theta: [f64; 3],
    /// What it is called in its caption.
    mode: String,
}

/// What is drawn: a title, what the panels have in common, the panels.
struct Drawing {
    title: String,
    subtitle: String,
    configurations: Vec<Configuration>,
}

#[derive(Serialize)]
struct Answer {
    unit: &'static str,
    title: String,
    panels: Vec<PanelAnswer>,
}

#[derive(Serialize)]
struct PanelAnswer {
    architecture: Architecture,
    working_mode: Option<&'static str>,
    assembly_mode: Option<&'static str>,
    theta: [f64; 3],
    #[serde(flatten)]
    platform: Platform,
    points: PointsAnswer,
}

/// Points in arms, in the base frame.
#[derive(Serialize)]
struct PointsAnswer {
    a: [[f64; 3]; 2],
    b: [[f64; 3]; 2],
    c: [[f64; 3]; 2],
}

/// Answers `eel wrist draw`.
pub fn run(out: &mut dyn Write, asked: &Draw) -> Result<()> {
    let subject = &asked.subject;
    let unit = Unit::of(subject);
    check_out(subject.json, asked.out.as_deref())?;
    let drawing = match (asked.figure, &asked.theta[..]) {
        (Some(figure), _) => figures(figure, unit),
        (None, []) => at_pose(asked, unit)?,
        (None, theta) => at_theta(asked, theta, unit)?,
    };
    if subject.json {
        write_json(out, &drawing, unit)?;
        if asked.out.is_none() {
            return Ok(());
        }
    }
    let panels: Vec<Panel> = drawing
        .configurations
        .iter()
        .map(|one| one.panel(unit))
        .collect();
    let text = panel::draw(&drawing.title, &drawing.subtitle, &panels);
    let target = asked.out.as_deref().unwrap_or(OUT);
    match deliver(out, target, &text)? {
        Some(line) if !subject.json => Ok(writeln!(out, "{}\n  {line}", drawing.title)?),
        _ => Ok(()),
    }
}

/// A pose in one working mode, or in all four.
fn at_pose(asked: &Draw, unit: Unit) -> Result<Drawing> {
    let architecture = asked.subject.architecture;
    let place = Place::find_in(asked.working_mode, &asked.subject, &asked.pose, unit)?;
    let [yaw, pitch, roll] = unit.show(place.pose).map(|angle| short(angle, unit));
    let subtitle = format!("yaw {yaw}, pitch {pitch}, roll {roll} {}", unit.name);
    if asked.all {
        return Ok(Drawing {
            title: title(architecture, "four inverse solutions"),
            subtitle,
            configurations: inverse_solutions(architecture, &place.rotation, &place.solutions),
        });
    }
    Ok(Drawing {
        title: title(architecture, ""),
        subtitle,
        configurations: vec![Configuration {
            architecture,
            rotation: place.rotation,
            theta: place.theta,
            mode: format!("working mode {}", asked.working_mode.name()),
        }],
    })
}

/// Motor angles in one assembly mode, or in all that exist.
fn at_theta(asked: &Draw, theta: &[f64], unit: Unit) -> Result<Drawing> {
    let architecture = asked.subject.architecture;
    let Ok([a, b, c]) = <[f64; 3]>::try_from(theta) else {
        return Err(refused(format!(
            "--theta takes three angles, as in --theta 0.1,0.2,0.785; {} came",
            theta.len()
        )));
    };
    let theta = [unit.read(a)?, unit.read(b)?, unit.read(c)?];
    let all = direct_solutions(architecture, &theta);
    let subtitle = format!("θ = ({}) {}", angles(&theta, unit), unit.name);
    if all.is_empty() {
        return Err(refused(
            "no platform joins these motor angles; bring theta nearer to home, (0, 0, π/4) rad (angles are \
             in radians without --degrees)",
        ));
    }
    if asked.all {
        let counts = ["no", "one", "two", "three", "four"];
        let count = counts.get(all.len()).copied().unwrap_or("all");
        return Ok(Drawing {
            title: title(architecture, &format!("{count} direct solutions")),
            subtitle,
            configurations: all,
        });
    }
    let mode = asked.assembly_mode;
    let exists = is_joined(&architecture.geometry(), mode, &theta);
    let Some(one) = all.iter().position(|one| exists && one.mode == mode.name()) else {
        return Err(no_platform(mode, all.iter().map(|one| one.mode.as_str())));
    };
    let one = all.into_iter().nth(one).into_iter().collect();
    Ok(Drawing {
        title: title(architecture, ""),
        subtitle,
        configurations: one,
    })
}

/// The paper's figures.
fn figures(figure: Figure, unit: Unit) -> Drawing {
    let prototype = Architecture::ParallelActuators;
    let home = design::rotation(0.0, 0.0, 0.0);
    let at_home = |architecture: Architecture| Configuration {
        architecture,
        rotation: home,
        theta: [0.0, 0.0, FRAC_PI_4],
        mode: words(architecture),
    };
    match figure {
        Figure::Four => Drawing {
            title: "Fig. 4: parallel axes and orthogonal axes at home".to_owned(),
            subtitle: "A Aᵀ = 1 and B = 1: the wrist is isotropic".to_owned(),
            configurations: vec![
                at_home(Architecture::ParallelAxes),
                at_home(Architecture::OrthogonalAxes),
            ],
        },
        Figure::Ten => Drawing {
            title: "Fig. 10: the prototype, with parallel actuators, at home".to_owned(),
            subtitle: "A Aᵀ = 1, and the motors of legs 1 and 2 are geared by √½".to_owned(),
            configurations: vec![at_home(prototype)],
        },
        Figure::Twelve => {
            let theta = [0.1, 0.2, FRAC_PI_4];
            Drawing {
                title: "Fig. 12: the four direct solutions of the prototype".to_owned(),
                subtitle: format!("θ = ({}) {}", angles(&theta, unit), unit.name),
                configurations: direct_solutions(prototype, &theta),
            }
        }
        Figure::Thirteen => {
            let platform = [FRAC_PI_4, PI / 12.0, PI / 12.0];
            let rotation = design::rotation_from_platform(platform[0], platform[1], platform[2]);
            let solutions = prototype.geometry().inverse_all(&rotation);
            let solutions = solutions.unwrap_or_default();
            Drawing {
                title: "Fig. 13: the four inverse solutions of the prototype".to_owned(),
                subtitle: format!("(θ₃, φ, ψ) = ({}) {}", angles(&platform, unit), unit.name),
                configurations: inverse_solutions(prototype, &rotation, &solutions),
            }
        }
    }
}

fn inverse_solutions(
    architecture: Architecture,
    rotation: &Matrix3<f64>,
    solutions: &[[f64; 3]; 4],
) -> Vec<Configuration> {
    let all = WorkingMode::ALL.into_iter().zip(solutions);
    all.map(|(mode, theta)| Configuration {
        architecture,
        rotation: *rotation,
        theta: *theta,
        mode: format!("working mode {}", mode.name()),
    })
    .collect()
}

fn direct_solutions(architecture: Architecture, theta: &[f64; 3]) -> Vec<Configuration> {
    let found = architecture.geometry().direct_all(theta);
    let all = AssemblyMode::ALL.into_iter().zip(found);
    all.filter_map(|(mode, rotation)| {
        Some(Configuration {
            architecture,
            rotation: rotation?,
            theta: *theta,
            mode: mode.name().to_owned(),
        })
    })
    .collect()
}

impl Configuration {
    fn geometry(&self) -> Geometry {
        self.architecture.geometry()
    }

    /// Returns the panel: the mechanism and its numbers.
    fn panel(&self, unit: Unit) -> Panel {
        let geometry = self.geometry();
        let jacobians = geometry.jacobians(&self.rotation, &self.theta);
        let [phi, psi] = phi_psi(&self.rotation, self.theta[2]);
        let b: Vec<String> = jacobians.b.iter().map(|b| signed(*b, 4)).collect();
        let lines = vec![
            format!("θ = ({}) {}", angles(&self.theta, unit), unit.name),
            format!(
                "φ = {}, ψ = {} {}",
                angles(&[phi], unit),
                angles(&[psi], unit),
                unit.name
            ),
            format!(
                "det A = {}, b = ({})",
                signed(jacobians.det_a(), 4),
                b.join(", ")
            ),
        ];
        Panel {
            scene: Scene::new(&geometry, &self.rotation, &self.theta),
            mode: self.mode.clone(),
            lines,
        }
    }
}

fn write_json(out: &mut dyn Write, drawing: &Drawing, unit: Unit) -> Result<()> {
    let panels = drawing.configurations.iter().map(|one| {
        let geometry = one.geometry();
        let det_a = geometry.jacobians(&one.rotation, &one.theta).det_a();
        let platform = Platform::of(&one.rotation, one.theta[2], det_a);
        let points = Points::of(&geometry, &one.rotation, &one.theta);
        let working = geometry.working_mode(&one.rotation, &one.theta);
        let assembly = geometry.assembly_mode(&one.rotation, &one.theta);
        PanelAnswer {
            architecture: one.architecture,
            working_mode: working.map(WorkingMode::name),
            assembly_mode: assembly.map(AssemblyMode::name),
            theta: unit.show(one.theta),
            platform: platform.in_unit(unit),
            points: PointsAnswer {
                a: points.a.map(Into::into),
                b: points.b.map(Into::into),
                c: points.c.map(Into::into),
            },
        }
    });
    let answer = Answer {
        unit: unit.name,
        title: drawing.title.clone(),
        panels: panels.collect(),
    };
    serde_json::to_writer(&mut *out, &answer)?;
    Ok(writeln!(out)?)
}

/// Returns the architecture's name in words.
fn words(architecture: Architecture) -> String {
    architecture.name().replace('-', " ")
}

fn title(architecture: Architecture, what: &str) -> String {
    let name = words(architecture);
    if what.is_empty() {
        format!("The wrist with {name}")
    } else {
        format!("The wrist with {name}: {what}")
    }
}

/// Returns angles in rad as the caption has them.
fn angles(radians: &[f64], unit: Unit) -> String {
    let shown = radians
        .iter()
        .map(|angle| short(unit.show([*angle])[0], unit));
    shown.collect::<Vec<_>>().join(", ")
}

/// Returns an angle in its unit: a millionth of a radian, a ten thousandth of a degree.
fn short(angle: f64, unit: Unit) -> String {
    signed(angle, if unit.name == "deg" { 4 } else { 6 })
}

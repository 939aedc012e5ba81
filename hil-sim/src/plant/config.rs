//! What the eel and its water are made of.

use eel_kinematics::design::Geometry;

use super::transmission::Transmission;

/// The shape, the water, the motors and the simulation step of one eel.
///
/// The default is the prototype eel: ten joints every 0.1 m from 0.3 m to 1.2 m, 1.5 m long,
/// neutrally buoyant, in fresh water at rest; with two small fins at the tail and its mass 5 mm
/// low. Without these, [`Config::bare`], nothing holds pitch and roll: on paper the bare eel swims
/// straight, but any tilt against its path grows by a factor of about 16 in 4 s (the Munk moment of
/// a body that ends in a vertical edge).
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// Time that one step advances, s.
    pub step_s: f64,
    /// Outline of the eel.
    pub shape: Shape,
    /// The water around it; `None` for the dry chain of bodies.
    pub water: Option<Water>,
    /// Acceleration of gravity towards −x, m/s².
    pub gravity_m_s2: f64,
    /// Mean density of the eel, kg/m³.
    pub density_kg_m3: f64,
    /// How far the centre of mass of each body lies below its centre of buoyancy, m.
    pub centre_of_mass_drop_m: f64,
    /// An extra mass of no volume.
    pub ballast: Option<Ballast>,
    /// Whether the joints are rigid: the whole eel is then one body.
    pub locked: bool,
    /// Strips a body over which the drag is summed.
    pub strips_per_body: usize,
    /// How the motors move a joint.
    pub transmission: Transmission,
    /// Motors, gears and bridges.
    pub motor: Motor,
    /// Hard stops of every joint, either side: yaw, pitch, roll, rad.
    pub stops_rad: [f64; 3],
    /// Stiffness of a stop, N·m/rad.
    pub stop_stiffness: f64,
    /// Damping of a stop, N·m·s/rad.
    pub stop_damping: f64,
    /// Battery voltage without load, V.
    pub supply_v: f64,
    /// Resistance of battery and cable, Ω.
    pub supply_resistance_ohm: f64,
}

/// Half axes of the elliptic sections along the body, m; x is vertical, y is lateral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Length of the eel.
    pub length_m: f64,
    /// Lateral half axis of the trunk.
    pub lateral_m: f64,
    /// Vertical half axis of the trunk.
    pub vertical_m: f64,
    /// Length of the nose, half an ellipsoid.
    pub nose_m: f64,
    /// Length over which the tail tapers linearly.
    pub tail_m: f64,
    /// Lateral half axis at the trailing edge.
    pub edge_lateral_m: f64,
    /// Vertical half axis at the trailing edge.
    pub edge_vertical_m: f64,
    /// Half span of the horizontal fins at the trailing edge; no wider than the tail for none.
    pub fin_m: f64,
    /// Length over which the fins grow from nothing.
    pub fin_length_m: f64,
    /// Distance of the first joint from the nose.
    pub first_joint_m: f64,
    /// Distance between joints.
    pub joint_pitch_m: f64,
}

/// Density of the water and its drag coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Water {
    /// Density, kg/m³.
    pub density_kg_m3: f64,
    /// Drag coefficient of cross flow, over the frontal area of the strip.
    pub cross_drag: f64,
    /// Friction coefficient of the skin, over the wetted area.
    pub skin_friction: f64,
    /// Velocity of the stream, m/s, in the world frame.
    pub stream_m_s: [f64; 3],
}

/// A mass fixed to one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ballast {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Body that carries it, 0 (head) to 10 (tail).
    pub body: usize,
    /// Where it sits in the body's frame, m.
    pub position_m: [f64; 3],
}

/// One brushed motor with its gear and bridge; every figure at the output of the gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Torque constant, N·m/A, and back-EMF constant, V·s/rad.
    pub constant: f64,
    /// Winding resistance, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance, H.
    pub inductance_h: f64,
    /// Rotor inertia, kg·m².
    pub inertia: f64,
    /// Coulomb friction, N·m.
    pub coulomb_nm: f64,
    /// Speed below which the Coulomb friction is viscous, rad/s.
    pub coulomb_speed: f64,
    /// Viscous friction, N·m·s/rad.
    pub viscous: f64,
    /// Current at which the bridge limits, A.
    pub current_limit_a: f64,
    /// Encoder counts a turn of the output.
    pub counts_per_turn: f64,
    /// Thermal resistance from winding to housing, K/W.
    pub winding_k_per_w: f64,
    /// Thermal resistance from housing to the water, K/W.
    pub housing_k_per_w: f64,
    /// Heat capacity of the winding, J/K.
    pub winding_j_per_k: f64,
    /// Heat capacity of the housing, J/K.
    pub housing_j_per_k: f64,
    /// Temperature of everything at the start, and of the water, °C.
    pub ambient_c: f64,
}

impl Default for Config {
    fn default() -> Self {
        // The paper's workspace, ±30°, ±15°, ±4°, with 15 % of margin.
        let stop = |degrees: f64| 1.15 * degrees * std::f64::consts::PI / 180.0;
        Self {
            step_s: 0.5e-3,
            shape: Shape::default(),
            water: Some(Water::default()),
            gravity_m_s2: 9.81,
            density_kg_m3: 1000.0,
            centre_of_mass_drop_m: 0.005,
            ballast: None,
            locked: false,
            strips_per_body: 5,
            transmission: Transmission::Wrist(Geometry::PARALLEL_ACTUATORS),
            motor: Motor::default(),
            stops_rad: [stop(30.0), stop(15.0), stop(4.0)],
            stop_stiffness: 2000.0,
            stop_damping: 20.0,
            supply_v: 24.0,
            supply_resistance_ohm: 0.05,
        }
    }
}

impl Config {
    /// Returns the prototype without fins and with its mass in the middle, for comparison with
    /// formulas and with figures of swims in the plane.
    pub fn bare() -> Self {
        let mut config = Self {
            centre_of_mass_drop_m: 0.0,
            ..Self::default()
        };
        config.shape.fin_m = 0.0;
        config
    }
}

impl Default for Shape {
    fn default() -> Self {
        Self {
            length_m: 1.5,
            lateral_m: 0.050,
            vertical_m: 0.075,
            nose_m: 0.25,
            tail_m: 0.25,
            edge_lateral_m: 0.004,
            edge_vertical_m: 0.045,
            fin_m: 0.05,
            fin_length_m: 0.10,
            first_joint_m: 0.30,
            joint_pitch_m: 0.10,
        }
    }
}

impl Shape {
    /// Returns the lateral and the vertical half axis, m, at a distance `s` from the nose.
    pub fn half_axes(&self, s: f64) -> (f64, f64) {
        let tail_start = self.length_m - self.tail_m;
        if s < self.nose_m {
            let back = 1.0 - s / self.nose_m;
            let share = libm::sqrt((1.0 - back * back).max(0.0));
            (self.lateral_m * share, self.vertical_m * share)
        } else if s > tail_start {
            let share = (s - tail_start) / self.tail_m;
            (
                self.lateral_m + (self.edge_lateral_m - self.lateral_m) * share,
                self.vertical_m + (self.edge_vertical_m - self.vertical_m) * share,
            )
        } else {
            (self.lateral_m, self.vertical_m)
        }
    }

    /// Returns the lateral half span, m, that vertical flow meets at a distance `s` from the nose:
    /// that of the body or of the fins, whichever is wider.
    pub fn half_span(&self, s: f64) -> f64 {
        let share = 1.0 - (self.length_m - s) / self.fin_length_m;
        self.half_axes(s).0.max(self.fin_m * share)
    }

    /// Returns the distance from the nose, m, at which body `body` begins, 0 (head) to 11 (the
    /// trailing edge).
    pub fn body_start(&self, body: usize) -> f64 {
        match body {
            0 => 0.0,
            1..=10 => self.first_joint_m + self.joint_pitch_m * (body - 1) as f64,
            _ => self.length_m,
        }
    }
}

impl Default for Water {
    fn default() -> Self {
        Self {
            density_kg_m3: 1000.0,
            cross_drag: 1.1,
            skin_friction: 0.008,
            stream_m_s: [0.0; 3],
        }
    }
}

impl Default for Motor {
    /// A 24 V motor of the 26 mm class with a 43:1 gear; the thermal figures are of the size that catalogues
    /// give for such motors (winding about 12 s, housing about 10 min).
    fn default() -> Self {
        Self {
            constant: 1.488,
            resistance_ohm: 5.8,
            inductance_h: 0.55e-3,
            inertia: 2.03e-3,
            coulomb_nm: 0.06,
            coulomb_speed: 0.005,
            viscous: 0.02,
            current_limit_a: 2.5,
            counts_per_turn: 88_064.0,
            winding_k_per_w: 3.1,
            housing_k_per_w: 13.0,
            winding_j_per_k: 4.0,
            housing_j_per_k: 46.0,
            ambient_c: 15.0,
        }
    }
}

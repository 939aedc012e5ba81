//! What a vertebra is told about itself: gains, limits, motors, geometry.
//!
//! Settings never change while the drives are on; what changes every tick lives elsewhere.

use eel_kinematics::{Pose, Wrist};
use eel_protocol::NodeId;
use eel_protocol::dictionary::Field;
use eel_units::{Angle, AngularVelocity, Current, Temperature, Torque, Voltage};

use crate::calibration::{Calibration, Senses};
use crate::current::{INDUCTANCES, RESISTANCES, TORQUE_CONSTANTS};
use crate::objects::microradians;

/// Everything that is set for one vertebra.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Its place in the chain, until LSS stores another; without one it only listens to LSS.
    pub node: Option<NodeId>,
    /// The unique number of its microcontroller, object 0x1018:4.
    pub serial: u32,
    /// What its board calls itself, object 0x1009.
    pub hardware: &'static str,
    /// Its wrist.
    pub wrist: Wrist,
    /// How it answers to deviations.
    pub gains: Gains,
    /// What it never exceeds.
    pub limits: Limits,
    /// What its motors are.
    pub motor: Motor,
    /// How its motors and encoders are built in.
    pub calibration: Calibration,
}

/// The impedance of the wrist about the base axes x (yaw), y (pitch), z (roll).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gains {
    /// In mN·m/rad.
    pub stiffness: [u32; 3],
    /// In mN·m·s/rad.
    pub damping: [u32; 3],
}

/// Bounds that hold whatever the head asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Most torque of one motor, both ways.
    pub peak_torque: Torque,
    /// Largest yaw, pitch and roll, both ways.
    pub workspace: Pose,
    /// Fastest change of yaw, pitch or roll.
    pub rate: AngularVelocity,
    /// Travel of each motor: beyond it only torque that leads back.
    pub travel: [Travel; 3],
    /// Torque allowed while damped on request.
    pub damped_torque: Torque,
    /// Supply below which torque ramps down, and at which it is a fault.
    pub supply_low: Ramp<Voltage>,
    /// Supply above which torque ramps down, and at which it is a fault.
    pub supply_high: Ramp<Voltage>,
    /// Board temperature above which torque ramps down, and at which it is a fault.
    pub board_hot: Ramp<Temperature>,
    /// Motor housing temperature above which torque ramps down, and at which it is a fault.
    pub motor_hot: Ramp<Temperature>,
}

/// The angles between which a motor may drive freely.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Travel {
    /// The low end.
    pub low: Angle,
    /// The high end.
    pub high: Angle,
}

/// Where a derating starts and where nothing is left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ramp<T> {
    /// Full torque up to here.
    pub start: T,
    /// No torque, and a fault, from here.
    pub end: T,
}

/// The constants of a motor with its gear, seen from the crank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motor {
    /// Torque per current, µN·m/A, which is also the back-EMF in µV·s/rad.
    pub torque_constant: u32,
    /// Resistance of winding and bridge in mΩ.
    pub resistance: u32,
    /// Inductance of the winding in µH.
    pub inductance: u32,
    /// Friction of motor and gear.
    pub friction: Friction,
    /// How it warms.
    pub thermal: ThermalData,
    /// Quadrature counts per turn of the crank.
    pub counts_per_turn: u32,
    /// Most current of the bridge.
    pub current_limit: Current,
    /// Fastest believable speed of the crank.
    pub speed_limit: AngularVelocity,
}

/// What a crank needs to turn without a load: the controller adds it along the reference's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Friction {
    /// Coulomb friction.
    pub coulomb: Torque,
    /// Viscous friction in mN·m·s/rad.
    pub viscous: u32,
    /// Speed of the reference from which on the Coulomb friction is whole; below, in proportion.
    pub speed: AngularVelocity,
}

/// Winding and housing of a motor as two heat capacities on the way to the water.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ThermalData {
    /// Thermal resistance from winding to housing, mK/W.
    pub winding_resistance: u32,
    /// Thermal resistance from housing to the water, mK/W.
    pub housing_resistance: u32,
    /// Heat capacity of the winding, mJ/K.
    pub winding_capacity: u32,
    /// Heat capacity of the housing, mJ/K.
    pub housing_capacity: u32,
    /// Temperature at which the current is held so that the winding stays there.
    pub winding_limit: Temperature,
    /// Temperature of the water, where the thermistor of the housing fails.
    pub ambient: Temperature,
}

impl Settings {
    /// Returns the settings of a prototype that was built in without a fault, for the vertebra `node` with
    /// the board `serial`. A board of which nothing is known yet has [`Calibration::NONE`].
    pub const fn prototype(node: NodeId, serial: u32) -> Self {
        let mut settings = Self::unconfigured(serial);
        settings.node = Some(node);
        settings
    }

    /// Returns the settings of a prototype that knows no place in the chain.
    pub const fn unconfigured(serial: u32) -> Self {
        Self {
            node: None,
            serial,
            hardware: "prototype",
            wrist: Wrist::PAPER,
            gains: Gains::PROTOTYPE,
            limits: Limits::PROTOTYPE,
            motor: Motor::PROTOTYPE,
            calibration: Calibration::ideal(serial),
        }
    }

    /// Tells whether the settings contradict neither themselves nor physics.
    pub fn are_sound(&self) -> bool {
        let Limits {
            workspace,
            travel,
            supply_low,
            supply_high,
            ..
        } = &self.limits;
        let Limits {
            board_hot,
            motor_hot,
            rate,
            damped_torque,
            ..
        } = &self.limits;
        let Motor {
            torque_constant,
            resistance,
            inductance,
            counts_per_turn,
            ..
        } = self.motor;
        let friction = &self.motor.friction;
        let is_in = |value: u32, (least, most): (u32, u32)| (least..=most).contains(&value);
        let positive = [workspace.yaw, workspace.pitch, workspace.roll]
            .into_iter()
            .all(|range| range > Angle::ZERO && range < Angle::FRAC_PI_2);
        positive
            && travel.iter().all(|travel| travel.low < travel.high)
            && self.limits.peak_torque > Torque::ZERO
            && supply_low.end < supply_low.start
            && supply_low.start < supply_high.start
            && supply_high.start < supply_high.end
            && board_hot.start < board_hot.end
            && motor_hot.start < motor_hot.end
            && *rate > AngularVelocity::ZERO
            && *damped_torque >= Torque::ZERO
            && is_in(torque_constant, TORQUE_CONSTANTS)
            && is_in(resistance, RESISTANCES)
            && is_in(inductance, INDUCTANCES)
            && friction.coulomb >= Torque::ZERO
            && friction.speed > AngularVelocity::ZERO
            && self.motor.thermal.winding_capacity > 0
            && self.motor.thermal.housing_capacity > 0
            && self.motor.thermal.ambient < self.motor.thermal.winding_limit
            && counts_per_turn > 0
            && self.motor.current_limit > Current::ZERO
            && self.motor.speed_limit > AngularVelocity::ZERO
    }
}

/// The settings as the entries of the dictionary that may be written and stored.
impl Settings {
    /// Returns the raw number of a setting; `None` for any other field.
    #[inline(never)] // One copy in flash.
    pub(crate) fn value(&self, field: Field) -> Option<i64> {
        let (gains, limits) = (&self.gains, &self.limits);
        let [stiffness_x, stiffness_y, stiffness_z] = gains.stiffness.map(i64::from);
        let [damping_x, damping_y, damping_z] = gains.damping.map(i64::from);
        let (friction, thermal) = (&self.motor.friction, &self.motor.thermal);
        let calibration = &self.calibration;
        let angle = |angle: Angle| i64::from(angle.to_tenth_milliradians());
        Some(match field {
            Field::StiffnessX => stiffness_x,
            Field::StiffnessY => stiffness_y,
            Field::StiffnessZ => stiffness_z,
            Field::DampingX => damping_x,
            Field::DampingY => damping_y,
            Field::DampingZ => damping_z,
            Field::PeakTorque => i64::from(limits.peak_torque.to_millinewton_metres()),
            Field::RangeYaw => angle(limits.workspace.yaw),
            Field::RangePitch => angle(limits.workspace.pitch),
            Field::RangeRoll => angle(limits.workspace.roll),
            Field::RateLimit => milliradians_per_second(limits.rate),
            Field::FrictionCoulomb => i64::from(friction.coulomb.to_millinewton_metres()),
            Field::FrictionViscous => i64::from(friction.viscous),
            Field::FrictionSpeed => milliradians_per_second(friction.speed),
            Field::WindingResistance => i64::from(thermal.winding_resistance),
            Field::HousingResistance => i64::from(thermal.housing_resistance),
            Field::WindingCapacity => i64::from(thermal.winding_capacity),
            Field::HousingCapacity => i64::from(thermal.housing_capacity),
            Field::WindingLimit => i64::from(thermal.winding_limit.to_decidegrees()),
            Field::Ambient => i64::from(thermal.ambient.to_decidegrees()),
            Field::CalibrationSerial => i64::from(calibration.serial),
            Field::Zero1 => microradians(calibration.zero[0]),
            Field::Zero2 => microradians(calibration.zero[1]),
            Field::Zero3 => microradians(calibration.zero[2]),
            Field::Offset1 => i64::from(calibration.offset[0].to_microamps()),
            Field::Offset2 => i64::from(calibration.offset[1].to_microamps()),
            Field::Offset3 => i64::from(calibration.offset[2].to_microamps()),
            Field::Reversed => i64::from(calibration.senses.to_bits()),
            _ => return None,
        })
    }

    /// Writes a setting whose value has been held against its bounds. Tells whether the field is one.
    #[inline(never)] // One copy in flash.
    pub(crate) fn set(&mut self, field: Field, value: i64) -> bool {
        let angle = Angle::from_tenth_milliradians(value as i16);
        let (gains, limits) = (&mut self.gains, &mut self.limits);
        let (friction, thermal) = (&mut self.motor.friction, &mut self.motor.thermal);
        let calibration = &mut self.calibration;
        let reading = Angle::from_microradians(value as i32);
        let offset = Current::from_microamps(value as i32);
        match field {
            Field::StiffnessX => gains.stiffness[0] = value as u32,
            Field::StiffnessY => gains.stiffness[1] = value as u32,
            Field::StiffnessZ => gains.stiffness[2] = value as u32,
            Field::DampingX => gains.damping[0] = value as u32,
            Field::DampingY => gains.damping[1] = value as u32,
            Field::DampingZ => gains.damping[2] = value as u32,
            Field::PeakTorque => {
                limits.peak_torque = Torque::from_millinewton_metres(value as i32);
            }
            Field::RangeYaw => limits.workspace.yaw = angle,
            Field::RangePitch => limits.workspace.pitch = angle,
            Field::RangeRoll => limits.workspace.roll = angle,
            Field::RateLimit => {
                limits.rate = AngularVelocity::from_milliradians_per_second(value as i32);
            }
            Field::FrictionCoulomb => {
                friction.coulomb = Torque::from_millinewton_metres(value as i32);
            }
            Field::FrictionViscous => friction.viscous = value as u32,
            Field::FrictionSpeed => {
                friction.speed = AngularVelocity::from_milliradians_per_second(value as i32);
            }
            Field::WindingResistance => thermal.winding_resistance = value as u32,
            Field::HousingResistance => thermal.housing_resistance = value as u32,
            Field::WindingCapacity => thermal.winding_capacity = value as u32,
            Field::HousingCapacity => thermal.housing_capacity = value as u32,
            Field::WindingLimit => {
                thermal.winding_limit = Temperature::from_decidegrees(value as i32);
            }
            Field::Ambient => thermal.ambient = Temperature::from_decidegrees(value as i32),
            Field::CalibrationSerial => calibration.serial = value as u32,
            Field::Zero1 => calibration.zero[0] = reading,
            Field::Zero2 => calibration.zero[1] = reading,
            Field::Zero3 => calibration.zero[2] = reading,
            Field::Offset1 => calibration.offset[0] = offset,
            Field::Offset2 => calibration.offset[1] = offset,
            Field::Offset3 => calibration.offset[2] = offset,
            Field::Reversed => calibration.senses = Senses::from_bits(value as u16),
            _ => return false,
        }
        true
    }
}

/// Returns a speed in mrad/s, rounded.
fn milliradians_per_second(speed: AngularVelocity) -> i64 {
    (i64::from(speed.to_q24()) * 1_000 + (1 << 23)) >> 24
}

/// Returns the raw number with which a field of the dictionary leaves the factory.
const fn factory(field: Field) -> i64 {
    field.sub().default
}

impl Gains {
    /// The prototype's: stiff enough for half a degree of error at 3.5 N·m.
    pub const PROTOTYPE: Self = Self {
        stiffness: [
            factory(Field::StiffnessX) as u32,
            factory(Field::StiffnessY) as u32,
            factory(Field::StiffnessZ) as u32,
        ],
        damping: [
            factory(Field::DampingX) as u32,
            factory(Field::DampingY) as u32,
            factory(Field::DampingZ) as u32,
        ],
    };
}

impl Limits {
    /// The prototype's: the workspace of the paper, ±30°, ±15°, ±4°.
    pub const PROTOTYPE: Self = Self {
        peak_torque: Torque::from_millinewton_metres(factory(Field::PeakTorque) as i32),
        workspace: Pose {
            yaw: Angle::from_tenth_milliradians(factory(Field::RangeYaw) as i16),
            pitch: Angle::from_tenth_milliradians(factory(Field::RangePitch) as i16),
            roll: Angle::from_tenth_milliradians(factory(Field::RangeRoll) as i16),
        },
        rate: AngularVelocity::from_milliradians_per_second(factory(Field::RateLimit) as i32),
        travel: [
            Travel {
                low: Angle::from_milliradians(-900),
                high: Angle::from_milliradians(900),
            },
            Travel {
                low: Angle::from_milliradians(-900),
                high: Angle::from_milliradians(900),
            },
            Travel {
                low: Angle::from_milliradians(520),
                high: Angle::from_milliradians(1_050),
            },
        ],
        damped_torque: Torque::from_millinewton_metres(1_000),
        supply_low: Ramp {
            start: Voltage::from_millivolts(20_000),
            end: Voltage::from_millivolts(17_000),
        },
        supply_high: Ramp {
            start: Voltage::from_millivolts(28_000),
            end: Voltage::from_millivolts(31_000),
        },
        board_hot: Ramp {
            start: Temperature::from_decidegrees(750),
            end: Temperature::from_decidegrees(900),
        },
        motor_hot: Ramp {
            start: Temperature::from_decidegrees(800),
            end: Temperature::from_decidegrees(1_000),
        },
    };
}

impl Motor {
    /// A 24 V brushed motor of the 26 mm class: 34.6 mN·m/A, 5.8 Ω, 0.55 mH, gear 43:1, 2048 counts a
    /// turn of its shaft.
    pub const PROTOTYPE: Self = Self {
        torque_constant: factory(Field::TorqueConstant) as u32,
        resistance: factory(Field::Resistance) as u32,
        inductance: factory(Field::Inductance) as u32,
        friction: Friction {
            coulomb: Torque::from_millinewton_metres(factory(Field::FrictionCoulomb) as i32),
            viscous: factory(Field::FrictionViscous) as u32,
            speed: AngularVelocity::from_milliradians_per_second(
                factory(Field::FrictionSpeed) as i32
            ),
        },
        thermal: ThermalData {
            winding_resistance: factory(Field::WindingResistance) as u32,
            housing_resistance: factory(Field::HousingResistance) as u32,
            winding_capacity: factory(Field::WindingCapacity) as u32,
            housing_capacity: factory(Field::HousingCapacity) as u32,
            winding_limit: Temperature::from_decidegrees(factory(Field::WindingLimit) as i32),
            ambient: Temperature::from_decidegrees(factory(Field::Ambient) as i32),
        },
        counts_per_turn: 88_064,
        current_limit: Current::from_milliamps(factory(Field::CurrentLimit) as i32),
        speed_limit: AngularVelocity::from_milliradians_per_second(40_000),
    };
}

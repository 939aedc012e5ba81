//! The table itself.

use eel_canopen::Access;

use super::shapes::*;
use super::{DataType, Object, Pdo, Sub};

use Access::{ReadOnly as RO, ReadWrite as RW};
use Pdo::{No as NO, Receive as RX, Transmit as TX};

/// Makes an entry from its shape.
const fn sub(
    field: Field,
    subindex: u8,
    name: &'static str,
    shape: Shape,
    description: &'static str,
) -> Sub {
    let Shape {
        data_type,
        access,
        pdo,
        unit,
        scale,
        default,
        min,
        max,
    } = shape;
    Sub {
        field,
        subindex,
        name,
        data_type,
        access,
        pdo,
        unit,
        scale,
        default,
        min,
        max,
        description,
    }
}

/// Defines the fields, the entries and the records from one list.
macro_rules! records {
    ($($record:ident = $index:literal $name:literal, $meaning:literal {
        $($subindex:literal $field:ident $entry:literal $shape:expr, $description:literal;)*
    })*) => {
        /// Each entry of the dictionary, as the thing that a vertebra serves.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Field {
            $($(#[doc = $description] $field,)*)*
        }

        $(const $record: &[Sub] =
            &[$(sub(Field::$field, $subindex, $entry, $shape, $description),)*];)*

        /// Every record of a vertebra's dictionary, by rising index.
        pub const OBJECTS: &[Object] = &[
            $(Object { index: $index, name: $name, description: $meaning, subs: $record },)*
        ];
    };
}

records! {
    TARGET = 0x2000 "target", "What the head asks of the vertebra; RPDO1." {
        1 TargetYaw "yaw" angle(RW, RX), "Angle about x, swimming, that the vertebra shall take.";
        2 TargetPitch "pitch" angle(RW, RX), "Angle about y, diving, that the vertebra shall take.";
        3 TargetRoll "roll" angle(RW, RX), "Angle about z, torsion, that the vertebra shall take.";
        4 TargetCode "code" byte(RW, RX),
            "Mode in the low four bits, counter 0-14 in the high four.";
        5 TargetCrc "crc" byte(RW, RX),
            "Protection byte over the seven bytes before it and the COB-ID.";
    }
    MOMENT = 0x2001 "moment", "Feed-forward moment and stiffness scale; RPDO2." {
        1 MomentX "x" torque(RW, RX),
            "Moment about x of the base, that is added to the controller's.";
        2 MomentY "y" torque(RW, RX),
            "Moment about y of the base, that is added to the controller's.";
        3 MomentZ "z" torque(RW, RX),
            "Moment about z of the base, that is added to the controller's.";
        4 MomentStiffness "stiffness" STIFFNESS_SCALE,
            "Scale of the configured stiffness: 1 at power-up, 2 at most.";
    }
    MOTOR_TORQUE = 0x2002 "motor_torque",
        "Torques of single motors for commissioning, in mode motor only; 0 whenever the mode begins." {
        1 MotorTorque1 "motor1" torque(RW, RX), "Torque that motor 1 shall produce.";
        2 MotorTorque2 "motor2" torque(RW, RX), "Torque that motor 2 shall produce.";
        3 MotorTorque3 "motor3" torque(RW, RX), "Torque that motor 3 shall produce.";
    }
    POSE = 0x2010 "pose", "What the vertebra does; TPDO1." {
        1 PoseYaw "yaw" angle(RO, TX), "Measured angle about x, swimming.";
        2 PosePitch "pitch" angle(RO, TX), "Measured angle about y, diving.";
        3 PoseRoll "roll" angle(RO, TX), "Measured angle about z, torsion.";
        4 PoseCode "code" byte(RO, TX),
            "State in the low four bits, counter 0-14 in the high four.";
        5 PoseCrc "crc" byte(RO, TX),
            "Protection byte over the seven bytes before it and the COB-ID.";
        6 PoseStatus "status" STATUS,
            "Status word: why enabling is refused, and what is limited.";
    }
    EFFORT = 0x2011 "effort", "Torques of the motors and what bounds them; TPDO2." {
        1 EffortMotor1 "motor1" torque(RO, TX), "Torque of motor 1, from its current.";
        2 EffortMotor2 "motor2" torque(RO, TX), "Torque of motor 2, from its current.";
        3 EffortMotor3 "motor3" torque(RO, TX), "Torque of motor 3, from its current.";
        4 EffortLimits "limits" word(RO, TX),
            "Limit codes of motors 1-3, four bits each, and four flags above.";
    }
    MOTOR = 0x2012 "motor", "Angles of the motors." {
        1 MotorAngle1 "angle1" MICRORADIANS, "Angle of motor 1's crank.";
        2 MotorAngle2 "angle2" MICRORADIANS, "Angle of motor 2's crank.";
        3 MotorAngle3 "angle3" MICRORADIANS,
            "Angle of motor 3, the serial leg; 45 degrees at home.";
    }
    ALLOCATION = 0x2013 "allocation", "What torque sharing could produce of the moment asked for." {
        1 AchievedX "achieved_x" torque(RO, TX), "Moment about x that the motors produce.";
        2 AchievedY "achieved_y" torque(RO, TX), "Moment about y that the motors produce.";
        3 AchievedZ "achieved_z" torque(RO, TX), "Moment about z that the motors produce.";
        4 UnallocatedX "unallocated_x" torque(RO, TX),
            "Moment about x that was asked for and is not produced.";
        5 UnallocatedY "unallocated_y" torque(RO, TX),
            "Moment about y that was asked for and is not produced.";
        6 UnallocatedZ "unallocated_z" torque(RO, TX),
            "Moment about z that was asked for and is not produced.";
    }
    GAINS = 0x2020 "gains",
        "Gains and limits of the controller; may be changed while the wrist is off." {
        1 StiffnessX "stiffness_x" stiffness(400_000), "Stiffness about x, swimming.";
        2 StiffnessY "stiffness_y" stiffness(400_000), "Stiffness about y, diving.";
        3 StiffnessZ "stiffness_z" stiffness(250_000), "Stiffness about z, torsion.";
        4 DampingX "damping_x" damping(4_000), "Damping about x, swimming.";
        5 DampingY "damping_y" damping(4_000), "Damping about y, diving.";
        6 DampingZ "damping_z" damping(3_000), "Damping about z, torsion.";
        7 PeakTorque "peak_torque" PEAK_TORQUE, "Largest torque of each motor.";
        8 RangeYaw "range_yaw" half_range(5_236),
            "Workspace: largest yaw to either side, 30 degrees.";
        9 RangePitch "range_pitch" half_range(2_618),
            "Workspace: largest pitch to either side, 15 degrees.";
        10 RangeRoll "range_roll" half_range(698),
            "Workspace: largest roll to either side, 4 degrees.";
        11 RateLimit "rate_limit" RATE_LIMIT,
            "Fastest change of a target's angle that is followed.";
    }
    GEOMETRY = 0x2021 "geometry", "The wrist that the kinematics are made for." {
        1 Architecture "architecture" ARCHITECTURE,
            "Kind of wrist: 1 parallel axes, 2 orthogonal axes, 3 parallel actuators.";
        2 GeometryScale "scale" SCALE, "Length of the unit mechanism's 1, the rods.";
    }
    CALIBRATION = 0x2022 "calibration",
        "How this vertebra's motors and encoders are built in; may be changed while the wrist is off." {
        1 CalibrationSerial "serial" SERIAL,
            "Serial number of the vertebra that it was made for: 1018:4, or enabling is refused.";
        2 Zero1 "zero1" reading(0), "What crank 1's encoder reads at home.";
        3 Zero2 "zero2" reading(0), "What crank 2's encoder reads at home.";
        4 Zero3 "zero3" reading(785_398), "What crank 3's encoder reads at home.";
        5 Offset1 "offset1" CURRENT_OFFSET, "What motor 1's current sensor reads without a current.";
        6 Offset2 "offset2" CURRENT_OFFSET, "What motor 2's current sensor reads without a current.";
        7 Offset3 "offset3" CURRENT_OFFSET, "What motor 3's current sensor reads without a current.";
        8 Reversed "reversed" SENSES,
            "What counts down as the crank turns up: bits 0-2 the leads of motors 1-3, 3-5 counters, 6-8 crank encoders.";
    }
    MOTOR_SETTINGS = 0x2023 "motor_settings",
        "What the motors are; may be changed while the wrist is off." {
        1 FrictionCoulomb "friction_coulomb" FRICTION,
            "Coulomb friction of a crank, that the controller adds along the reference's motion.";
        2 FrictionViscous "friction_viscous" FRICTION_VISCOUS,
            "Viscous friction of a crank, that the controller adds along the reference's motion.";
        3 FrictionSpeed "friction_speed" FRICTION_SPEED,
            "Speed of a crank from which on its Coulomb friction is added whole.";
        4 WindingResistance "winding_resistance" thermal_resistance(3_100),
            "Thermal resistance from a motor's winding to its housing.";
        5 HousingResistance "housing_resistance" thermal_resistance(13_000),
            "Thermal resistance from a motor's housing to the water.";
        6 WindingCapacity "winding_capacity" heat_capacity(4_000), "Heat capacity of a winding.";
        7 HousingCapacity "housing_capacity" heat_capacity(46_000), "Heat capacity of a housing.";
        8 WindingLimit "winding_limit" limit_temperature(1_050),
            "Temperature at which a winding is held by its current; a fault 10 K above.";
        9 Ambient "ambient" limit_temperature(150),
            "Temperature of the water, where a housing's thermistor fails.";
    }
    HEALTH = 0x2030 "health", "Supply, temperatures and counters." {
        1 Supply "supply" SUPPLY, "Supply voltage of the bridges.";
        2 BoardTemperature "board_temperature" TEMPERATURE, "Temperature of the board.";
        3 MotorTemperature1 "motor1_temperature" TEMPERATURE, "Housing temperature of motor 1.";
        4 MotorTemperature2 "motor2_temperature" TEMPERATURE, "Housing temperature of motor 2.";
        5 MotorTemperature3 "motor3_temperature" TEMPERATURE, "Housing temperature of motor 3.";
        6 BadTargets "bad_targets" COUNT,
            "Targets refused since power-up: wrong protection byte, mode or counter.";
        7 LostTargets "lost_targets" COUNT,
            "Targets missed since power-up, by gaps in their counter.";
        8 ReceiveOverruns "receive_overruns" COUNT,
            "Frames lost since power-up because a receive queue was full.";
        9 TransmitOverruns "transmit_overruns" COUNT,
            "Frames dropped since power-up because a transmit queue was full.";
        10 WindingTemperature1 "winding1_temperature" TEMPERATURE, "Temperature of motor 1's winding, by a model.";
        11 WindingTemperature2 "winding2_temperature" TEMPERATURE, "Temperature of motor 2's winding, by a model.";
        12 WindingTemperature3 "winding3_temperature" TEMPERATURE, "Temperature of motor 3's winding, by a model.";
    }
    MOTOR_CONSTANTS = 0x2031 "motor_constants", "What the current loop's gains follow from, seen from a crank." {
        1 TorqueConstant "torque_constant" motor("N.m/A", 6, 1_488_000),
            "Torque of a crank per current; as much is its back-EMF per speed, in V.s/rad.";
        2 Resistance "resistance" motor("Ohm", 3, 5_800), "Resistance of a winding and its bridge.";
        3 Inductance "inductance" motor("H", 6, 550), "Inductance of a winding.";
        4 CurrentLimit "current_limit" motor("A", 3, 2_500),
            "Most current that a bridge is told; it is switched off at half as much again.";
    }
    TIMING = 0x2040 "timing", "The control loop's time and the beat of the bus." {
        1 LoopLast "loop_last" MICROSECONDS, "Time that the last control tick took.";
        2 LoopMax "loop_max" MICROSECONDS, "Longest time that a control tick took since power-up.";
        3 SyncPhase "sync_phase" SYNC_PHASE,
            "By how much the control tick came too late after the last SYNC, 0.3 ms being right.";
        4 CurrentLoopLast "current_loop_last" NANOSECONDS, "Time that the last turn of the current loop took.";
        5 CurrentLoopMax "current_loop_max" NANOSECONDS,
            "Longest time that a turn of the current loop took since power-up.";
        6 TickTrim "tick_trim" TICK_TRIM, "By how much each tick is made longer to keep its time after SYNC.";
        7 TickLocked "tick_locked" byte(RO, TX),
            "1 while ticks keep their time after SYNC within 0.1 ms, 0 while they do not.";
    }
    SCOPE = 0x2050 "scope", "Captures up to four entries of this dictionary, tick by tick, for 2100:2." {
        1 ScopeChannel1 "channel1" CHANNEL,
            "Entry that channel 1 captures, as a PDO maps it: index, subindex, bits; 0 is none.";
        2 ScopeChannel2 "channel2" CHANNEL, "Entry that channel 2 captures, or 0.";
        3 ScopeChannel3 "channel3" CHANNEL, "Entry that channel 3 captures, or 0.";
        4 ScopeChannel4 "channel4" CHANNEL, "Entry that channel 4 captures, or 0.";
        5 ScopeDivider "divider" DIVIDER, "Control ticks of 1 ms from one sample to the next.";
        6 ScopeTrigger "trigger" TRIGGER,
            "Writing 0 stops, 1 captures until memory is full, 2 captures around the next fault.";
        7 ScopeState "state" byte(RO, NO),
            "What it does: 0 nothing, 1 fills, 2 waits for a fault, 3 captures its end, 4 full.";
        8 ScopeSamples "samples" word(RO, NO), "Samples that 2100:2 holds.";
    }
    PROCEDURE = 0x2060 "procedure", "Calibration step by step, and the self test; only before NMT start." {
        1 ProcedureStep "step" STEP,
            "Writing 1 measures current offsets, 2 takes this pose for home, 3 watches yaw and roll by hand, 4 turns each motor, 5 tests, 0 ends.";
        2 ProcedureProgress "progress" byte(RO, NO),
            "How it goes: 0 nothing was begun, 1 it goes on, 2 done, 3 failed.";
        3 ProcedureReason "reason" byte(RO, NO), "Why it failed, of the list in this document.";
        4 ProcedureMotor "motor" byte(RO, NO), "The motor that something is wrong with, or 0.";
        5 ProcedureChecks "checks" word(RO, NO), "Checks of the self test that were made, a bit each.";
        6 ProcedureFailed "failed" word(RO, NO), "Checks of the self test that failed.";
    }
    CHAIN = 0x2070 "chain", "The line from vertebra to vertebra beside the bus, which tells their order." {
        1 ChainIn "in" byte(RO, TX),
            "1 while IN is high: the vertebra before has a node id, or nothing is connected.";
        2 ChainOut "out" CHAIN_OUT,
            "What OUT does: 0 high once this vertebra has a node id, 1 low, 2 high; 0 after every reset.";
    }
    RECORD = 0x2100 "record", "What was recorded; read as a domain, in the layouts of docs/vertebra.md." {
        1 RecordFreeze "freeze" DOMAIN,
            "Freeze frame: everything at the moment of the last fault or stop.";
        2 RecordScope "scope" DOMAIN, "What the scope captured; reading it ends the capture.";
    }
    LINK = 0x2101 "link", "Test of transfers: what is written is not kept, what is read is a pattern." {
        1 LinkData "data" LINK_DATA,
            "Reads as link.length bytes, byte k being (7k + k/256) mod 256; takes any bytes.";
        2 LinkLength "length" LINK_LENGTH, "Bytes that link.data reads as.";
        3 LinkCrc "crc" raw(DataType::U32, RO, NO),
            "CRC-32/ISO-HDLC, Python's zlib.crc32, of what was last written to link.data.";
    }
}

impl Field {
    /// Returns the entry that the field serves, for its default, bounds and scale.
    pub const fn sub(self) -> &'static Sub {
        let mut place = self as usize;
        let mut objects = OBJECTS;
        while let [object, rest @ ..] = objects {
            if place < object.subs.len() {
                return &object.subs[place];
            }
            place -= object.subs.len();
            objects = rest;
        }
        // Never reached: the check below holds that fields and entries correspond one to one.
        &TARGET[0]
    }
}

/// Returns where in [`OBJECTS`] an index stands, without a search.
pub(super) const fn position(index: u16) -> Option<usize> {
    Some(match index {
        0x2000 => 0,
        0x2001 => 1,
        0x2002 => 2,
        0x2010 => 3,
        0x2011 => 4,
        0x2012 => 5,
        0x2013 => 6,
        0x2020 => 7,
        0x2021 => 8,
        0x2022 => 9,
        0x2023 => 10,
        0x2030 => 11,
        0x2031 => 12,
        0x2040 => 13,
        0x2050 => 14,
        0x2060 => 15,
        0x2070 => 16,
        0x2100 => 17,
        0x2101 => 18,
        _ => return None,
    })
}

/// Checks at compile time what the rest of the crate relies on: rising indices that
/// [`position`] knows, subindices without a gap, fields in the order of the table, and bounds that
/// hold the default and lie within the type.
const _: () = {
    let mut fields = 0;
    let mut o = 0;
    while o < OBJECTS.len() {
        let object = &OBJECTS[o];
        assert!(o == 0 || OBJECTS[o - 1].index < object.index);
        assert!(matches!(position(object.index), Some(place) if place == o));
        assert!(!object.subs.is_empty() && object.subs.len() < 0xFF);
        let mut s = 0;
        while s < object.subs.len() {
            let sub = &object.subs[s];
            let (low, high) = sub.data_type.range();
            assert!(sub.subindex as usize == s + 1);
            assert!(sub.field as usize == fields);
            assert!(low <= sub.min && sub.min <= sub.default);
            assert!(sub.default <= sub.max && sub.max <= high);
            fields += 1;
            s += 1;
        }
        o += 1;
    }
};

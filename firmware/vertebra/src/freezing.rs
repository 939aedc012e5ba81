//! The freeze frame: everything at the moment of a fault or a stop, before the wrist lets go.

use eel_protocol::State;
use eel_protocol::emergency::{Emergency, Source};
use eel_protocol::freeze::{FreezeFrame, TimeOfDay};
use eel_units::{Angle, AngularVelocity, Instant, Temperature};

use crate::core::Core;
use crate::objects::microradians;

/// The time of day, and when it was told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock {
    pub time: TimeOfDay,
    pub told: Instant,
}

impl Core {
    /// Keeps what the vertebra was doing, in the tick in which it faults or stops; `before` is the state
    /// that this ends.
    pub fn freeze(&mut self, before: State, emergency: Emergency, source: Source) {
        self.raised = true;
        self.freeze = Some(self.frame(before, emergency, source));
    }

    /// Returns what the vertebra is doing. Measurements are this tick's, reference and limits those that
    /// were in force.
    #[inline(never)] // One copy in flash.
    pub fn frame(&self, before: State, emergency: Emergency, source: Source) -> FreezeFrame {
        let count = self.freeze.map_or(0, |frame| frame.count);
        let clock = self.clock.map(|Clock { time, told }| {
            let now = self.now.to_micros();
            time.later(now.saturating_sub(told.to_micros()))
        });
        let triple = |pose: eel_kinematics::Pose| [pose.yaw, pose.pitch, pose.roll].map(micro);
        let sample = &self.sample;
        let tenths = |value: Temperature| value.to_decidegrees() as i16;
        let [one, two, three] = sample.motor_temperature.map(tenths);
        FreezeFrame {
            state: before,
            code: emergency.code,
            source,
            at_us: self.now.to_micros(),
            count: count.saturating_add(1),
            clock,
            pose: triple(self.pose),
            reference: self.reference.map(|reference| triple(reference.pose)),
            angles: self.angles().map(micro),
            speeds: self
                .encoders
                .each_ref()
                .map(|encoder| milli(encoder.speed())),
            currents: sample.current.map(|current| current.to_microamps() / 1_000),
            torques: sample
                .current
                .map(|current| self.electrical.torque(current).to_millinewton_metres()),
            limits: self.effort.limit,
            supply: sample.supply.to_millivolts(),
            temperatures: [tenths(sample.board_temperature), one, two, three],
            status: self.status,
            counters: [
                self.stream.counters().bad,
                self.stream.counters().lost,
                self.counters.receive_overruns,
                self.counters.transmit_overruns,
            ],
        }
    }
}

fn micro(angle: Angle) -> i32 {
    microradians(angle) as i32
}

/// Returns a speed in mrad/s.
const fn milli(speed: AngularVelocity) -> i32 {
    ((speed.to_q24() as i64 * 1_000 + (1 << 23)) >> 24) as i32
}

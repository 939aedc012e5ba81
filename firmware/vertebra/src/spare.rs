//! What a tick does besides its own work, of what need not be done in each.

use crate::core::Core;
use crate::limits::Standing;
use crate::settings::Settings;
use crate::thermal::FAULT_MARGIN;

/// Ticks after which it begins again.
const ROUND: u8 = 32;

/// What a tick has time for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spare {
    /// Nothing: a target or many frames make it long already.
    Nothing,
    /// The temperature of a motor, 0-2.
    Temperature(usize),
    /// The friction of the motors.
    Friction,
    /// Noting what is done, for the memory over a failure.
    Snapshot,
    /// That memory.
    Memory,
    /// The search for the pose that is nearest to a target out of reach.
    Search,
}

impl Core {
    /// Returns what this tick has time for.
    pub const fn spare(&self) -> Spare {
        if self.is_busy {
            return Spare::Nothing;
        }
        match self.turn {
            1..=3 => Spare::Temperature(self.turn as usize - 1),
            turn if turn.is_multiple_of(4) => Spare::Friction,
            turn if turn == ROUND - 2 => Spare::Snapshot,
            turn if turn == ROUND - 1 => Spare::Memory,
            _ => Spare::Search,
        }
    }

    /// Begins a tick: it is the next one's turn, and the temperatures are brought up to date.
    pub fn take_turn(&mut self) {
        if !self.is_busy {
            self.turn = (self.turn + 1) % ROUND;
        }
        if let Spare::Temperature(motor) = self.spare() {
            self.warm(motor);
        }
    }

    /// Brings a motor's temperature and what follows from it up to date.
    fn warm(&mut self, motor: usize) {
        let (Some(thermal), Some(standing), Some(is_too_hot), Some(housing)) = (
            self.thermal.get_mut(motor),
            self.standing.get_mut(motor),
            self.is_too_hot.get_mut(motor),
            self.sample.motor_temperature.get(motor),
        ) else {
            return;
        };
        let Settings { limits, motor, .. } = &self.settings;
        thermal.advance(self.now, motor, *housing);
        *is_too_hot = thermal.winding() >= motor.thermal.winding_limit + FAULT_MARGIN;
        let torque = self.electrical.torque(thermal.bound(motor));
        *standing = Standing::new(limits, self.sample.board_temperature, *housing, torque);
    }
}

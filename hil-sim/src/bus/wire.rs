//! The bus itself: time, the frame on the wire, and who gets it.

use eel_protocol::Frame;
use eel_transport::{INTERFRAME_BITS, frame_bits};

use super::arbitration::first_difference;
use super::controller::{Controller, ControllerConfig, ControllerId, EnqueueError, Fifo};
use super::event::{BusErrorKind, Delivery, Event};
use super::statistics::{ControllerStatistics, Statistics};

/// Controllers that a bus holds at most: what a mask of 64 bits can name.
const CONTROLLERS: usize = 64;
/// Bits of an active error flag.
const ERROR_FLAG_BITS: u32 = 6;
/// Bits of an error delimiter.
const ERROR_DELIMITER_BITS: u32 = 8;
/// Recessive bits after which a controller that was switched on takes part.
const INTEGRATION_BITS: u64 = 11;
/// Bits of the tail after the acknowledge slot: its delimiter and the end of frame.
const AFTER_ACKNOWLEDGE_BITS: u32 = 8;

/// A bit rate whose bit time is a whole number of nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitRate(u32);

impl BitRate {
    /// 1 Mbit/s.
    pub const ONE_MEGABIT: Self = Self(1_000_000);

    /// Makes a bit rate from bits a second; `None` where the bit time is no whole number of
    /// nanoseconds, and above 1 Mbit/s.
    pub const fn new(bits_per_second: u32) -> Option<Self> {
        let possible = bits_per_second > 0
            && bits_per_second <= 1_000_000
            && 1_000_000_000_u32.is_multiple_of(bits_per_second);
        if possible {
            Some(Self(bits_per_second))
        } else {
            None
        }
    }

    /// Returns the length of a bit in ns.
    pub const fn bit_ns(self) -> u64 {
        1_000_000_000 / self.0 as u64
    }
}

/// Why a controller was not attached.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttachError {
    /// The bus has 64 controllers already.
    BusFull,
    /// There are more than 28 standard or 8 extended filters.
    TooManyFilters,
}

/// A CAN bus with its controllers.
#[derive(Clone, Debug)]
pub struct Bus {
    bit_ns: u64,
    controllers: Vec<Controller>,
    /// Starts before this time are decided, in ns.
    decided_ns: u64,
    /// When the bus is idle again, in ns.
    idle_ns: u64,
    wire: Option<Transmission>,
    /// What would start next if nothing was loaded any more.
    planned: Option<Transmission>,
    statistics: Statistics,
}

/// One attempt to send a frame.
#[derive(Clone, Copy, Debug)]
struct Transmission {
    start_ns: u64,
    /// Bits from the start of frame to the end of frame or of the error delimiter.
    bits: u32,
    frame: Frame,
    /// Controllers that send it to its end, one bit each.
    senders: u64,
    /// Passive controllers whose colliding frame gave way.
    dropped: u64,
    /// Controllers that lost the arbitration.
    losers: u64,
    failure: Option<BusErrorKind>,
}

impl Bus {
    /// Makes a bus without controllers, idle from time 0 on.
    pub const fn new(rate: BitRate) -> Self {
        Self {
            bit_ns: rate.bit_ns(),
            controllers: Vec::new(),
            decided_ns: 0,
            idle_ns: 0,
            wire: None,
            planned: None,
            statistics: Statistics {
                frames: 0,
                frame_bits: 0,
                error_bits: 0,
                arbitration_losses: 0,
                collisions: 0,
                identical: 0,
                unacknowledged: 0,
                cut: 0,
            },
        }
    }

    /// Attaches a controller, which takes part at once.
    ///
    /// # Errors
    /// [`AttachError`] where the bus or the hardware has no room.
    pub fn attach(&mut self, config: ControllerConfig) -> Result<ControllerId, AttachError> {
        if self.controllers.len() >= CONTROLLERS {
            return Err(AttachError::BusFull);
        }
        if !config.filters_fit() {
            return Err(AttachError::TooManyFilters);
        }
        let mut controller = Controller::new(config);
        controller.joined_ns = Some(self.decided_ns);
        self.planned = None;
        self.controllers.push(controller);
        Ok(ControllerId(self.controllers.len() as u8 - 1))
    }

    /// Loads a frame into a transmit buffer at `now_ns`, up to which the bus should have been
    /// advanced; an earlier time counts as that of the last [`Bus::advance`].
    ///
    /// # Errors
    /// [`EnqueueError::Full`] while all buffers are occupied, [`EnqueueError::Off`] of a controller
    /// that is off.
    pub fn enqueue(
        &mut self,
        now_ns: u64,
        id: ControllerId,
        frame: Frame,
    ) -> Result<(), EnqueueError> {
        let controller = self
            .controllers
            .get_mut(id.index())
            .ok_or(EnqueueError::Off)?;
        controller.load(now_ns.max(self.decided_ns), frame)?;
        self.planned = None;
        Ok(())
    }

    /// Returns how many transmit buffers are free.
    pub fn free_buffers(&self, id: ControllerId) -> usize {
        self.controllers
            .get(id.index())
            .map_or(0, Controller::free_buffers)
    }

    /// Takes the oldest received frame and the time of its end of frame in ns, from FIFO 0 first.
    pub fn receive(&mut self, id: ControllerId) -> Option<(u64, Frame)> {
        self.receive_from(id, Fifo::Zero)
            .or_else(|| self.receive_from(id, Fifo::One))
    }

    /// Takes the oldest frame of one receive FIFO and the time of its end of frame in ns.
    pub fn receive_from(&mut self, id: ControllerId, fifo: Fifo) -> Option<(u64, Frame)> {
        self.controllers.get_mut(id.index())?.take(fifo)
    }

    /// Tells whether a received frame waits.
    pub fn has_received(&self, id: ControllerId) -> bool {
        self.controllers
            .get(id.index())
            .is_some_and(Controller::has_received)
    }

    /// Returns when the frame on the wire, or the one that would start next, ends in ns: the
    /// earliest time at which [`Bus::advance`] delivers something, if nothing is loaded before.
    pub fn next_event_ns(&mut self) -> Option<u64> {
        let next = self.wire.or_else(|| self.plan())?;
        Some(self.end_ns(&next))
    }

    /// Lets time pass up to `to_ns`: decides the starts before it and completes the frames that end
    /// by it, and gives what happened to `observe` in the order of time.
    pub fn advance(&mut self, to_ns: u64, observe: &mut impl FnMut(&Event)) {
        loop {
            if let Some(current) = self.wire {
                if self.end_ns(&current) > to_ns {
                    break;
                }
                self.wire = None;
                self.complete(&current, observe);
            } else {
                let Some(next) = self.plan().filter(|next| next.start_ns < to_ns) else {
                    break;
                };
                self.planned = None;
                self.begin(&next, observe);
                self.wire = Some(next);
            }
        }
        self.decided_ns = self.decided_ns.max(to_ns);
    }

    /// Switches a controller off or on at `now_ns`, up to which the bus must have been advanced.
    ///
    /// Off, its buffers and FIFOs are emptied, and a frame of its own on the wire is destroyed
    /// unless only its acknowledge delimiter and end of frame, which are recessive, are left. On, it
    /// takes part after 11 bit times.
    pub fn set_powered(&mut self, now_ns: u64, id: ControllerId, on: bool) {
        let now_ns = now_ns.max(self.decided_ns);
        let Some(controller) = self.controllers.get_mut(id.index()) else {
            return;
        };
        self.planned = None;
        if on {
            if controller.joined_ns.is_none() {
                controller.joined_ns = Some(now_ns + INTEGRATION_BITS * self.bit_ns);
            }
            return;
        }
        controller.switch_off();
        let Some(wire) = &mut self.wire else { return };
        let others = wire.senders & !(1 << id.0);
        wire.dropped &= !(1 << id.0);
        if others == wire.senders {
            return;
        }
        let gone = (now_ns.saturating_sub(wire.start_ns) / self.bit_ns) as u32;
        if others != 0 {
            wire.senders = others;
        } else if wire.failure.is_none() && gone + AFTER_ACKNOWLEDGE_BITS < wire.bits {
            // The receivers see recessive bits only, and the sixth breaks the stuffing rule.
            wire.bits = gone + 6 + ERROR_FLAG_BITS + ERROR_DELIMITER_BITS;
            wire.failure = Some(BusErrorKind::Cut);
        }
    }

    /// Returns the counters of the bus.
    pub const fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// Returns the counters of a controller.
    pub fn controller(&self, id: ControllerId) -> Option<&ControllerStatistics> {
        self.controllers
            .get(id.index())
            .map(|controller| &controller.statistics)
    }

    /// Returns the share of the time from 0 to the last [`Bus::advance`] in which the bus was busy
    /// with frames that ended by then, 0–1, exact from their bits.
    pub fn load(&self) -> f64 {
        let busy_ns = self.statistics.busy_bits() * self.bit_ns;
        busy_ns as f64 / self.decided_ns.max(1) as f64
    }

    fn end_ns(&self, transmission: &Transmission) -> u64 {
        transmission.start_ns + u64::from(transmission.bits) * self.bit_ns
    }

    /// Works out the next attempt from what is loaded now.
    fn plan(&mut self) -> Option<Transmission> {
        if self.planned.is_none() {
            let ready_ns = self
                .controllers
                .iter()
                .filter_map(Controller::ready_ns)
                .min()?;
            self.planned = self.arbitrate(ready_ns.max(self.idle_ns));
        }
        self.planned
    }

    fn arbitrate(&self, start_ns: u64) -> Option<Transmission> {
        let (mut lowest, mut frame, mut senders, mut contenders) = (u32::MAX, None, 0u64, 0u64);
        for (at, controller) in self.controllers.iter().enumerate() {
            let Some((_, pending)) = controller.candidate(start_ns) else {
                continue;
            };
            contenders |= 1 << at;
            if frame.is_none() || pending.field < lowest {
                (lowest, frame, senders) = (pending.field, Some(pending.frame), 1 << at);
            } else if pending.field == lowest {
                senders |= 1 << at;
            }
        }
        let mut attempt = Transmission {
            start_ns,
            bits: 0,
            frame: frame?,
            senders,
            dropped: 0,
            losers: contenders & !senders,
            failure: None,
        };
        if senders.count_ones() > 1 && self.collide(&mut attempt) {
            return Some(attempt);
        }
        attempt.bits = frame_bits(&attempt.frame) - INTERFRAME_BITS;
        let busy = attempt.senders | attempt.dropped;
        let mut others = self.controllers.iter().enumerate();
        if !others.any(|(at, other)| busy >> at & 1 == 0 && other.acknowledges(start_ns)) {
            attempt.failure = Some(BusErrorKind::Acknowledge);
            attempt.bits -= AFTER_ACKNOWLEDGE_BITS;
            attempt.bits += ERROR_FLAG_BITS + ERROR_DELIMITER_BITS;
        }
        Some(attempt)
    }

    /// Sorts out controllers that send one arbitration field; true where they destroy the frame.
    ///
    /// A sender that is error passive and sees its recessive bit overwritten drops out silently.
    fn collide(&self, attempt: &mut Transmission) -> bool {
        loop {
            // The earliest difference between any two is one from the frame with the dominant bit.
            let mut earliest: Option<(u32, u32)> = None;
            for (_, frame) in self.candidates(attempt) {
                let Some(difference) = first_difference(&attempt.frame, frame) else {
                    continue;
                };
                if !difference.second_is_recessive {
                    attempt.frame = *frame;
                }
                let found = (difference.bits, difference.dominant_run);
                earliest = Some(earliest.map_or(found, |known| known.min(found)));
            }
            let Some((bits, run)) = earliest else {
                return false;
            };
            let mut quiet = 0u64;
            for (at, frame) in self.candidates(attempt) {
                let difference = first_difference(&attempt.frame, frame);
                if !difference.is_some_and(|found| found.bits == bits && found.second_is_recessive)
                {
                    continue;
                }
                if !self.controllers[at].is_passive() {
                    // The others see six dominant bits and add their flags to the first.
                    attempt.bits = bits + 2 * ERROR_FLAG_BITS - run + ERROR_DELIMITER_BITS;
                    attempt.failure = Some(BusErrorKind::Collision);
                    return true;
                }
                quiet |= 1 << at;
            }
            attempt.senders &= !quiet;
            attempt.dropped |= quiet;
        }
    }

    /// Returns the senders of an attempt with their frames.
    fn candidates<'a>(
        &'a self,
        attempt: &Transmission,
    ) -> impl Iterator<Item = (usize, &'a Frame)> + use<'a> {
        let (senders, start_ns) = (attempt.senders, attempt.start_ns);
        members(senders).filter_map(move |at| {
            let (_, pending) = self.controllers.get(at)?.candidate(start_ns)?;
            Some((at, &pending.frame))
        })
    }

    fn begin(&mut self, next: &Transmission, observe: &mut impl FnMut(&Event)) {
        let start_ns = next.start_ns;
        for at in members(next.senders | next.dropped | next.losers) {
            let controller = &mut self.controllers[at];
            let Some((buffer, pending)) = controller.candidate(start_ns) else {
                continue;
            };
            let (id, frame) = (ControllerId(at as u8), pending.frame);
            if next.losers >> at & 1 == 1 {
                controller.statistics.arbitration_losses += 1;
                self.statistics.arbitration_losses += 1;
                observe(&Event::ArbitrationLost {
                    start_ns,
                    loser: id,
                    frame,
                });
            } else {
                controller.sending = Some(buffer);
                observe(&Event::Transmit {
                    start_ns,
                    sender: id,
                    frame,
                });
            }
        }
    }

    fn complete(&mut self, done: &Transmission, observe: &mut impl FnMut(&Event)) {
        let end_ns = self.end_ns(done);
        self.idle_ns = end_ns + u64::from(INTERFRAME_BITS) * self.bit_ns;
        let bits = done.bits + INTERFRAME_BITS;
        let sender = ControllerId(done.senders.trailing_zeros() as u8);
        let (start_ns, frame) = (done.start_ns, done.frame);
        for at in members(done.dropped) {
            self.controllers[at].fail(true);
        }
        let Some(kind) = done.failure else {
            self.statistics.frames += 1;
            self.statistics.frame_bits += u64::from(bits);
            self.statistics.identical += u64::from(done.senders.count_ones() > 1);
            for (at, controller) in self.controllers.iter_mut().enumerate() {
                if done.senders >> at & 1 == 1 {
                    controller.confirm();
                } else if done.dropped >> at & 1 == 0 && controller.hears(start_ns) {
                    controller.store(end_ns, &frame);
                }
            }
            observe(&Event::Confirm(Delivery {
                start_ns,
                end_ns,
                sender,
                frame,
                bits,
            }));
            return;
        };
        self.statistics.error_bits += u64::from(bits);
        let counter = match kind {
            BusErrorKind::Acknowledge => &mut self.statistics.unacknowledged,
            BusErrorKind::Collision => &mut self.statistics.collisions,
            BusErrorKind::Cut => &mut self.statistics.cut,
        };
        *counter += 1;
        for at in members(done.senders) {
            let controller = &mut self.controllers[at];
            // A passive controller that misses only the acknowledge counts no further.
            let counts = kind != BusErrorKind::Acknowledge || !controller.is_passive();
            controller.fail(counts);
        }
        observe(&Event::BusError {
            start_ns,
            end_ns,
            sender,
            frame,
            kind,
        });
    }
}

/// Returns the positions of the bits of a mask, lowest first.
fn members(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let at = mask.trailing_zeros();
        (at < u64::BITS).then(|| {
            mask &= mask - 1;
            at as usize
        })
    })
}

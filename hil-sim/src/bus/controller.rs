//! One CAN controller as the STM32G474 has it: three transmit buffers, filters, two receive FIFOs
//! of three (reference manual RM0440, chapter 44, FDCAN).

use std::collections::VecDeque;

use eel_protocol::Frame;

use super::arbitration::arbitration_field;
use super::statistics::ControllerStatistics;

/// Filters for 11-bit identifiers that the FDCAN has.
const STANDARD_FILTERS: usize = 28;
/// Filters for 29-bit identifiers that the FDCAN has.
const EXTENDED_FILTERS: usize = 8;
/// From this transmit error counter on a controller is error passive (ISO 11898-1).
const PASSIVE: u8 = 128;

/// A controller of one bus, in the order of attachment.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ControllerId(pub(super) u8);

impl ControllerId {
    /// Returns the position in the order of attachment, from 0.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// How a controller is set up; [`Default`] is the STM32G474 that takes every frame into FIFO 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ControllerConfig {
    /// Frames that wait in the controller to be sent; the STM32G474 has room for 3.
    pub transmit_buffers: usize,
    /// In which order they are sent.
    pub transmit_mode: TransmitMode,
    /// Frames that each receive FIFO holds; the STM32G474's hold 3.
    pub receive_depth: usize,
    /// What happens to a frame that comes when the FIFO is full.
    pub overflow: Overflow,
    /// The first filter that fits decides; the STM32G474 has 28 standard and 8 extended ones.
    pub filters: Vec<Filter>,
    /// Where a frame goes that no filter fits; `None` turns it away.
    pub otherwise: Option<Fifo>,
    /// Whether it acknowledges; a mere listener does not.
    pub acknowledges: bool,
}

impl Default for ControllerConfig {
    fn default() -> Self {
        Self {
            transmit_buffers: 3,
            transmit_mode: TransmitMode::Queue,
            receive_depth: 3,
            overflow: Overflow::Discard,
            filters: Vec::new(),
            otherwise: Some(Fifo::Zero),
            acknowledges: true,
        }
    }
}

impl ControllerConfig {
    /// Tells whether an FDCAN could hold these filters.
    pub(super) fn filters_fit(&self) -> bool {
        let extended = self.filters.iter().filter(|filter| filter.extended).count();
        extended <= EXTENDED_FILTERS && self.filters.len() - extended <= STANDARD_FILTERS
    }
}

/// The order in which a controller sends its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TransmitMode {
    /// The lowest arbitration field first, of equal ones the lowest buffer; a new frame takes the
    /// lowest free buffer. Frames with one identifier may thus overtake each other, as in the FDCAN.
    Queue,
    /// The oldest first.
    Fifo,
}

/// What a full receive FIFO does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Overflow {
    /// It keeps what it has and the new frame is lost.
    Discard,
    /// The new frame takes the place of the oldest, which is lost.
    Overwrite,
}

/// One of the two receive FIFOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fifo {
    /// FIFO 0.
    Zero,
    /// FIFO 1.
    One,
}

/// An acceptance filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Filter {
    /// Whether it looks at 29-bit identifiers, or at 11-bit ones.
    pub extended: bool,
    /// Which identifiers it fits.
    pub matches: FilterMatch,
    /// Where a frame goes that it fits; `None` turns it away.
    pub store: Option<Fifo>,
}

/// Which identifiers a filter fits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterMatch {
    /// From the first to the second, both included.
    Range(u32, u32),
    /// Either of two.
    Dual(u32, u32),
    /// Those that agree with the first in the bits that are 1 in the second.
    Mask(u32, u32),
}

impl FilterMatch {
    const fn fits(self, id: u32) -> bool {
        match self {
            Self::Range(first, last) => first <= id && id <= last,
            Self::Dual(one, other) => id == one || id == other,
            Self::Mask(wanted, mask) => id & mask == wanted & mask,
        }
    }
}

/// Why a frame was not taken for transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnqueueError {
    /// All transmit buffers are occupied.
    Full,
    /// The controller is off, or belongs to another bus.
    Off,
}

/// A frame that waits in a transmit buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pending {
    pub frame: Frame,
    pub field: u32,
    pub ready_ns: u64,
    order: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Controller {
    config: ControllerConfig,
    buffers: Vec<Option<Pending>>,
    pub pending: usize,
    loaded: u64,
    /// The buffer whose frame is on the wire.
    pub sending: Option<usize>,
    fifos: [VecDeque<(u64, Frame)>; 2],
    /// Since when it takes part in the bus; `None` while it is off.
    pub joined_ns: Option<u64>,
    pub statistics: ControllerStatistics,
}

impl Controller {
    pub fn new(config: ControllerConfig) -> Self {
        let depth = config.receive_depth;
        Self {
            buffers: vec![None; config.transmit_buffers],
            pending: 0,
            loaded: 0,
            sending: None,
            fifos: [
                VecDeque::with_capacity(depth),
                VecDeque::with_capacity(depth),
            ],
            joined_ns: Some(0),
            statistics: ControllerStatistics::default(),
            config,
        }
    }

    /// Tells whether it is on the bus for a frame that starts at `start_ns`.
    #[inline]
    pub fn hears(&self, start_ns: u64) -> bool {
        self.joined_ns.is_some_and(|joined| joined <= start_ns)
    }

    #[inline]
    pub fn acknowledges(&self, start_ns: u64) -> bool {
        self.config.acknowledges && self.hears(start_ns)
    }

    pub fn free_buffers(&self) -> usize {
        self.buffers.len() - self.pending
    }

    /// Loads a frame that may be sent from `ready_ns` on.
    pub fn load(&mut self, ready_ns: u64, frame: Frame) -> Result<(), EnqueueError> {
        let Some(joined_ns) = self.joined_ns else {
            return Err(EnqueueError::Off);
        };
        let Some(buffer) = self.buffers.iter_mut().find(|buffer| buffer.is_none()) else {
            self.statistics.refused += 1;
            return Err(EnqueueError::Full);
        };
        let field = arbitration_field(&frame);
        let ready_ns = ready_ns.max(joined_ns);
        *buffer = Some(Pending {
            frame,
            field,
            ready_ns,
            order: self.loaded,
        });
        self.pending += 1;
        self.loaded += 1;
        Ok(())
    }

    /// Returns when it can enter an arbitration at the earliest, in ns.
    #[inline]
    pub fn ready_ns(&self) -> Option<u64> {
        if self.pending == 0 {
            return None;
        }
        let mut filled = self.buffers.iter().flatten();
        match self.config.transmit_mode {
            TransmitMode::Queue => filled.map(|pending| pending.ready_ns).min(),
            TransmitMode::Fifo => {
                let first = filled.next()?;
                let oldest = filled.fold(first, |oldest, pending| {
                    if pending.order < oldest.order {
                        pending
                    } else {
                        oldest
                    }
                });
                Some(oldest.ready_ns)
            }
        }
    }

    /// Returns the frame, and its buffer, with which it enters an arbitration at `start_ns`.
    #[inline]
    pub fn candidate(&self, start_ns: u64) -> Option<(usize, &Pending)> {
        if self.pending == 0 {
            return None;
        }
        let filled = self.buffers.iter().enumerate();
        let filled = filled.filter_map(|(at, buffer)| Some((at, buffer.as_ref()?)));
        match self.config.transmit_mode {
            TransmitMode::Queue => filled
                .filter(|(_, pending)| pending.ready_ns <= start_ns)
                .min_by_key(|(at, pending)| (pending.field, *at)),
            TransmitMode::Fifo => filled
                .min_by_key(|(_, pending)| pending.order)
                .filter(|(_, pending)| pending.ready_ns <= start_ns),
        }
    }

    /// Frees the buffer whose frame was confirmed.
    pub fn confirm(&mut self) {
        self.statistics.sent += 1;
        let counter = &mut self.statistics.transmit_error_counter;
        *counter = counter.saturating_sub(1);
        if let Some(buffer) = self.sending.take().and_then(|at| self.buffers.get_mut(at)) {
            *buffer = None;
            self.pending -= 1;
        }
    }

    /// Keeps the frame, which was destroyed, for another attempt.
    pub fn fail(&mut self, counts: bool) {
        self.statistics.errors += 1;
        self.sending = None;
        if counts {
            let counter = &mut self.statistics.transmit_error_counter;
            *counter = counter.saturating_add(8);
        }
    }

    pub const fn is_passive(&self) -> bool {
        self.statistics.transmit_error_counter >= PASSIVE
    }

    /// Stores a frame that came, where filters and FIFOs let it.
    #[inline]
    pub fn store(&mut self, time_ns: u64, frame: &Frame) {
        let Some(fifo) = self.accepts(frame) else {
            self.statistics.filtered += 1;
            return;
        };
        let at = usize::from(fifo == Fifo::One);
        let (queue, depth) = (&mut self.fifos[at], self.config.receive_depth);
        if queue.len() >= depth {
            self.statistics.overruns[at] += 1;
            if self.config.overflow == Overflow::Discard || queue.pop_front().is_none() {
                return;
            }
        }
        queue.push_back((time_ns, *frame));
        self.statistics.received += 1;
    }

    #[inline]
    fn accepts(&self, frame: &Frame) -> Option<Fifo> {
        let (extended, id) = (frame.is_extended(), frame.raw_id());
        let mut filters = self.config.filters.iter();
        let first = filters.find(|filter| filter.extended == extended && filter.matches.fits(id));
        first.map_or(self.config.otherwise, |filter| filter.store)
    }

    /// Takes the oldest frame of a FIFO.
    pub fn take(&mut self, fifo: Fifo) -> Option<(u64, Frame)> {
        self.fifos[usize::from(fifo == Fifo::One)].pop_front()
    }

    /// Tells whether a frame waits in a receive FIFO.
    pub fn has_received(&self) -> bool {
        self.fifos.iter().any(|fifo| !fifo.is_empty())
    }

    /// Goes off: buffers and FIFOs are empty and the error counter is 0.
    pub fn switch_off(&mut self) {
        self.joined_ns = None;
        self.buffers.fill(None);
        self.pending = 0;
        self.sending = None;
        self.fifos.iter_mut().for_each(VecDeque::clear);
        self.statistics.transmit_error_counter = 0;
    }
}

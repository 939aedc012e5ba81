//! Counters of the bus and of its controllers.

/// What the bus did since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Frames delivered.
    pub frames: u64,
    /// Bit times of delivered frames with their interframe spaces.
    pub frame_bits: u64,
    /// Bit times of destroyed frames with their error frames and interframe spaces.
    pub error_bits: u64,
    /// Times that a controller gave way to another.
    pub arbitration_losses: u64,
    /// Frames destroyed because two controllers sent one arbitration field with different content.
    pub collisions: u64,
    /// Frames that two or more controllers sent at once with equal content.
    pub identical: u64,
    /// Frames that nobody acknowledged.
    pub unacknowledged: u64,
    /// Frames whose sender went off in the middle.
    pub cut: u64,
}

impl Statistics {
    /// Returns the bit times in which the bus was not idle.
    pub const fn busy_bits(&self) -> u64 {
        self.frame_bits + self.error_bits
    }
}

/// What one controller did since it was attached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ControllerStatistics {
    /// Frames sent and confirmed.
    pub sent: u64,
    /// Frames stored in a receive FIFO.
    pub received: u64,
    /// Frames that its filters turned away.
    pub filtered: u64,
    /// Frames lost because receive FIFO 0 or 1 was full.
    pub overruns: [u64; 2],
    /// Times that it gave way to another controller.
    pub arbitration_losses: u64,
    /// Frames of its own that were destroyed.
    pub errors: u64,
    /// Frames refused because its transmit buffers were full.
    pub refused: u64,
    /// The transmit error counter of ISO 11898-1, at most 255.
    pub transmit_error_counter: u8,
}

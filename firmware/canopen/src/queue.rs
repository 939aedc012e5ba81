//! A bounded queue of things that happened, for whoever polls too late.

use heapless::Deque;

/// Things in order, at most `N`. When it is full the oldest is forgotten, and counted.
#[derive(Clone, Debug)]
pub struct EventQueue<T, const N: usize> {
    events: Deque<T, N>,
    dropped: u32,
}

impl<T, const N: usize> Default for EventQueue<T, N> {
    fn default() -> Self {
        Self {
            events: Deque::new(),
            dropped: 0,
        }
    }
}

impl<T, const N: usize> EventQueue<T, N> {
    /// Adds an event.
    #[inline(never)] // One copy in flash.
    pub fn push(&mut self, event: T) {
        if self.events.is_full() {
            self.events.pop_front();
            self.dropped = self.dropped.saturating_add(1);
        }
        // There is room now, unless there is room for none at all.
        let _ = self.events.push_back(event);
    }

    /// Takes the oldest event.
    pub fn pop(&mut self) -> Option<T> {
        self.events.pop_front()
    }

    /// Returns how many events were forgotten.
    pub const fn dropped(&self) -> u32 {
        self.dropped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_newest_and_counts_the_rest() {
        let mut queue = EventQueue::<u8, 3>::default();
        for event in 0..5 {
            queue.push(event);
        }
        assert_eq!(queue.dropped(), 2);
        assert_eq!(
            [queue.pop(), queue.pop(), queue.pop(), queue.pop()],
            [Some(2), Some(3), Some(4), None]
        );
    }
}

//! A queue out of the real-time thread, which is its only producer. The control thread is its only consumer.

use super::primitives::ArrayQueue;

/// The queue. The real-time side pushes only while two slots are free, which makes crossbeam's queue wait-free for it: nobody else moves the
/// tail, and the slot at the tail was popped at least two pops ago. With one free slot the consumer may be half-way through just that slot,
/// and `push` would spin until it is done.
#[derive(Debug)]
pub(crate) struct Outbox<T>(ArrayQueue<T>);

impl<T> Outbox<T> {
    pub(crate) fn new(capacity: usize) -> Self {
        Self(ArrayQueue::new(capacity))
    }

    /// Whether a push will succeed. For the producer; what it says stays true until it pushes.
    pub(crate) fn has_room(&self) -> bool {
        self.has_room_for(1)
    }

    /// Whether so many pushes will succeed, one after the other.
    pub(crate) fn has_room_for(&self, pushes: usize) -> bool {
        self.0.len() + pushes < self.0.capacity()
    }

    /// For the producer.
    ///
    /// # Errors
    /// There is no room; here is the value again.
    pub(crate) fn push(&self, value: T) -> Result<(), T> {
        if self.has_room() {
            self.0.push(value)
        } else {
            Err(value)
        }
    }

    /// The oldest value. For the consumer.
    pub(crate) fn pop(&self) -> Option<T> {
        self.0.pop()
    }
}

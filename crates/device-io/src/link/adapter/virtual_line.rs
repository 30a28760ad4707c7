//! A conversation with a fake board in virtual time: no thread, no terminal, the same again every time.

use super::Conversation;
use super::text::{Lines, Text};
use crate::device::{DeviceError, Measurement};
use crate::fake::{Board, Channel, Quality};
use crate::link::health::LinkCounters;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

pub(super) const MS: u64 = 1_000_000;

/// A thousandth of a tick, in which the board answers.
const STEP_NS: u64 = 100_000;

/// A host and a board with a line between them.
pub(super) struct VirtualLine<C, B> {
    pub(super) conversation: C,
    pub(super) board: B,
    pub(super) quality: Quality,
    pub(super) counters: Arc<LinkCounters>,
    pub(super) now_ns: u64,
    /// Nothing that the host says goes through.
    pub(super) host_is_dead: bool,
    /// Everything that the host has said.
    pub(super) said: Vec<u8>,
    lines: Lines,
    up: Channel,
    down: Channel,
}

impl<C: Conversation, B: Board> VirtualLine<C, B> {
    pub(super) fn new(conversation: C, board: B, counters: Arc<LinkCounters>, now_ns: u64) -> Self {
        Self {
            conversation,
            board,
            quality: Quality::default(),
            counters,
            now_ns,
            host_is_dead: false,
            said: Vec::new(),
            lines: Lines::default(),
            up: Channel::new(3),
            down: Channel::new(4),
        }
    }

    /// A millisecond: the tick, and then the board's answers.
    pub(super) fn tick(&mut self, force_n: f64, enabled: bool) -> Result<Option<Measurement>, DeviceError> {
        let measured = self.listen();
        let mut text = Text::default();
        self.conversation.command(force_n, enabled, self.now_ns, &mut text);
        self.send(&text);
        for _ in 0..MS / STEP_NS {
            self.now_ns += STEP_NS;
            while let Some(line) = self.down.receive(self.now_ns) {
                for answer in self.board.hear(&line, self.now_ns) {
                    self.up.send(answer, &self.quality, self.now_ns);
                }
            }
            self.board.live_until(self.now_ns);
        }
        measured
    }

    /// What came since.
    pub(super) fn listen(&mut self) -> Result<Option<Measurement>, DeviceError> {
        while let Some(bytes) = self.up.receive(self.now_ns) {
            self.lines
                .take(&bytes, |line| self.conversation.take(line, self.now_ns));
        }
        self.conversation.measurement(self.now_ns)
    }

    pub(super) fn send(&mut self, text: &Text) {
        if self.host_is_dead {
            return;
        }
        self.said.extend(text.as_bytes());
        for line in text.as_bytes().split_inclusive(|byte| *byte == b'\n') {
            self.down.send(line.to_vec(), &self.quality, self.now_ns);
        }
    }

    /// So many ticks that must be well; the last sample.
    pub(super) fn ticks(&mut self, count: u32, force_n: f64, enabled: bool) -> Measurement {
        let mut last = None;
        for k in 0..count {
            last = self
                .tick(force_n, enabled)
                .unwrap_or_else(|error| panic!("tick {k}: {error}"));
        }
        last.expect("a sample")
    }

    /// A tick that lets go, whatever has failed, and so many that must be well.
    pub(super) fn let_go(&mut self, count: u32) {
        self.tick(0.0, false).ok();
        self.ticks(count, 0.0, false);
    }

    /// Ticks until one fails, so many at most; which one, and how.
    pub(super) fn ticks_until_failure(&mut self, most: u32, force_n: f64, enabled: bool) -> Option<(u32, DeviceError)> {
        (1..=most).find_map(|k| self.tick(force_n, enabled).err().map(|error| (k, error)))
    }

    pub(super) fn count(&self, of: impl Fn(&LinkCounters) -> &AtomicU64) -> u64 {
        of(&self.counters).load(Relaxed)
    }
}

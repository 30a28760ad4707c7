//! A conversation with a fake board in virtual time: without a thread or a terminal, and the same
//! in every run.

use super::conversation::{Conversation, Scale};
use super::dialect::ODriveDialect;
use super::text::{Lines, Text};
use crate::fake::ODriveBoard;
use device_io::fake::{Channel, Quality};
use device_io::link::LinkCounters;
use device_io::{DeviceError, Measurement};
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

pub(super) const MS: u64 = 1_000_000;

/// Time between two answers of the board, ns.
const STEP_NS: u64 = 100_000;

/// A host and a board with a line between them.
pub(super) struct VirtualLine {
    pub(super) conversation: Conversation,
    pub(super) board: ODriveBoard,
    pub(super) quality: Quality,
    pub(super) counters: Arc<LinkCounters>,
    pub(super) now_ns: u64,
    /// Nothing of the host comes through.
    pub(super) host_is_dead: bool,
    /// Everything that the host has sent.
    pub(super) sent: Vec<u8>,
    lines: Lines,
    up: Channel,
    down: Channel,
}

impl VirtualLine {
    pub(super) fn new(dialect: ODriveDialect, scale: Scale, board: ODriveBoard, now_ns: u64) -> Self {
        let counters = Arc::new(LinkCounters::default());
        Self {
            conversation: Conversation::new(dialect, scale, MS, now_ns, Arc::clone(&counters)),
            board,
            quality: Quality::default(),
            counters,
            now_ns,
            host_is_dead: false,
            sent: Vec::new(),
            lines: Lines::default(),
            up: Channel::new(3),
            down: Channel::new(4),
        }
    }

    /// A millisecond: the tick, and then the board's answers.
    pub(super) fn tick(&mut self, force_n: f64, enabled: bool) -> Result<Measurement, DeviceError> {
        let measured = self.listen();
        let mut text = Text::default();
        self.conversation.command(force_n, enabled, self.now_ns, &mut text);
        self.send(&text);
        for _ in 0..MS / STEP_NS {
            self.now_ns += STEP_NS;
            while let Some(line) = self.down.receive(self.now_ns) {
                for answer in self.board.receive(&line, self.now_ns) {
                    self.up.send(answer, &self.quality, self.now_ns);
                }
            }
            self.board.live_until(self.now_ns);
        }
        measured
    }

    /// Takes in the lines that came since.
    fn listen(&mut self) -> Result<Measurement, DeviceError> {
        while let Some(bytes) = self.up.receive(self.now_ns) {
            self.lines
                .take(&bytes, |line| self.conversation.take(line, self.now_ns));
        }
        self.conversation.measurement(self.now_ns)
    }

    fn send(&mut self, text: &Text) {
        if self.host_is_dead {
            return;
        }
        self.sent.extend(text.as_bytes());
        for line in text.as_bytes().split_inclusive(|byte| *byte == b'\n') {
            self.down.send(line.to_vec(), &self.quality, self.now_ns);
        }
    }

    /// A number of ticks that must not fail; the last sample.
    pub(super) fn ticks(&mut self, count: u32, force_n: f64, enabled: bool) -> Measurement {
        let mut tick = |k| {
            self.tick(force_n, enabled)
                .unwrap_or_else(|error| panic!("tick {k}: {error}"))
        };
        (0..count).map(&mut tick).last().expect("a tick")
    }

    /// A tick without force, whatever has failed, and a number of ticks that must not fail.
    pub(super) fn release(&mut self, count: u32) {
        self.tick(0.0, false).ok();
        self.ticks(count, 0.0, false);
    }

    /// Ticks until one fails, a number at most; which one, and how.
    pub(super) fn ticks_until_failure(&mut self, most: u32, force_n: f64, enabled: bool) -> Option<(u32, DeviceError)> {
        (1..=most).find_map(|k| self.tick(force_n, enabled).err().map(|error| (k, error)))
    }

    pub(super) fn count(&self, of: impl Fn(&LinkCounters) -> &AtomicU64) -> u64 {
        of(&self.counters).load(Relaxed)
    }
}

//! A line that fails on request, and the orders to the fake behind it.

use super::fault::{Channel, Fault, Quality, TimedFault};
use super::script::{Order, Script};
use crate::clock::now_ns;
use std::path::Path;
use std::time::Duration;

/// Both directions of a fake's line, with the faults of the line, and the script of the whole fake.
#[derive(Debug)]
pub struct FaultyLine {
    script: Script,
    quality: Quality,
    up: Channel,
    down: Channel,
    stalled_until_ns: u64,
    plug_in_at_ns: u64,
}

impl FaultyLine {
    /// A line with the faults of a command line and of a file, whose times count from now on. The
    /// same seed gives the same random faults.
    ///
    /// # Errors
    /// The file cannot be read, or a line of it is not a fault.
    pub fn new(faults: &[TimedFault], file: Option<&Path>, seed: u64) -> Result<Self, String> {
        Ok(Self {
            script: Script::new(faults, file, now_ns())?,
            quality: Quality::default(),
            up: Channel::new(seed),
            down: Channel::new(seed.wrapping_add(1)),
            stalled_until_ns: 0,
            plug_in_at_ns: 0,
        })
    }

    /// The next order that is due at a time, ns, and concerns the device: its own faults, and
    /// [`Fault::HangUp`], at which it leaves the line. The line takes its own faults itself.
    pub fn next_order(&mut self, now_ns: u64) -> Option<Order> {
        let after =
            |seconds: f64| now_ns + u64::try_from(Duration::from_secs_f64(seconds).as_nanos()).unwrap_or(u64::MAX / 2);
        loop {
            match self.script.next(now_ns)? {
                Order::Fail(fault) => match self.quality.take(fault) {
                    Ok(()) => {}
                    Err(Fault::Stall(seconds)) => self.stalled_until_ns = after(seconds),
                    Err(fault) => {
                        if let Fault::HangUp(seconds) = fault {
                            self.plug_in_at_ns = after(seconds);
                        }
                        return Some(Order::Fail(fault));
                    }
                },
                order => return Some(order),
            }
        }
    }

    /// Whether the device may be on the line: it is not hung up.
    #[must_use]
    pub fn may_plug_in(&self, now_ns: u64) -> bool {
        now_ns >= self.plug_in_at_ns
    }

    /// Whether the device stands still.
    #[must_use]
    pub fn is_stalled(&self, now_ns: u64) -> bool {
        now_ns < self.stalled_until_ns
    }

    /// Puts a frame of the device on the line.
    pub fn send_up(&mut self, frame: Vec<u8>, now_ns: u64) {
        // What the device takes slowly, it does not send slowly.
        let quality = Quality {
            ns_per_byte: 0.0,
            ..self.quality
        };
        self.up.send(frame, &quality, now_ns);
    }

    /// The next frame that has reached the host.
    pub fn receive_up(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        self.up.receive(now_ns)
    }

    /// Puts a frame of the host on the line.
    pub fn send_down(&mut self, frame: Vec<u8>, now_ns: u64) {
        self.down.send(frame, &self.quality, now_ns);
    }

    /// The next frame that has reached the device; none while that stands still.
    pub fn receive_down(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        if self.is_stalled(now_ns) {
            return None;
        }
        self.down.receive(now_ns)
    }

    /// When the next frame comes out, at the latest `by_ns`.
    #[must_use]
    pub fn next_due_ns(&self, now_ns: u64, by_ns: u64) -> u64 {
        let down = self.down.next_due_ns().filter(|_| !self.is_stalled(now_ns));
        [self.up.next_due_ns(), down]
            .into_iter()
            .flatten()
            .fold(by_ns, u64::min)
    }

    /// All frames on the line are lost.
    pub fn clear(&mut self) {
        self.up.clear();
        self.down.clear();
    }
}

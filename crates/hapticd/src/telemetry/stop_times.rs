//! The duration of stops: from the client's line to zero force on the link, and to the device's
//! confirmation that its motor is off.

use crate::rt::handoff::StopConfirmation;
use crate::rt::outbox::Answers;
use crate::telemetry::timing::{COARSE_DIGITS, histogram, percentiles};
use haptic_ipc::StopTimes as Report;
use hdrhistogram::Histogram;
use std::collections::VecDeque;

/// Most stops that are timed at once; beyond that the oldest are not timed.
const MAX_STOPS: usize = 1024;

/// Times of all stops since the daemon began.
#[derive(Debug)]
pub(super) struct StopTimes {
    /// The stops under way: number, and time at which the line was read, ns.
    under_way: VecDeque<(u64, u64)>,
    unconfirmed: u64,
    without_device: u64,
    written: Histogram<u64>,
    confirmed: Histogram<u64>,
}

impl Default for StopTimes {
    fn default() -> Self {
        Self {
            under_way: VecDeque::new(),
            unconfirmed: 0,
            without_device: 0,
            written: histogram(COARSE_DIGITS),
            confirmed: histogram(COARSE_DIGITS),
        }
    }
}

impl StopTimes {
    /// Begins to time a stop, from the time at which its line was read, ns.
    pub(super) fn begin(&mut self, stop: u64, read_ns: u64) {
        if self.under_way.len() == MAX_STOPS {
            self.under_way.pop_front();
        }
        self.under_way.push_back((stop, read_ns));
    }

    /// Times the stops that have ended.
    pub(super) fn pump(&mut self, answers: Answers) {
        while let Some(&(stop, read_ns)) = self.under_way.front() {
            let Some(stopped) = answers.stop(stop) else {
                return;
            };
            self.under_way.pop_front();
            let took = |at_ns: u64| at_ns.saturating_sub(read_ns).max(1);
            match stopped.confirmation {
                StopConfirmation::NoDevice => self.without_device += 1,
                StopConfirmation::Unconfirmed => {
                    self.unconfirmed += 1;
                    self.written.saturating_record(took(stopped.written_ns));
                }
                StopConfirmation::Confirmed => {
                    self.written.saturating_record(took(stopped.written_ns));
                    self.confirmed.saturating_record(took(stopped.confirmed_ns));
                }
            }
        }
    }

    /// The report for clients.
    pub(super) fn report(&self) -> Report {
        Report {
            confirmed: self.confirmed.len(),
            unconfirmed: self.unconfirmed,
            without_device: self.without_device,
            to_written_ns: percentiles(&self.written),
            to_confirmed_ns: percentiles(&self.confirmed),
        }
    }
}

//! The timing of the loop, from the records of its ticks: since it began, and over the last ten seconds; and the
//! duration of stops, from the client's line to zero force on the link, and to the device's confirmation that its motor
//! is off.
//!
//! The real-time thread only stamps its ticks; the histograms are kept here, on the control thread.

use crate::rt::handoff::StopConfirmation;
use crate::rt::outbox::{Answers, TickRecord};
use haptic_ipc::{Bucket, Percentiles, Timing, TimingHistogram, TimingWindow};
use hdrhistogram::Histogram;
use std::collections::VecDeque;

/// Longest duration of the histograms; longer ones count as this long.
const MAX_NS: u64 = 60_000_000_000;
/// Digits of durations that vary widely: one percent.
pub(crate) const COARSE_DIGITS: u8 = 2;
/// Digits of periods, which vary little: one part in a thousand.
const FINE_DIGITS: u8 = 3;
const WINDOW_S: usize = 10;

#[derive(Clone, Debug)]
struct Span {
    ticks: u64,
    overruns: u64,
    missed_periods: u64,
    dropped: u64,
    wake_latency: Histogram<u64>,
    tick: Histogram<u64>,
    device_round_trip: Histogram<u64>,
    period: Histogram<u64>,
}

/// A histogram of durations, ns.
pub(crate) fn histogram(digits: u8) -> Histogram<u64> {
    Histogram::new_with_bounds(1, MAX_NS, digits).expect("the bounds are constants that fit")
}

/// The usual percentiles of a histogram.
pub(crate) fn percentiles(histogram: &Histogram<u64>) -> Percentiles {
    let at = |quantile| histogram.value_at_quantile(quantile);
    Percentiles {
        p50: at(0.5),
        p99: at(0.99),
        p999: at(0.999),
        max: histogram.max(),
    }
}

/// Upper end of the first bucket, ns; each further bucket ends at twice the previous one.
pub(crate) const FIRST_BUCKET_NS: u64 = 64;

fn buckets(histogram: &Histogram<u64>) -> Vec<Bucket> {
    histogram
        .iter_log(FIRST_BUCKET_NS, 2.0)
        .map(|value| Bucket {
            up_to: value.value_iterated_to(),
            count: value.count_since_last_iteration(),
        })
        .collect()
}

impl Span {
    fn new() -> Self {
        Self {
            ticks: 0,
            overruns: 0,
            missed_periods: 0,
            dropped: 0,
            wake_latency: histogram(COARSE_DIGITS),
            tick: histogram(COARSE_DIGITS),
            device_round_trip: histogram(COARSE_DIGITS),
            period: histogram(FINE_DIGITS),
        }
    }

    fn add(&mut self, other: &Self) {
        self.ticks += other.ticks;
        self.overruns += other.overruns;
        self.missed_periods += other.missed_periods;
        self.dropped += other.dropped;
        for (to, from) in [
            (&mut self.wake_latency, &other.wake_latency),
            (&mut self.tick, &other.tick),
            (&mut self.device_round_trip, &other.device_round_trip),
            (&mut self.period, &other.period),
        ] {
            to.add(from).expect("all histograms have the same bounds");
        }
    }

    fn window(&self) -> TimingWindow {
        TimingWindow {
            ticks: self.ticks,
            overruns: self.overruns,
            missed_periods: self.missed_periods,
            telemetry_dropped: self.dropped,
            wake_latency_ns: percentiles(&self.wake_latency),
            tick_ns: percentiles(&self.tick),
            device_round_trip_ns: percentiles(&self.device_round_trip),
            period_ns: percentiles(&self.period),
            histogram: TimingHistogram {
                wake_latency_ns: buckets(&self.wake_latency),
                tick_ns: buckets(&self.tick),
            },
        }
    }
}

/// Most stops that are timed at once; beyond that the oldest are not timed.
const MAX_STOPS: usize = 1024;

/// Times of all stops since the daemon began.
#[derive(Debug)]
pub(crate) struct StopTimes {
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
    pub(crate) fn begin(&mut self, stop: u64, read_ns: u64) {
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
    fn report(&self) -> haptic_ipc::StopTimes {
        haptic_ipc::StopTimes {
            confirmed: self.confirmed.len(),
            unconfirmed: self.unconfirmed,
            without_device: self.without_device,
            to_written_ns: percentiles(&self.written),
            to_confirmed_ns: percentiles(&self.confirmed),
        }
    }
}

/// The counters of a late loop.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Counted {
    pub(crate) missed_periods: u64,
    /// Ticks that took longer than a period.
    pub(crate) overruns: u64,
}

/// Counts and histograms of the loop's timing.
#[derive(Debug)]
pub(crate) struct TimingRecorder {
    period_ns: u64,
    pub(crate) stops: StopTimes,
    total: Span,
    /// A span for each of the last seconds, the newest last.
    seconds: VecDeque<Span>,
    second: u64,
    last: Option<TickRecord>,
}

impl TimingRecorder {
    pub(crate) fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            stops: StopTimes::default(),
            total: Span::new(),
            seconds: VecDeque::from([Span::new()]),
            second: 0,
            last: None,
        }
    }

    pub(crate) fn record(&mut self, record: &TickRecord) {
        let second = record.began_ns / 1_000_000_000;
        if second != self.second {
            self.second = second;
            // The oldest span is reused, so that a steady run allocates nothing.
            let mut fresh = if self.seconds.len() >= WINDOW_S {
                self.seconds.pop_front().unwrap_or_else(Span::new)
            } else {
                Span::new()
            };
            fresh.clear();
            self.seconds.push_back(fresh);
        }
        let took = record.ended_ns.saturating_sub(record.began_ns);
        let overrun = took > self.period_ns;
        let (missed, dropped, ticks) = match &self.last {
            Some(last) => (
                record.missed_periods - last.missed_periods,
                record.dropped - last.dropped,
                record.tick - last.tick,
            ),
            None => (record.missed_periods, record.dropped, 1),
        };
        let late = record.began_ns.saturating_sub(record.deadline_ns);
        let newest = self.seconds.len() - 1;
        for span in [&mut self.total, &mut self.seconds[newest]] {
            span.ticks += ticks;
            span.overruns += u64::from(overrun);
            span.missed_periods += missed;
            span.dropped += dropped;
            span.wake_latency.saturating_record(late);
            span.tick.saturating_record(took);
            span.device_round_trip.saturating_record(record.device_round_trip_ns);
            if let Some(last) = &self.last
                && ticks == 1
            {
                span.period
                    .saturating_record(record.began_ns.saturating_sub(last.began_ns));
            }
        }
        self.last = Some(*record);
    }

    /// The counters of lateness since the loop began.
    pub(crate) fn counted(&self) -> Counted {
        Counted {
            missed_periods: self.total.missed_periods,
            overruns: self.total.overruns,
        }
    }

    /// How late the loop woke and how long its ticks took in the last seconds, ns. The whole report takes ten times as
    /// long, for its fine histogram of periods.
    pub(crate) fn recent(&self) -> (Percentiles, Percentiles) {
        let (mut late, mut tick) = (histogram(COARSE_DIGITS), histogram(COARSE_DIGITS));
        for second in &self.seconds {
            late.add(&second.wake_latency)
                .expect("all histograms have the same bounds");
            tick.add(&second.tick).expect("all histograms have the same bounds");
        }
        (percentiles(&late), percentiles(&tick))
    }

    pub(crate) fn report(&self) -> Timing {
        let mut recent = Span::new();
        for second in &self.seconds {
            recent.add(second);
        }
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let rate_hz = 1e9 / self.period_ns as f64;
        Timing {
            rate_hz,
            since_start: self.total.window(),
            last_10_s: recent.window(),
            link: None,
            stops: self.stops.report(),
        }
    }
}

impl Span {
    fn clear(&mut self) {
        (self.ticks, self.overruns, self.missed_periods, self.dropped) = (0, 0, 0, 0);
        for histogram in [
            &mut self.wake_latency,
            &mut self.tick,
            &mut self.device_round_trip,
            &mut self.period,
        ] {
            histogram.reset();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::outbox::tests::record;

    #[test]
    fn counts_are_exact_and_the_window_forgets() {
        let mut recorder = TimingRecorder::new(1_000_000);
        for tick in 0..30_000 {
            let mut one = record(tick);
            if tick == 100 {
                one.ended_ns = one.began_ns + 2_000_000; // an overrun, which misses two deadlines
            }
            if tick > 100 {
                one.missed_periods = 2;
            }
            recorder.record(&one);
        }
        let report = recorder.report();
        assert_eq!(report.rate_hz, 1000.0);
        let all = report.since_start;
        assert_eq!((all.ticks, all.overruns, all.missed_periods), (30_000, 1, 2));
        let counted = |buckets: &[Bucket]| buckets.iter().map(|bucket| bucket.count).sum::<u64>();
        assert_eq!(counted(&all.histogram.wake_latency_ns), 30_000);
        assert_eq!(counted(&all.histogram.tick_ns), 30_000);
        let late = all.histogram.tick_ns.last().expect("a bucket");
        assert!(late.count == 1 && late.up_to >= 1_990_000, "{late:?}");
        assert_eq!(all.wake_latency_ns.p50, 50);
        assert!((990..=1010).contains(&all.tick_ns.p50), "{all:?}");
        assert!(all.tick_ns.max >= 1_990_000, "{all:?}");
        assert!((990_000..=1_010_000).contains(&all.period_ns.p50), "{all:?}");
        let recent = report.last_10_s;
        assert_eq!((recent.ticks, recent.overruns), (10_000, 0), "the overrun is 29 s old");
    }

    #[test]
    fn lost_records_still_count_as_ticks() {
        let mut recorder = TimingRecorder::new(1_000_000);
        recorder.record(&record(0));
        let mut later = record(5);
        later.dropped = 4;
        recorder.record(&later);
        let all = recorder.report().since_start;
        assert_eq!((all.ticks, all.telemetry_dropped), (6, 4));
    }
}

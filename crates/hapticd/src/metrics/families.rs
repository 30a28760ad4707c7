//! The metrics themselves: names, units (seconds, newtons, joules, metres), and where each value comes from.

use crate::control::RigHandle;
use crate::telemetry::timing::FIRST_BUCKET_NS;
use haptic_core::servo::Fault;
use haptic_ipc::{Bucket, LinkStatus, RigState, Status, Timing};
use prometheus_client::collector::Collector;
use prometheus_client::encoding::{DescriptorEncoder, MetricEncoder, NoLabelSet};
use prometheus_client::metrics::MetricType;
use std::fmt;

/// Number of buckets of a histogram: those of `timing` up to a second, so that none is split.
const BUCKETS: u32 = 25;

/// What one scrape reports.
#[derive(Debug)]
pub(super) struct Snapshot {
    status: Status,
    timing: Timing,
    faults: [(&'static str, u64); Fault::KINDS.len()],
}

impl Snapshot {
    pub(super) fn of(rig: &RigHandle) -> Self {
        Self {
            status: rig.status_without_admission(),
            timing: rig.feed().timing_report(),
            faults: rig.faults(),
        }
    }
}

type Labels<'a> = [(&'static str, &'a str); 1];

/// Writes families of metrics.
struct Families<'a>(DescriptorEncoder<'a>);

impl Families<'_> {
    fn gauge(&mut self, name: &str, help: &str, value: f64) -> fmt::Result {
        self.0
            .encode_descriptor(name, help, None, MetricType::Gauge)?
            .encode_gauge(&value)
    }

    fn counter(&mut self, name: &str, help: &str, value: u64) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        family.encode_counter::<NoLabelSet, u64, f64>(&value, None)
    }

    /// A gauge for each value of a label.
    fn gauges<'l>(
        &mut self,
        name: &str,
        help: &str,
        label: &'static str,
        values: impl IntoIterator<Item = (&'l str, f64)>,
    ) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Gauge)?;
        for (which, value) in values {
            let labels: Labels<'_> = [(label, which)];
            labelled(&mut family, &labels)?.encode_gauge(&value)?;
        }
        Ok(())
    }

    /// A counter for each value of a label.
    fn counters<'l>(
        &mut self,
        name: &str,
        help: &str,
        label: &'static str,
        values: impl IntoIterator<Item = (&'l str, u64)>,
    ) -> fmt::Result {
        let mut family = self.0.encode_descriptor(name, help, None, MetricType::Counter)?;
        for (which, value) in values {
            let labels: Labels<'_> = [(label, which)];
            labelled(&mut family, &labels)?.encode_counter::<NoLabelSet, u64, f64>(&value, None)?;
        }
        Ok(())
    }

    /// A histogram of durations. Their sum is known to within a bucket: its middle stands for what is in it.
    fn durations(&mut self, name: &str, help: &str, found: &[Bucket]) -> fmt::Result {
        let ends: Vec<u64> = (0..BUCKETS).map(|step| FIRST_BUCKET_NS << step).collect();
        let mut counts = vec![0; ends.len() + 1];
        let (mut sum_s, mut count) = (0.0, 0);
        for bucket in found {
            // `timing` ends a bucket at the last whole nanosecond within it.
            let place = ends.partition_point(|&end| end < bucket.up_to);
            counts[place] += bucket.count;
            count += bucket.count;
            #[expect(clippy::cast_precision_loss, reason = "an estimate")]
            let middle_s = 0.75 * bucket.up_to as f64 * 1e-9;
            #[expect(clippy::cast_precision_loss, reason = "an estimate")]
            let of_them = bucket.count as f64;
            sum_s += middle_s * of_them;
        }
        #[expect(clippy::cast_precision_loss, reason = "powers of two")]
        let ends_s = ends.iter().map(|&end| end as f64 * 1e-9).chain([f64::INFINITY]);
        let buckets: Vec<(f64, u64)> = ends_s.zip(counts).collect();
        self.0
            .encode_descriptor(name, help, None, MetricType::Histogram)?
            .encode_histogram::<NoLabelSet>(sum_s, count, &buckets, None)
    }
}

fn labelled<'s>(family: &'s mut MetricEncoder<'_>, labels: &'s Labels<'_>) -> Result<MetricEncoder<'s>, fmt::Error> {
    family.encode_family(labels)
}

fn seconds(ns: u64) -> f64 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "beyond 2^53 ns, three months, a nanosecond is lost"
    )]
    let ns = ns as f64;
    ns * 1e-9
}

#[expect(clippy::cast_precision_loss, reason = "counts of clients")]
fn count(of: usize) -> f64 {
    of as f64
}

impl Collector for Snapshot {
    fn encode(&self, encoder: DescriptorEncoder<'_>) -> fmt::Result {
        let mut families = Families(encoder);
        self.rig(&mut families)?;
        self.timing(&mut families)?;
        match &self.timing.link {
            Some(link) => self::link(&mut families, link),
            None => Ok(()),
        }
    }
}

impl Snapshot {
    fn rig(&self, families: &mut Families<'_>) -> fmt::Result {
        let status = &self.status;
        let version = status.server.strip_prefix("hapticd ").unwrap_or(&status.server);
        families.gauges(
            "hapticd_build_info",
            "Version of the daemon.",
            "version",
            [(version, 1.0)],
        )?;
        let states: Vec<(String, f64)> = RigState::ALL
            .iter()
            .map(|state| (state.to_string(), f64::from(u8::from(*state == status.state))))
            .collect();
        families.gauges(
            "hapticd_state",
            "State of the rig: 1 for the one that it is in.",
            "state",
            states.iter().map(|(name, value)| (name.as_str(), *value)),
        )?;
        families.counters(
            "hapticd_faults",
            "Times that a check took the force away, by its code.",
            "code",
            self.faults,
        )?;
        families.gauge(
            "hapticd_uptime_seconds",
            "Time since the daemon began.",
            status.uptime_s,
        )?;
        families.gauge(
            "hapticd_force_newtons",
            "Force on the hand, as commanded.",
            status.force_on_hand_n(),
        )?;
        families.gauge(
            "hapticd_force_limit_newtons",
            "Largest force that may be commanded.",
            status.device.force_limit_n,
        )?;
        families.gauge(
            "hapticd_energy_excess_joules",
            "Energy that sampling made and the rig did not take up.",
            status.energy_excess_j,
        )?;
        // Without a device it would be where the handle once was.
        if status.has_device() {
            families.gauge(
                "hapticd_position_meters",
                "Position of the handle.",
                status.device_position_m,
            )?;
        }
        families.gauge("hapticd_clients", "Clients that are connected.", count(status.clients))?;
        families.gauge("hapticd_leases", "Leases that clients hold.", count(status.leases))?;
        families.gauge(
            "hapticd_real_time_problems",
            "Rights that the real-time thread lacks; haptic-ctl status names them.",
            count(status.real_time.problems.len()),
        )?;
        families.counter(
            "hapticd_scene_changes",
            "Changes of the scene.",
            status.revision.saturating_sub(1),
        )
    }

    fn timing(&self, families: &mut Families<'_>) -> fmt::Result {
        let timing = &self.timing.since_start;
        families.gauge("hapticd_rate_hertz", "Nominal rate of the loop.", self.timing.rate_hz)?;
        families.counter("hapticd_ticks", "Ticks of the loop.", timing.ticks)?;
        families.counter(
            "hapticd_missed_periods",
            "Periods in which no tick began.",
            timing.missed_periods,
        )?;
        families.counter(
            "hapticd_overruns",
            "Ticks that took longer than a period.",
            timing.overruns,
        )?;
        families.counter(
            "hapticd_telemetry_dropped",
            "Records of ticks that the control thread came too late for.",
            timing.telemetry_dropped,
        )?;
        families.durations(
            "hapticd_wake_latency_seconds",
            "From the time at which a tick was due to its beginning.",
            &timing.histogram.wake_latency_ns,
        )?;
        families.durations("hapticd_tick_seconds", "Duration of a tick.", &timing.histogram.tick_ns)?;
        let stops = &self.timing.stops;
        families.counters(
            "hapticd_stops",
            "Stops, by what the device answered.",
            "outcome",
            [
                ("confirmed", stops.confirmed),
                ("unconfirmed", stops.unconfirmed),
                ("without_device", stops.without_device),
            ],
        )?;
        // Before the first stop they are of none.
        for (name, help, count, times) in [
            (
                "hapticd_stop_written_seconds",
                "From a stop's line to zero force on the link; none before a stop.",
                stops.confirmed + stops.unconfirmed,
                stops.to_written_ns,
            ),
            (
                "hapticd_stop_confirmed_seconds",
                "From a stop's line to the device's word that its motor is off; none before a stop.",
                stops.confirmed,
                stops.to_confirmed_ns,
            ),
        ] {
            let percentiles = [("50", times.p50), ("99", times.p99), ("100", times.max)];
            let known = percentiles.into_iter().filter(|_| count > 0);
            families.gauges(
                name,
                help,
                "percentile",
                known.map(|(percentile, ns)| (percentile, seconds(ns))),
            )?;
        }
        Ok(())
    }
}

fn link(families: &mut Families<'_>, link: &LinkStatus) -> fmt::Result {
    let connected = f64::from(u8::from(link.device.is_some()));
    families.gauge("hapticd_link_connected", "Whether a device is connected.", connected)?;
    // Without a device they would be of the one that is gone.
    if link.device.is_some() {
        families.gauge(
            "hapticd_link_round_trip_seconds",
            "Command to answer, on average.",
            link.round_trip_us * 1e-6,
        )?;
        families.gauge(
            "hapticd_link_round_trip_max_seconds",
            "Command to answer, at most.",
            link.round_trip_max_us * 1e-6,
        )?;
        families.gauge(
            "hapticd_link_sample_age_seconds",
            "Age of the newest sample when it was used; none without a device.",
            link.age_us * 1e-6,
        )?;
    }
    if let Some(drift_ppm) = link.clock_drift_ppm {
        families.gauge(
            "hapticd_link_clock_drift_ratio",
            "How much faster the device's clock runs than ours.",
            drift_ppm * 1e-6,
        )?;
    }
    let counts = link.counts;
    families.counters(
        "hapticd_link_events",
        "What came over the link, and what went wrong on it, by kind.",
        "kind",
        [
            ("sample", counts.samples),
            ("lost", counts.lost),
            ("sequence_jump", counts.sequence_jumps),
            ("bad_crc", counts.bad_crc),
            ("malformed", counts.malformed),
            ("out_of_sequence", counts.out_of_sequence),
            ("late", counts.late),
            ("not_sent", counts.not_sent),
            ("clipped", counts.clipped),
            ("connection", counts.connections),
            ("device_error", counts.device_errors),
        ],
    )
}

//! The device's clock as seen from ours: its 32-bit stamps made endless, the age of a sample, and
//! the drift between the two clocks.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

/// Length of a window, in which the quickest sample counts, ns.
const WINDOW_NS: u64 = 1_000_000_000;
/// Windows over which the drift is taken.
const WINDOWS: usize = 16;
/// Largest drift that is believed, parts in 1e9: no real clock is further off.
const MAX_DRIFT_PPB: i64 = 100_000_000;
/// Largest change of the clocks' difference from one sample to the next, ns: a sample may take so
/// much longer than another. A larger change is a jump of the device's clock.
const JUMP_NS: u64 = 100_000_000;
/// Fewest windows for a drift.
const MIN_WINDOWS: usize = 4;

/// The difference of the clocks in one window: at its quickest sample, the first of several.
#[derive(Clone, Copy, Debug, Default)]
struct QuickestSample {
    host_ns: u64,
    /// Our time less the device's, ns. It contains the quickest transfer from the device to us, which
    /// cannot be distinguished.
    offset_ns: i64,
}

/// The device's clock.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeviceClock {
    last_us: Option<u32>,
    device_ns: u64,
    window_began_ns: u64,
    current: Option<QuickestSample>,
    windows: [QuickestSample; WINDOWS],
    /// Number of windows that have ended; the ring holds the last of them.
    ended: usize,
    /// Drift over the windows of the ring; it changes only when one ends.
    drift_ppb: Option<i64>,
}

fn signed(ns: u64) -> i64 {
    i64::try_from(ns).unwrap_or(i64::MAX)
}

impl DeviceClock {
    /// Takes in the stamp of a newer sample, read at a time of ours; returns the device's time
    /// since the first one, ns.
    pub(crate) fn stamp(&mut self, time_us: u32, host_ns: u64) -> u64 {
        let elapsed_us = self
            .last_us
            .replace(time_us)
            .map_or(0, |last| time_us.wrapping_sub(last));
        self.device_ns += u64::from(elapsed_us) * 1000;
        let seen = QuickestSample {
            host_ns,
            offset_ns: signed(host_ns) - signed(self.device_ns),
        };
        if self
            .current
            .is_some_and(|quickest| seen.offset_ns.abs_diff(quickest.offset_ns) > JUMP_NS)
        {
            // All that was known is of another clock, so to speak.
            self.forget();
        }
        if self.current.is_none() {
            self.window_began_ns = host_ns;
        } else if host_ns.saturating_sub(self.window_began_ns) >= WINDOW_NS {
            self.window_began_ns = host_ns;
            if let Some(quickest) = self.current.take() {
                self.windows[self.ended % WINDOWS] = quickest;
                self.ended += 1;
                self.drift_ppb = self.drift_over_windows();
            }
        }
        if self.current.is_none_or(|quickest| seen.offset_ns < quickest.offset_ns) {
            self.current = Some(seen);
        }
        self.device_ns
    }

    /// Begins to compare the clocks again.
    fn forget(&mut self) {
        (self.current, self.ended, self.drift_ppb) = (None, 0, None);
    }

    /// Our time less the device's at the quickest recent sample, ns.
    fn offset_ns(&self) -> Option<i64> {
        let current = self.current.map(|quickest| quickest.offset_ns);
        let before = self
            .ended
            .checked_sub(1)
            .map(|last| self.windows[last % WINDOWS].offset_ns);
        match (current, before) {
            (Some(current), Some(before)) => Some(current.min(before)),
            (current, before) => current.or(before),
        }
    }

    /// Age of a sample of the device's time at a time of ours, beyond the transfer of the quickest
    /// samples, ns.
    pub(crate) fn age_ns(&self, device_ns: u64, host_ns: u64) -> u64 {
        let Some(offset_ns) = self.offset_ns() else {
            return 0;
        };
        u64::try_from(signed(host_ns) - signed(device_ns) - offset_ns).unwrap_or(0)
    }

    /// Drift of the device's clock against ours, parts in 1e9, positive where it is faster; nothing
    /// until it is known.
    pub(crate) fn drift_ppb(&self) -> Option<i64> {
        self.drift_ppb
    }

    fn drift_over_windows(&self) -> Option<i64> {
        if self.ended < MIN_WINDOWS {
            return None;
        }
        let (oldest, newest) = (self.ended.saturating_sub(WINDOWS), self.ended - 1);
        let (from, to) = (self.windows[oldest % WINDOWS], self.windows[newest % WINDOWS]);
        let elapsed_ns = signed(to.host_ns.checked_sub(from.host_ns)?);
        // The faster its clock, the smaller our lead.
        let gained_ns = i128::from(from.offset_ns - to.offset_ns);
        let drift_ppb = gained_ns * 1_000_000_000 / i128::from(elapsed_ns.max(1));
        i64::try_from(drift_ppb)
            .ok()
            .filter(|drift_ppb| drift_ppb.abs() <= MAX_DRIFT_PPB)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: P14
    #[test]
    fn the_stamp_wraps_around_and_time_goes_on() {
        let mut clock = DeviceClock::default();
        assert_eq!(clock.stamp(u32::MAX - 499, 1_000_000), 0);
        assert_eq!(clock.stamp(500, 2_000_000), 1_000_000);
        assert_eq!(clock.stamp(1500, 3_000_000), 2_000_000);
    }

    /// A clock that has run alongside ours for 10 s, and the time of its last sample on ours, ns.
    fn known_clock() -> (DeviceClock, u64) {
        let mut clock = DeviceClock::default();
        for k in 0..10_000 {
            clock.stamp(k * 1000, BEGAN_NS + u64::from(k) * 1_000_000);
        }
        assert_eq!(clock.drift_ppb(), Some(0));
        (clock, BEGAN_NS + 9_999 * 1_000_000)
    }

    const BEGAN_NS: u64 = 7_000_000_000;

    #[test]
    fn a_jump_makes_no_sample_old_and_no_drift_is_known() {
        // 0.2 s in 10 s would look like a drift that a bad clock has. A jump back looks like one almost all around.
        for jump_us in [200_000, 1 << 31, 0_u32.wrapping_sub(5_000_000)] {
            let (mut clock, mut host_ns) = known_clock();
            let mut device_us = jump_us.wrapping_add(9_999_000);
            for k in 0..=5000 {
                host_ns += 1_000_000;
                device_us = device_us.wrapping_add(1000);
                let device_ns = clock.stamp(device_us, host_ns);
                assert!(
                    clock.age_ns(device_ns, host_ns) < 1_000_000,
                    "{k} ms after {jump_us} us"
                );
                let known = (k >= 4000).then_some(0);
                assert_eq!(clock.drift_ppb(), known, "{k} ms after {jump_us} us");
            }
        }
    }

    #[test]
    fn sample_quicker_by_up_to_jump_limit_keeps_drift() {
        for (more_ns, known) in [(0, Some(0)), (1, None)] {
            let (mut clock, host_ns) = known_clock();
            let host_ns = host_ns + 1_000_000 - more_ns;
            clock.stamp(10_000_000 + 100_000, host_ns);
            assert_eq!(clock.drift_ppb(), known, "{more_ns} ns beyond a jump");
        }
    }

    #[test]
    fn of_equally_quick_samples_the_first_counts() {
        let mut clock = DeviceClock::default();
        // Two samples a window. Those of the first three come equally quick; the first of the
        // fourth shows that the clock has gained 0.3 ms in the 3 s since the very first.
        for (half_s, gained_us) in (0..).zip([0, 0, 0, 0, 0, 0, 300, 200, 200]) {
            assert_eq!(clock.drift_ppb(), None);
            let stamp_us = half_s * 500_000 + gained_us;
            clock.stamp(stamp_us, BEGAN_NS + u64::from(half_s) * 500_000_000);
        }
        assert_eq!(clock.drift_ppb(), Some(100_000));
    }

    #[test]
    fn drift_covers_the_last_sixteen_windows() {
        let mut clock = DeviceClock::default();
        let mut device_us = 0.0_f64;
        // 30 s, from the thirteenth on 100 ppm fast.
        for k in 0..30_000_u32 {
            device_us += if k < 12_000 { 1000.0 } else { 1000.1 };
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "30 s in us")]
            clock.stamp(device_us as u32, 7_000_000_000 + u64::from(k) * 1_000_000);
            // A window of a second ends with the first sample after it.
            let seconds = k / 1000;
            assert_eq!(clock.drift_ppb().is_some(), seconds >= 4, "sample {k}");
            if k == 24_500 {
                // Of the sixteen windows from the 9th to the 24th four are before the change.
                let drift = clock.drift_ppb().expect("known");
                assert!((70_000..85_000).contains(&drift), "{drift} ppb");
            }
        }
        let drift = clock.drift_ppb().expect("known");
        assert!((98_000..102_000).contains(&drift), "{drift} ppb: all are after it");
    }

    #[test]
    fn drift_and_age_show_through_jitter() {
        let mut clock = DeviceClock::default();
        let mut noise = 12345_u32;
        for k in 0..20_000_u64 {
            noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            // One sample in a hundred comes at once, the others up to 0.9 ms late. Its clock is 50
            // ppm fast.
            let late_ns = u64::from(k % 100 != 7) * (u64::from(noise >> 8) % 900_000);
            let device_us = k * 1000 + k / 20;
            let sent_ns = 7_000_000_000 + k * 1_000_000;
            let stamp = clock.stamp(u32::try_from(device_us).expect("less than an hour"), sent_ns + late_ns);
            if k > 1000 {
                let age = clock.age_ns(stamp, sent_ns + late_ns);
                let error = i64::try_from(age).expect("short") - i64::try_from(late_ns).expect("short");
                assert!((-10_000..120_000).contains(&error), "{k}: {age} ns for {late_ns} ns");
            }
        }
        let drift = clock.drift_ppb().expect("20 s are enough");
        assert!((49_000..51_000).contains(&drift), "{drift}");
        assert_eq!(DeviceClock::default().drift_ppb(), None);
    }
}

//! The time of a rig in this process, which lives from one read to the next.

/// Most steps between two reads: after a stall the steps grow instead of their number.
const MAX_SUB_STEPS: f64 = 1000.0;

/// The time of a rig, which begins with its first read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RigTime {
    started_ns: Option<u64>,
    last_ns: u64,
}

impl RigTime {
    /// Goes on to a time of its reader, ns. Returns how much later that is, s, and the time since it began, s.
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    pub(super) fn go_on(&mut self, now_ns: u64) -> (f64, f64) {
        let started = *self.started_ns.get_or_insert(now_ns);
        let now_ns = now_ns.saturating_sub(started);
        let elapsed_s = now_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = self.last_ns.max(now_ns);
        (elapsed_s, now_ns as f64 * 1e-9)
    }

    /// The latest time since it began, ns.
    pub(super) fn ns(self) -> u64 {
        self.last_ns
    }
}

/// Equal steps of at most `longest_s` seconds that end at `now_s`: the length of each, s, and the time of its middle,
/// s.
pub(super) fn sub_steps(elapsed_s: f64, now_s: f64, longest_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let steps = (elapsed_s / longest_s).ceil().min(MAX_SUB_STEPS);
    let h = elapsed_s / steps;
    let middles = std::iter::successors(Some(now_s - elapsed_s + 0.5 * h), move |middle_s| Some(middle_s + h));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 1000")]
    middles.take(steps as usize).map(move |middle_s| (h, middle_s))
}

//! What the control thread does again and again, beside all else.

use std::time::Duration;
use tokio::time::{Interval, MissedTickBehavior, interval};

/// A tick now, and then one each period. After a time in which the thread was held up there is one, not all that were
/// missed: those would come at once, and a stop would wait for the work of each.
pub(crate) fn every(period: Duration) -> Interval {
    let mut ticks = interval(period);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    ticks
}

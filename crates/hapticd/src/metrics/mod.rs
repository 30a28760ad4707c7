//! What monitoring sees of the daemon: OpenMetrics, on an address and in a file.
//!
//! Nothing is counted for it: a scrape takes what `status` and `timing` report, so it costs nothing where nobody asks.

mod families;
mod file;
mod http;

pub(crate) use file::keep;
pub(crate) use http::{MetricsError, Server};

use crate::control::RigHandle;
use families::Snapshot;
use prometheus_client::registry::Registry;

/// All metrics, as text.
fn text(rig: &RigHandle) -> String {
    let mut registry = Registry::default();
    registry.register_collector(Box::new(Snapshot::of(rig)));
    let mut text = String::new();
    prometheus_client::encoding::text::encode(&mut text, &registry).expect("a string takes all");
    text
}

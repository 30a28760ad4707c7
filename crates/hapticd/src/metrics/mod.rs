//! What monitoring sees of the daemon: OpenMetrics, on an address and in a file.
//!
//! Nothing is counted for it: a scrape takes what `status` and `timing` report, so it costs nothing where nobody asks.

mod families;
mod file;
mod http;

pub(crate) use file::{keep, remove};
pub(crate) use http::{MetricsError, Server};

use crate::control::RigHandle;
use families::Snapshot;
use prometheus_client::registry::Registry;

/// All metrics, as OpenMetrics.
fn openmetrics(rig: &RigHandle) -> String {
    let mut registry = Registry::default();
    registry.register_collector(Box::new(Snapshot::of(rig)));
    let mut text = String::new();
    prometheus_client::encoding::text::encode(&mut text, &registry).expect("a string takes all");
    text
}

/// The same in the text format of Prometheus, which node_exporter and promtool read: a counter's family has the name
/// of its series there, and there is no mark at the end.
fn prometheus_text(openmetrics: &str) -> String {
    let mut text = String::with_capacity(openmetrics.len() + 256);
    let mut help = "";
    for line in openmetrics.lines() {
        if let Some(about) = line.strip_prefix("# HELP ") {
            help = about;
            continue;
        }
        let Some(family) = line.strip_prefix("# TYPE ") else {
            if line != "# EOF" {
                text.push_str(line);
                text.push('\n');
            }
            continue;
        };
        let (name, kind) = family.split_once(' ').unwrap_or((family, "untyped"));
        let suffix = if kind == "counter" { "_total" } else { "" };
        let about = help.strip_prefix(name).unwrap_or_default();
        text.push_str(&format!("# HELP {name}{suffix}{about}\n# TYPE {name}{suffix} {kind}\n"));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_counters_family_is_named_as_its_series() {
        let given = "# HELP a Gauge.\n# TYPE a gauge\na{x=\"# EOF\"} 1\n# HELP b Counter.\n# TYPE b counter\nb_total 2\n# EOF\n";
        let expected = "# HELP a Gauge.\n# TYPE a gauge\na{x=\"# EOF\"} 1\n# HELP b_total Counter.\n# TYPE b_total counter\nb_total 2\n";
        assert_eq!(prometheus_text(given), expected);
    }
}

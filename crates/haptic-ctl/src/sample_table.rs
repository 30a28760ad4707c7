//! A sample as a row of a table for people.

use haptic_ipc::Sample;

/// The heading of the table.
pub(crate) fn header() -> String {
    format!(
        "{:>10} {:>9}  {:<12} {:<8} {:>11} {:>11} {:>10} {:>9} {:>9}",
        "tick", "t s", "state", "contact", "device mm", "block mm", "device m/s", "block m/s", "force N"
    )
}

/// A contact in words.
pub(crate) const fn contact(direction: i8) -> &'static str {
    match direction {
        0 => "stuck",
        1.. => "slides +",
        _ => "slides -",
    }
}

/// The row of a sample.
pub(crate) fn row(sample: &Sample) -> String {
    format!(
        "{:>10} {:>9.3}  {:<12} {:<8} {:>11.3} {:>11.3} {:>10.4} {:>9.4} {:>9.3}",
        sample.tick,
        sample.t_s,
        sample.state,
        contact(sample.contact),
        sample.device_position_m * 1e3,
        sample.block_position_m * 1e3,
        sample.device_velocity_mps,
        sample.block_velocity_mps,
        sample.command_force_n
    )
}

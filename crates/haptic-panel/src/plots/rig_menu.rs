//! What the device says of itself, and the limits that hold for it.

use crate::daemon::Daemon;
use egui::containers::menu::MenuButton;
use egui::{Grid, RichText, Ui};
use haptic_ipc::{ForceLimitBy, Status};

const UM_PER_M: f64 = 1e6;

pub(super) fn show(ui: &mut Ui, daemon: &Daemon) {
    let (button, _) = MenuButton::new("Rig").ui(ui, |ui| {
        let Some(status) = daemon.mirror.status.as_ref().filter(|_| daemon.is_connected()) else {
            ui.label("The daemon has not described its rig yet");
            return;
        };
        Grid::new("rig").num_columns(2).show(ui, |ui| {
            for (name, value) in lines(status) {
                ui.label(RichText::new(name).small().weak());
                ui.label(RichText::new(value).small());
                ui.end_row();
            }
        });
    });
    button.on_hover_text("The device's own settings and limits, as reported by the daemon");
}

/// Names and values, with units.
fn lines(status: &Status) -> Vec<(&'static str, String)> {
    let device = &status.device;
    let limited_by = match device.force_limit_by {
        ForceLimitBy::Configuration => ", by the daemon's configuration",
        ForceLimitBy::Device => ", by the device",
        _ => "",
    };
    let mut lines = vec![
        ("Device", device.description.clone()),
        ("Force limit", format!("{} N{limited_by}", device.force_limit_n)),
        ("Force changes by at most", format!("{} N/s", device.slew_limit_n_per_s)),
        ("Force is taken away above", format!("{} m/s", device.speed_limit_mps)),
        ("and above", format!("{} m/s²", device.acceleration_limit_mps2)),
        ("Loop", format!("{} Hz", status.rate_hz)),
    ];
    let Some(link) = &device.link else { return lines };
    if let Some(linked) = &link.device {
        let watchdog = linked
            .watchdog_ms
            .map_or_else(|| "none known".to_owned(), |watchdog_ms| format!("{watchdog_ms} ms"));
        lines.extend([
            ("Firmware", linked.firmware.clone()),
            ("Its own force limit", format!("{} N", linked.force_limit_n)),
            ("Samples", format!("{} Hz", linked.sample_rate_hz)),
            ("Encoder", format!("{} µm a count", linked.resolution_m * UM_PER_M)),
            ("Watchdog", watchdog),
        ]);
        lines.extend(linked.rig.clone().map(|rig| ("Key", rig)));
    }
    let round_trip = format!("{:.0} µs, at most {:.0} µs", link.round_trip_us, link.round_trip_max_us);
    lines.push(("Round trip", round_trip));
    lines.extend(link.clock_drift_ppm.map(|ppm| ("Clock drift", format!("{ppm:.1} ppm"))));
    let counts = &link.counts;
    let lost = format!(
        "{} of {} lost, {} late, {} with a wrong CRC",
        counts.lost, counts.samples, counts.late, counts.bad_crc
    );
    lines.push(("Samples on the link", lost));
    lines.extend(link.waiting.clone().map(|why| ("Waiting", why)));
    lines
}

//! The timing of the loop, losses, the link to the rig, and the share of time at the force limit.

use super::Daemon;
use super::histogram;
use crate::tape::signal::duration_us;
use crate::tapes::CLIPPING_OVER_S;
use crate::theme::Palette;
use egui::{Align, Layout, RichText, Sense, TextStyle, Ui, UiBuilder, vec2};
use haptic_ipc::{LinkStatus, Timing, TimingWindow};

/// A figure, in the caution colour if it is bad.
fn count(ui: &mut Ui, text: String, is_clean: bool, hint: &str) {
    let mut text = RichText::new(text).small();
    if !is_clean {
        text = text.color(Palette::of(ui).caution_text);
    }
    ui.label(text).on_hover_text(hint);
}

/// Height of the window below which the histograms would leave no room for the plots, points.
const LOWEST: f32 = 560.0;

/// Shows the lines, and the histograms above them if the user wants them. `clipping` is the share of
/// time at the force limit.
pub(crate) fn show(ui: &mut Ui, daemon: &Daemon, clipping: Option<f64>, histograms_shown: &mut bool) {
    let height = ui.ctx().content_rect().height();
    let has_room = height >= LOWEST;
    let shows = has_room && *histograms_shown;
    if let Some(timing) = daemon.mirror.timing.as_ref().filter(|_| shows) {
        show_histograms(ui, &timing.last_10_s);
    }
    ui.with_layout(Layout::right_to_left(Align::Min), |ui| {
        let toggle = egui::Button::selectable(shows, RichText::new("Histograms").small()).frame_when_inactive(true);
        if ui
            .add_enabled(has_room, toggle)
            .on_hover_text("How long wake-ups and ticks took")
            .on_disabled_hover_text("The window is too small for histograms")
            .clicked()
        {
            *histograms_shown = !shows;
        }
        ui.with_layout(Layout::top_down(Align::Min), |ui| {
            show_lines(ui, daemon, clipping);
        });
    });
}

fn show_histograms(ui: &mut Ui, window: &TimingWindow) {
    let width = (ui.available_width() - ui.spacing().item_spacing.x) / 2.0;
    ui.horizontal(|ui| {
        let buckets = &window.histogram;
        histogram::show(ui, "Wake-up", &buckets.wake_latency_ns, &window.wake_latency_ns, width);
        histogram::show(ui, "Tick", &buckets.tick_ns, &window.tick_ns, width);
    });
}

/// The share of time at the force limit, as a bar and in percent.
fn show_clipping(ui: &mut Ui, share: f64) {
    let palette = Palette::of(ui);
    let text = format!("At the force limit {:.1} %", share * 100.0);
    let hint = format!(
        "Share of the last {CLIPPING_OVER_S} s with force on in which it was cut: the hand felt less than the scene \
         asks for"
    );
    count(ui, text, share == 0.0, &hint);
    let (bar, _) = ui.allocate_exact_size(vec2(48.0, 8.0), Sense::hover());
    ui.painter().rect_filled(bar, 2, ui.visuals().extreme_bg_color);
    #[expect(clippy::cast_possible_truncation, reason = "a share is drawn")]
    let filled = bar.with_max_x(bar.left() + bar.width() * share as f32);
    ui.painter().rect_filled(filled, 2, palette.caution);
}

/// A line that keeps its height, so that nothing above it moves when a figure grows: what has no room is cut off.
fn show_line(ui: &mut Ui, figures: impl FnOnce(&mut Ui)) {
    let height = ui.text_style_height(&TextStyle::Small);
    let (line, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let layout = Layout::left_to_right(Align::Center);
    let mut child = ui.new_child(UiBuilder::new().max_rect(line).layout(layout));
    child.shrink_clip_rect(line);
    child.spacing_mut().item_spacing.x = 18.0;
    figures(&mut child);
}

/// A count in at most six places, and all of its digits in the hint.
fn show_count(ui: &mut Ui, name: &str, number: u64, is_clean: bool, hint: &str) {
    let digits = match number {
        0..100_000 => number.to_string(),
        100_000..100_000_000 => format!("{}k", number / 1000),
        _ => format!("{}M", number / 1_000_000),
    };
    count(
        ui,
        format!("{name} {digits}"),
        is_clean,
        &format!("{hint} ({number} in all)"),
    );
}

fn show_lines(ui: &mut Ui, daemon: &Daemon, clipping: Option<f64>) {
    if daemon.has_link_line() {
        let link = daemon.mirror.timing.as_ref().and_then(|timing| timing.link.as_ref());
        show_line(ui, |ui| {
            if let Some(link) = link {
                show_link(ui, link);
            }
        });
    }
    show_line(ui, |ui| {
        let Some(timing) = &daemon.mirror.timing else {
            count(
                ui,
                "No timing received yet".to_owned(),
                true,
                "The daemon reports once a second",
            );
            return;
        };
        show_loop(ui, timing);
        let dropped = timing
            .since_start
            .telemetry_dropped
            .saturating_add(daemon.mirror.lost_rows);
        show_count(
            ui,
            "Dropped samples",
            dropped,
            dropped == 0,
            "Samples that never reached this panel; the force on the hand is not affected",
        );
        if let Some(share) = clipping {
            show_clipping(ui, share);
        }
        if daemon.unreadable > 0 {
            let why = &daemon.unreadable_reason;
            show_count(ui, "Unreadable lines", daemon.unreadable, false, why);
        }
    });
}

fn show_loop(ui: &mut Ui, timing: &Timing) {
    let (all, recent) = (&timing.since_start, &timing.last_10_s);
    let p50_us = duration_us(recent.tick_ns.p50);
    let max_us = duration_us(recent.tick_ns.max);
    count(
        ui,
        format!("Loop {} Hz", timing.rate_hz),
        true,
        "Nominal rate of the loop",
    );
    count(
        ui,
        format!("Tick p50 {p50_us:.1} µs, max {max_us:.1} µs"),
        true,
        "How long a tick took in the last 10 s, the device's read and write included",
    );
    for (name, all, recent, hint) in [
        (
            "Overruns",
            all.overruns,
            recent.overruns,
            "Ticks that took longer than their period",
        ),
        (
            "Missed periods",
            all.missed_periods,
            recent.missed_periods,
            "Deadlines that passed without a tick",
        ),
    ] {
        show_count(
            ui,
            name,
            all,
            recent == 0,
            &format!("{hint}: {recent} in the last 10 s"),
        );
    }
}

fn show_link(ui: &mut Ui, link: &LinkStatus) {
    let Some(device) = &link.device else {
        let why = link.waiting.as_deref().unwrap_or("no device");
        count(
            ui,
            format!("Link: {why}"),
            false,
            "The rig is not connected, and gets no force",
        );
        return;
    };
    count(
        ui,
        format!("Link {}", device.firmware),
        true,
        "What the rig's firmware calls itself",
    );
    count(
        ui,
        format!(
            "Round trip {:.2} ms, longest {:.1} ms",
            link.round_trip_us * 1e-3,
            link.round_trip_max_us * 1e-3
        ),
        true,
        "From sending a command to hearing a sample that knows it",
    );
    count(
        ui,
        format!("Newest sample {:.2} ms old", link.age_us * 1e-3),
        true,
        "Beyond what the quickest samples take to come",
    );
    let counts = &link.counts;
    for (name, number, hint) in [
        (
            "Lost",
            counts.lost,
            "Samples that never came, or came after a newer one",
        ),
        (
            "Bad CRC",
            counts.bad_crc,
            "Frames that were damaged on their way; none of them was used",
        ),
        (
            "Late",
            counts.late,
            "Samples that came more than a period later than they should",
        ),
    ] {
        show_count(ui, name, number, number == 0, hint);
    }
    if let Some(ppm) = link.clock_drift_ppm {
        count(
            ui,
            format!("Device clock {ppm:+.1} ppm"),
            ppm.abs() < 1000.0,
            "How much faster the device's clock runs than this computer's",
        );
    }
}

//! One line on how well the loop keeps time and what was lost on the way here.

use crate::model::Model;
use crate::theme::Palette;
use egui::{RichText, Ui};

/// Shows the line.
pub(crate) fn show(ui: &mut Ui, model: &Model) {
    let palette = Palette::of(ui);
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 18.0;
        let count = |ui: &mut Ui, text: String, is_clean: bool, hint: &str| {
            let mut text = RichText::new(text).small();
            if !is_clean {
                text = text.color(palette.caution_text);
            }
            ui.label(text).on_hover_text(hint);
        };
        let Some(timing) = model.timing() else {
            count(
                ui,
                "No timing heard of yet".to_owned(),
                true,
                "The daemon reports once a second",
            );
            return;
        };
        let (all, recent) = (&timing.since_start, &timing.last_10_s);
        let p50_us = nanoseconds_to_microseconds(recent.tick_ns.p50);
        let max_us = nanoseconds_to_microseconds(recent.tick_ns.max);
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
            let recently = if recent == 0 {
                String::new()
            } else {
                format!(" ({recent} in the last 10 s)")
            };
            count(ui, format!("{name} {all}{recently}"), recent == 0, hint);
        }
        let dropped = all.telemetry_dropped.saturating_add(model.losses().rows);
        count(
            ui,
            format!("Dropped samples {dropped}"),
            dropped == 0,
            "Samples that never reached this panel; the force on the hand is not affected",
        );
        let losses = model.losses();
        if losses.unreadable > 0 {
            let text = format!("Unreadable lines {}", losses.unreadable);
            count(ui, text, false, &losses.unreadable_reason);
        }
    });
}

fn nanoseconds_to_microseconds(ns: u64) -> f64 {
    #[expect(
        clippy::cast_precision_loss,
        reason = "durations of a tick have far fewer than 53 bits"
    )]
    let ns = ns as f64;
    ns / 1e3
}

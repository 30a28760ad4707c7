//! The table of statistics: a signal a row, of what is seen or of what lies between the cursors.

use super::reference::Reference;
use super::scope::Scope;
use crate::plots::measure::difference::{self, difference};
use crate::plots::measure::results::{Measuring, StatisticsRow};
use crate::plots::measure::statistics::Statistics;
use crate::tapes::Tapes;
use crate::words::{decimals, fixed, significant};
use egui::style::ScrollStyle;
use egui::{Align, Label, Layout, RichText, ScrollArea, Ui, WidgetInfo, vec2};
use std::time::Duration;

/// Size of a cell, points.
const CELL: egui::Vec2 = vec2(45.0, 16.0);

/// Digits of a number.
const DIGITS: usize = 3;

/// The columns, with their definitions.
const COLUMNS: [(&str, &str); 7] = [
    ("min", "Least value"),
    ("max", "Greatest value"),
    ("mean", "Mean: each sample counts the same"),
    ("rms", "Root of the mean square"),
    ("p-p", "Peak to peak: greatest minus least value"),
    (
        "over",
        "Overshoot: how far the signal goes beyond its final value, the mean of the last tenth of the time, as a \
         share of the step to it from the first value. None without a step: where first and final value differ by \
         less than a tenth of the range.",
    ),
    (
        "settle",
        "Settling time: from the beginning until the signal stays within 2 % of the step around its final value",
    ),
];

pub(super) fn show(
    ui: &mut Ui,
    tapes: &Tapes,
    scope: &Scope,
    reference: Option<&Reference>,
    measuring: &mut Measuring,
    has_block: bool,
) {
    let (from_s, to_s) = scope.measured(tapes);
    let lines = scope.plots.lines(has_block, scope.tape(tapes).is_plane());
    let offset_s = reference.map(|reference| reference.offset_s(scope.seen(tapes).zero_s));
    let is_short = scope.tape(tapes).count(from_s, to_s) <= difference::MAX_SAMPLES;
    let under = reference.map(|reference| reference.tape.stamp());
    let asked = format!("{lines:?} {} {offset_s:?} {under:?}", scope.cursors.shown);
    let samples = format!("{from_s} {to_s} {}", scope.tape(tapes).stamp());
    let now_s = ui.input(|input| input.time);
    let (rows, wait_s) = measuring.table.get(&asked, &samples, now_s, || {
        let tape = scope.tape(tapes);
        let row = |(signal, component)| {
            let tape = tape.component(component);
            let under = reference.and_then(|reference| reference.tape.component(component));
            let runs = tape.zip(under).zip(offset_s).filter(|_| is_short);
            StatisticsRow {
                signal,
                component,
                statistics: tape.and_then(|tape| Statistics::of(tape, signal, from_s, to_s)),
                difference: runs
                    .and_then(|((tape, under), offset_s)| difference(tape, under, offset_s, signal, (from_s, to_s))),
            }
        };
        lines.into_iter().map(row).collect()
    });
    if let Some(wait_s) = wait_s {
        ui.ctx().request_repaint_after(Duration::from_secs_f64(wait_s));
    }
    let of = if scope.cursors.shown {
        "between the cursors"
    } else {
        "in sight"
    };
    ui.label(RichText::new(format!("{:.4} s {of}", to_s - from_s)).small());
    ui.spacing_mut().scroll = ScrollStyle::solid();
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.spacing_mut().item_spacing = vec2(2.0, 1.0);
        ui.horizontal(|ui| {
            for (name, definition) in COLUMNS {
                cell(ui, RichText::new(name).weak()).on_hover_text(definition);
            }
        });
        for row in rows {
            show_row(ui, row, scope.seen(tapes).zero_s);
        }
        let why = if is_short {
            "The reference covers less than a tenth of this time: move it in Compare".to_owned()
        } else {
            let most = difference::MAX_SAMPLES;
            format!("The difference to the reference is computed for at most {most} samples: zoom in")
        };
        if reference.is_some() && rows.iter().all(|row| row.difference.is_none()) {
            ui.add(Label::new(RichText::new(why).small()).wrap());
        }
    });
}

fn show_row(ui: &mut Ui, row: &StatisticsRow, zero_s: f64) {
    let StatisticsRow {
        signal,
        component,
        statistics,
        difference,
    } = row;
    let (name, unit) = (component.name(*signal), signal.quantity().unit());
    ui.add_space(4.0);
    ui.label(RichText::new(format!("{name} ({unit})")).small().strong());
    let Some(statistics) = statistics else {
        ui.label(RichText::new("no sample").small().weak());
        return;
    };
    let step = statistics.step;
    let values = [
        significant(statistics.least, DIGITS),
        significant(statistics.greatest, DIGITS),
        as_fine_as(statistics.mean, statistics.least, statistics.greatest),
        significant(statistics.rms, DIGITS),
        significant(statistics.peak_to_peak(), DIGITS),
        step.map_or_else(|| "none".to_owned(), |step| format!("{:.0} %", 100.0 * step.overshoot)),
        step.and_then(|step| step.settling_s).map_or_else(
            || "none".to_owned(),
            |settling_s| format!("{} s", significant(settling_s, DIGITS)),
        ),
    ];
    ui.horizontal(|ui| {
        for ((column, _), value) in COLUMNS.into_iter().zip(values) {
            let text = format!("{name} {column} {value}");
            let response = cell(ui, RichText::new(value));
            response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, &text));
        }
    });
    if let Some(difference) = difference {
        let text = format!(
            "minus the reference: rms {}, peak {} {unit} at {:.4} s",
            significant(difference.rms, DIGITS),
            significant(difference.peak, DIGITS),
            difference.peak_at_s - zero_s
        );
        ui.label(RichText::new(text).small());
    }
}

/// A mean without the decimals that its signal, of these ends, is shown without.
fn as_fine_as(mean: f64, least: f64, greatest: f64) -> String {
    let size = least.abs().max(greatest.abs());
    if size == 0.0 {
        return significant(mean, DIGITS);
    }
    fixed(mean, decimals(size, DIGITS))
}

fn cell(ui: &mut Ui, text: RichText) -> egui::Response {
    let layout = Layout::right_to_left(Align::Center);
    let cell = ui.allocate_ui_with_layout(CELL, layout, |ui| {
        ui.set_min_size(CELL);
        ui.add(Label::new(text.small()).extend())
    });
    cell.inner
}

#[cfg(test)]
mod tests {
    use super::as_fine_as;

    #[test]
    fn a_mean_has_the_decimals_of_its_signal_and_its_own_digits() {
        for (mean, greatest, text) in [
            (-0.778, 11.2, "-0.8"),
            (-0.778, 1.12, "-0.78"),
            (-0.004, 11.2, "0.0"),
            (1234.0, 5000.0, "1234"),
        ] {
            assert_eq!(as_fine_as(mean, -greatest, greatest), text);
        }
    }
}

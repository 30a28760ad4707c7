//! The spectrum of a signal over what is seen, or between the cursors.

use super::axis::{AXIS_WIDTH, reach};
use super::chart::{Chart, Curve, Ink};
use super::frame::{self, RIGHT_MARGIN};
use super::scope::Scope;
use super::{legend, picture};
use crate::drop_down::{self, Item};
use crate::plots::measure::results::Measuring;
use crate::plots::measure::spectrum::{Scaling, Spectrum};
use crate::tape::plane::Component;
use crate::tape::signal::Signal;
use crate::tapes::Tapes;
use crate::theme::Palette;
use crate::words::significant;
use egui::{RichText, Ui};
use std::time::Duration;

/// How far below the highest peak the axis reaches, dB.
const DEPTH_DB: f64 = 100.0;

/// Numbers at the axis of frequency.
const FEW: f64 = 3.0;

/// Most points of the line: of more frequencies in a column of pixels the highest is drawn.
const MAX_POINTS: usize = 2000;

/// Height of the rows above the plot, points.
const ROWS: f32 = 74.0;

/// Shows the plot in `height` points.
pub(super) fn show(ui: &mut Ui, tapes: &Tapes, scope: &Scope, measuring: &mut Measuring, height: f32) {
    show_choice(ui, measuring);
    let (signal, scaling) = (measuring.signal, measuring.scaling);
    let (from_s, to_s) = scope.measured(tapes);
    let asked = format!("{signal:?} {scaling:?} {}", scope.cursors.shown);
    let samples = format!("{from_s} {to_s} {}", scope.tape(tapes).stamp());
    let now_s = ui.input(|input| input.time);
    let (found, wait_s) = measuring.spectrum.get(&asked, &samples, now_s, || {
        let tape = scope.tape(tapes);
        let components = Component::of(signal, tape.is_plane(), false).iter();
        let of = |component: &Component| {
            let tape = tape.component(*component).unwrap_or(tape);
            Ok((*component, Spectrum::of(tape, signal, from_s, to_s, scaling)?))
        };
        components.map(of).collect()
    });
    if let Some(wait_s) = wait_s {
        ui.ctx().request_repaint_after(Duration::from_secs_f64(wait_s));
    }
    let spectra = match found {
        Ok(spectra) => spectra,
        Err(why) => {
            ui.label(why);
            return;
        }
    };
    let unit = scaling.unit(signal.quantity().unit());
    let peaks = spectra
        .iter()
        .filter_map(|(_, spectrum)| Some((spectrum.step_hz, spectrum.peak()?)));
    if let Some((step_hz, (frequency_hz, value))) = peaks.max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)) {
        let text = format!(
            "Highest: {} {unit} at {} Hz; one value every {} Hz",
            significant(value, 3),
            significant(frequency_hz, 4),
            significant(step_hz, 3)
        );
        ui.label(RichText::new(text).small());
    }
    let palette = Palette::of(ui);
    let chart = chart(spectra, signal, scaling, &unit);
    ui.horizontal(|ui| {
        ui.add_space(AXIS_WIDTH);
        legend::show(ui, &legend::entries(&chart, palette));
    });
    let name = "Spectrum plot";
    let height = (height - ROWS).max(80.0);
    let plot = frame::plot(name, height, height, FEW, AXIS_WIDTH)
        .width(ui.available_width() - RIGHT_MARGIN)
        .x_axis_label(chart.labels[0].as_str())
        .y_axis_label(chart.labels[1].as_str());
    let shown = plot.show(ui, |plot| frame::draw(plot, &chart, palette));
    shown.response.accessible_name(name);
}

fn show_choice(ui: &mut Ui, measuring: &mut Measuring) {
    ui.horizontal(|ui| {
        picture::hide_controls(ui);
        let signal = measuring.signal;
        let items = || Signal::ALL.map(|other| Item::new(other, other.name(), &signal)).into();
        let (chosen, _) = drop_down::show(ui, "signal of the spectrum", 140.0, signal.name(), items);
        measuring.signal = chosen.unwrap_or(signal);
        for scaling in Scaling::ALL {
            ui.selectable_value(&mut measuring.scaling, scaling, scaling.name())
                .on_hover_text(match scaling {
                    Scaling::Amplitude => "Of a sine, its amplitude. Hann window, the mean taken off.",
                    Scaling::Density => "One-sided power spectral density. Hann window, the mean taken off.",
                });
        }
    });
}

/// The chart of the spectrum that was shown last.
pub(crate) fn seen(measuring: &Measuring) -> Option<Chart> {
    let (signal, scaling) = (measuring.signal, measuring.scaling);
    let spectra = measuring.spectrum.last()?.as_ref().ok()?;
    Some(chart(spectra, signal, scaling, &scaling.unit(signal.quantity().unit())))
}

/// The highest values in columns of frequencies, and the end of the last column, Hz.
fn columns(spectrum: &Spectrum) -> (Vec<[f64; 2]>, f64) {
    let share = spectrum.values.len().div_ceil(MAX_POINTS);
    let mut at_hz = 0.0;
    let columns = spectrum.values.chunks(share).map(|column| {
        let highest = column.iter().copied().fold(0.0, f64::max);
        #[expect(clippy::cast_precision_loss, reason = "at most 2^17 frequencies")]
        let wide_hz = column.len() as f64 * spectrum.step_hz;
        let point = [at_hz, highest];
        at_hz += wide_hz;
        point
    });
    (columns.collect(), at_hz)
}

fn chart(spectra: &[(Component, Spectrum)], signal: Signal, scaling: Scaling, unit: &str) -> Chart {
    let lines: Vec<_> = spectra.iter().map(|(_, spectrum)| columns(spectrum)).collect();
    let values = lines.iter().flat_map(|(columns, _)| columns);
    let highest = values.map(|[_, value]| *value).fold(0.0, f64::max);
    let end_hz = lines
        .iter()
        .map(|(_, end_hz)| *end_hz)
        .fold(f64::MIN_POSITIVE, f64::max);
    let top = if highest > 0.0 { scaling.decibel(highest) } else { 0.0 };
    let floor = top - DEPTH_DB;
    let decibel = |value: f64| {
        if value > 0.0 {
            scaling.decibel(value).max(floor)
        } else {
            floor
        }
    };
    let curve = |component: Component, columns: Vec<[f64; 2]>| Curve {
        name: component.name(signal),
        hint: signal.definition(),
        points: columns
            .into_iter()
            .map(|[at_hz, value]| [at_hz, decibel(value)])
            .collect(),
        ink: Ink {
            is_dashed: component == Component::Y,
            ..Ink::solid(signal.color(), 1.0)
        },
    };
    Chart {
        curves: spectra
            .iter()
            .zip(lines)
            .map(|((component, _), (columns, _))| curve(*component, columns))
            .collect(),
        overlays: Vec::new(),
        across: (0.0, end_hz),
        up: reach([floor, top], 1.0),
        labels: [
            "Frequency (Hz)".to_owned(),
            format!("{} (dB over 1 {unit})", scaling.name()),
        ],
    }
}

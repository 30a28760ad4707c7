//! The page Plane, for a rig of two axes: where hand and block are, and the force in the coupling as a vector in the
//! circles of static and dynamic friction. Both plots have equal scales and show the time that is seen, the older the
//! fainter.

use super::axis::{AXIS_WIDTH, DEFAULT_COUNT, reach};
use super::chart::{Chart, Curve, Ink, Overlay};
use super::frame::{self, RIGHT_MARGIN};
use super::{legend, limits, toolbar};
use crate::daemon::top_bar;
use crate::intent::Intent;
use crate::model::{Model, has_block, scene_seen};
use crate::tape::Tape;
use crate::tape::plane::Component;
use crate::tape::signal::{MM_PER_M, Signal};
use crate::theme::Palette;
use crate::view::PlotGroup;
use crate::words::{shortened, significant};
use egui::{Align, CentralPanel, Color32, Layout, Ui, vec2};
use haptic_core::Parameter;
use haptic_core::planar::Workspace;
use std::f64::consts::TAU;

/// Most samples of a trail that are drawn; of more, evenly chosen ones are.
const MAX_DRAWN: usize = 3000;

/// Parts of a trail in the window, each fainter than the next.
const PARTS: usize = 8;

/// Opacity of the oldest part.
const FAINTEST: f32 = 0.15;

/// Points of a circle: its corners cannot be seen.
const CIRCLE: u32 = 128;

/// Radius of what is now, points.
const DOT_RADIUS: f32 = 5.0;

/// Narrowest range of the positions, mm.
const NARROWEST_MM: f64 = 20.0;

/// Least radius of the plot of the force, N.
const MIN_FORCE_N: f64 = 1.0;

/// Room around the circles, as a multiple of their radius.
const ROOM: f64 = 1.15;

/// Share of the width that the plot of the positions has.
const POSITIONS_SHARE: f32 = 0.56;

/// Height of the row of numbers above a plot, points.
const READING_HEIGHT: f32 = 20.0;

pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    CentralPanel::default_margins().show(ui, |ui| {
        if !tape(model).is_plane() {
            if !model.daemon.was_connected {
                top_bar::explain_no_daemon(ui, &model.daemon, model.is_at_recording(), intents);
            }
            ui.heading("No plane to look at yet");
            ui.label("This page shows the samples of a rig of two axes.");
            return;
        }
        let Model { tapes, view, .. } = &mut *model;
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let scope = view.scope_mut(tapes);
            if scope.is_of_rig() {
                toolbar::show_running(ui, tapes, scope);
            }
            toolbar::show_moving(ui, tapes, scope);
            ui.separator();
            ui.toggle_value(&mut view.layout.shows_limits, "Limits")
                .on_hover_text("Circles at Fs, Fd and the force limit");
            toolbar::show_export(ui, &mut view.folder, intents);
        });
        view.layout.drawn = vec![PlotGroup::Plane];
        view.layout.area = ui.available_rect_before_wrap();
        let [positions, force] = charts(model, PARTS);
        let [position_text, force_text] = readings(model);
        let (height, width) = (
            ui.available_height(),
            ui.available_width() - ui.spacing().item_spacing.x,
        );
        ui.horizontal_top(|ui| {
            for (share, name, chart, text) in [
                (POSITIONS_SHARE, "Hand and block plot", &positions, position_text),
                (1.0 - POSITIONS_SHARE, "Coupling force plot", &force, force_text),
            ] {
                let size = vec2(width * share, height);
                ui.allocate_ui_with_layout(size, Layout::top_down(Align::Min), |ui| {
                    show_one(ui, name, chart, &text, height);
                });
            }
        });
    });
}

/// Shows a chart on equal scales below its legend and its numbers.
fn show_one(ui: &mut Ui, name: &str, chart: &Chart, text: &str, height: f32) {
    let palette = Palette::of(ui);
    let top = ui.cursor().top();
    ui.horizontal(|ui| {
        ui.add_space(AXIS_WIDTH);
        legend::show(ui, &legend::entries(chart, palette));
    });
    let row = vec2(ui.available_width(), READING_HEIGHT);
    ui.allocate_ui_with_layout(row, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_size(row);
        ui.add_space(AXIS_WIDTH);
        shortened(ui, text, text);
    });
    let height = (height - (ui.cursor().top() - top)).max(80.0);
    let plot = frame::plot(name, height, height, DEFAULT_COUNT, AXIS_WIDTH)
        .width(ui.available_width() - RIGHT_MARGIN)
        .data_aspect(1.0)
        .x_axis_label(chart.labels[0].as_str())
        .y_axis_label(chart.labels[1].as_str());
    let shown = plot.show(ui, |plot| frame::draw(plot, chart, palette));
    shown.response.accessible_name(name);
}

/// The samples of the page.
fn tape(model: &Model) -> &Tape {
    model.view.scope(&model.tapes).tape(&model.tapes)
}

/// A vector at a time, s on the daemon's clock, in the unit of its signal.
fn vector_at(tape: &Tape, signal: Signal, t_s: f64) -> Option<[f64; 2]> {
    let along = |component| tape.component(component)?.value_at(signal, t_s);
    Some([along(Component::X)?, along(Component::Y)?])
}

/// The vectors from one time to another, s on the daemon's clock, in the unit of their signal, with a break where
/// samples are missing.
fn vectors(tape: &Tape, signal: Signal, ends: (f64, f64)) -> Vec<[f64; 2]> {
    let stride = tape.count(ends.0, ends.1).div_ceil(MAX_DRAWN).max(1);
    let along = |component| {
        let pairs = tape.component(component).into_iter();
        let pairs = pairs.flat_map(move |tape| tape.pairs_every(stride, false, ends));
        pairs.map(move |pair| pair.map_or(f64::NAN, |(before, sample)| signal.of(before, sample)))
    };
    let points = along(Component::X).zip(along(Component::Y)).map(|(x, y)| [x, y]);
    points.chain(vector_at(tape, signal, ends.1)).collect()
}

/// A line whose parts are the fainter the older they are; the newest bears the name.
fn trail(name: &'static str, hint: &'static str, signal: Signal, points: &[[f64; 2]], parts: usize) -> Vec<Curve> {
    let size = points.len().div_ceil(parts).max(1);
    let begins: Vec<usize> = (0..points.len()).step_by(size).collect();
    let newest = begins.len().saturating_sub(1);
    let curve = |(place, begin): (usize, usize)| {
        #[expect(clippy::cast_precision_loss, reason = "few parts")]
        let age = if newest == 0 {
            0.0
        } else {
            (newest - place) as f32 / newest as f32
        };
        let (name, hint) = if place == newest { (name, hint) } else { ("", "") };
        Curve {
            name: name.into(),
            hint,
            // Up to the first point of the next part.
            points: points[begin..(begin + size + 1).min(points.len())].to_vec(),
            ink: Ink {
                opacity: 1.0 - age * (1.0 - FAINTEST),
                ..Ink::solid(signal.color(), signal.width().min(2.0))
            },
        }
    };
    begins.into_iter().enumerate().map(curve).collect()
}

fn dot(name: &'static str, at: Option<[f64; 2]>, color: fn(&Palette) -> Color32) -> Overlay {
    Overlay::Dots {
        name,
        at: at.into_iter().collect(),
        radius: DOT_RADIUS,
        color,
    }
}

/// Positions and force of the time that is seen, with trails of some parts.
pub(crate) fn charts(model: &Model, parts: usize) -> [Chart; 2] {
    [positions(model, parts), force(model, parts)]
}

fn positions(model: &Model, parts: usize) -> Chart {
    let scope = model.view.scope(&model.tapes);
    let (tape, seen) = (tape(model), scope.seen(&model.tapes));
    let ends = (seen.from_s, seen.to_s);
    let hand = vectors(tape, Signal::DEVICE_POSITION, ends);
    let has_block = has_block(model);
    let block = if has_block {
        vectors(tape, Signal::BLOCK_POSITION, ends)
    } else {
        Vec::new()
    };
    let corners = workspace(model).map(|workspace| {
        let ([left, right], [low, high]) = (workspace.x_m, workspace.y_m);
        let corners = [[left, low], [right, low], [right, high], [left, high], [left, low]];
        corners.map(|corner| corner.map(|at_m| at_m * MM_PER_M))
    });
    let points = || hand.iter().chain(&block).chain(corners.iter().flatten());
    let along = |axis: usize| reach(points().map(|point| point[axis]), NARROWEST_MM);
    let mut overlays: Vec<Overlay> = Vec::new();
    overlays.extend(corners.map(|corners| {
        Overlay::Curve(Curve {
            name: "Workspace".into(),
            hint: "Where force may flow; outside it fades",
            points: corners.to_vec(),
            ink: Ink::solid(|palette| palette.mark, 1.0),
        })
    }));
    overlays.push(dot("Block now", block.last().copied(), Signal::BLOCK_POSITION.color()));
    overlays.push(dot("Hand now", hand.last().copied(), Signal::DEVICE_POSITION.color()));
    let mut curves = trail("Block", "Where the block was", Signal::BLOCK_POSITION, &block, parts);
    curves.extend(trail(
        "Hand",
        "Where the hand was",
        Signal::DEVICE_POSITION,
        &hand,
        parts,
    ));
    Chart {
        curves,
        overlays,
        across: along(0),
        up: along(1),
        labels: ["x (mm)".to_owned(), "y (mm)".to_owned()],
    }
}

fn force(model: &Model, parts: usize) -> Chart {
    let Model { daemon, tapes, view } = model;
    let scope = view.scope(tapes);
    let (tape, seen) = (tape(model), scope.seen(tapes));
    let points = vectors(tape, Signal::COUPLING_FORCE, (seen.from_s, seen.to_s));
    let scene = scene_seen(daemon, tapes, scope);
    let radius_n = |parameter| Some(scene?.value(parameter)?.positive).filter(|force_n| *force_n > 0.0);
    let (static_n, dynamic_n) = (radius_n(Parameter::StaticForce), radius_n(Parameter::DynamicForce));
    let lengths = points.iter().map(|[x, y]| x.hypot(*y));
    let widest_n = lengths.chain(static_n).chain(dynamic_n).fold(MIN_FORCE_N, f64::max) * ROOM;
    let limit_n = limits::force_limit_n(daemon, tapes, scope);
    let circles = [
        ("Fs", static_n, Ink::solid(|palette| palette.law, 2.0)),
        (
            "Fd",
            dynamic_n,
            Ink {
                is_dashed: true,
                ..Ink::solid(|palette| palette.law, 1.5)
            },
        ),
        ("Force limit", limit_n, Ink::solid(|palette| palette.error_text, 1.0)),
    ];
    let circles = circles.into_iter().filter(|_| view.layout.shows_limits);
    let mut overlays: Vec<Overlay> = circles
        // A limit beyond the plot would only be a name.
        .filter_map(|(name, radius_n, ink)| Some(circle(name, radius_n.filter(|it| *it <= widest_n)?, ink)))
        .collect();
    let newest = points.last().copied();
    overlays.push(dot("Now", newest, Signal::COUPLING_FORCE.color()));
    let mut curves = trail("Trail", "The force before", Signal::COUPLING_FORCE, &points, parts);
    for curve in &mut curves {
        curve.ink.width = 1.0;
    }
    curves.extend(newest.map(|tip| Curve {
        name: "Coupling force".into(),
        hint: Signal::COUPLING_FORCE.definition(),
        points: vec![[0.0; 2], tip],
        ink: Ink::solid(Signal::COUPLING_FORCE.color(), Signal::COUPLING_FORCE.width()),
    }));
    Chart {
        curves,
        overlays,
        across: (-widest_n, widest_n),
        up: (-widest_n, widest_n),
        labels: ["Force, x (N)".to_owned(), "Force, y (N)".to_owned()],
    }
}

fn circle(name: &str, radius_n: f64, ink: Ink) -> Overlay {
    let angles = (0..=CIRCLE).map(|place| TAU * f64::from(place) / f64::from(CIRCLE));
    let points = angles.map(|angle| [radius_n * angle.cos(), radius_n * angle.sin()]);
    Overlay::Curve(Curve {
        name: format!("{name} {} N", significant(radius_n, 3)).into(),
        hint: "",
        points: points.collect(),
        ink,
    })
}

/// Where force may flow, if that is bounded.
fn workspace(model: &Model) -> Option<Workspace> {
    let Model { daemon, tapes, view } = model;
    let servo = if view.scope(tapes).is_of_rig() {
        daemon.mirror.servo.as_ref()
    } else {
        tapes.opened()?.metadata.servo.as_ref()
    };
    servo?.settings.workspace
}

/// Both plots in numbers, at the newest sample that is seen.
fn readings(model: &Model) -> [String; 2] {
    let (tape, tapes) = (tape(model), &model.tapes);
    let now_s = model.view.scope(tapes).seen(tapes).to_s;
    let at = |signal| vector_at(tape, signal, now_s);
    let place = |name: &str, signal| {
        at(signal).map_or_else(|| format!("{name}: none"), |[x, y]| format!("{name} {x:.1}, {y:.1} mm"))
    };
    let mut positions = place("Hand", Signal::DEVICE_POSITION);
    if has_block(model) {
        positions += &format!("; {}", place("block", Signal::BLOCK_POSITION));
    }
    let force = at(Signal::COUPLING_FORCE).map_or_else(String::new, |[x, y]| {
        let mut text = format!("{:.2} N towards {:.0}°", x.hypot(y), y.atan2(x).to_degrees());
        if let Some(sample) = tape.at(now_s).filter(|sample| sample.state.is_live()) {
            text += if sample.contact == 0 { ", stuck" } else { ", sliding" };
        }
        text
    });
    [positions, force]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trail_is_whole_and_its_newest_part_the_strongest() {
        let points: Vec<[f64; 2]> = (0..100).map(|place| [f64::from(place), 0.0]).collect();
        for (count, parts) in [(100, 8), (100, 1), (3, 8), (1, 8)] {
            let curves = trail("Hand", "", Signal::DEVICE_POSITION, &points[..count], parts);
            assert!(curves.len() <= parts && curves.is_sorted_by(|old, new| old.ink.opacity < new.ink.opacity));
            for pair in curves.windows(2) {
                assert_eq!(pair[0].points.last(), pair[1].points.first(), "no gap");
            }
            let newest = curves.last().expect("a part");
            assert_eq!((newest.ink.opacity, newest.name.as_ref()), (1.0, "Hand"));
            assert_eq!(newest.points.last(), Some(&points[count - 1]));
        }
        assert!(trail("Hand", "", Signal::DEVICE_POSITION, &[], 8).is_empty());
    }
}

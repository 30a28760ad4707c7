//! One signal against another: at first force against velocity, the trail of the block over its law's force of a
//! steady slide.

use super::axis::{AXIS_WIDTH, reach};
use super::chart::{Across, Axes, Chart, Curve, Ink, Overlay, Trace};
use super::frame::{self, GRAB, RIGHT_MARGIN, zoom};
use super::reference::Reference;
use super::scope::{Scope, TimeRange};
use super::{legend, picture};
use crate::drop_down::{self, Item};
use crate::plots::scope::against::{Against, Extent};
use crate::tape::Tape;
use crate::tape::outline::BREAK;
use crate::tape::plane::{self, Component};
use crate::tape::signal::{MM_PER_M, Quantity, Signal};
use crate::tapes::Tapes;
use crate::theme::Palette;
use crate::words::significant;
use egui::{Label, Pos2, RichText, Sense, TextStyle, Ui, vec2};
use egui_plot::{PlotPoint, PlotResponse, PlotTransform};
use haptic_core::{Parameter, Scene};

/// Length of the trail, s.
const TRAIL_S: f64 = 1.0;

/// Most samples of the trail that are drawn; of more, evenly chosen ones are.
const MAX_DRAWN: usize = 20_000;

/// Points of the law's curve in each direction: enough for a Stribeck fall in the middle of a wide plot.
const CURVE_POINTS: u32 = 200;

/// How strong the line of the reference is.
const REFERENCE_OPACITY: f32 = 0.35;

/// Radius of the newest sample, and of those at the cursors, points.
const DOT_RADIUS: f32 = 5.0;

/// Nearer than this to one another, two places of the trail are one to a hand that drags, points.
const SAME_PLACE: f32 = 3.0;

/// Numbers at the short axis of velocity.
const FEW: f64 = 2.0;

/// Half of the width of the stick band for a scene without a threshold, mm/s.
const NARROW_BAND_MMPS: f64 = 5.0;

/// The narrowest range of velocity to either side, mm/s.
const NARROWEST_MMPS: f64 = 20.0;

/// The law's curve: the slide to the left, the hold at rest, the slide to the right, in mm/s and N. The hold is a line
/// of its own: where a line turns back on itself, it is drawn too thin to be seen.
pub(crate) fn curve(scene: &Scene, fastest_mmps: f64) -> Vec<[f64; 2]> {
    let held = scene.friction.holding_force();
    let slide = |direction: f64| {
        (0..=CURVE_POINTS).map(move |step| {
            // Denser near rest, where the curve bends.
            let share = (f64::from(step) / f64::from(CURVE_POINTS)).powi(2);
            // The smallest speed that is not rest, so that the force is that of a slide.
            let speed = (share * fastest_mmps / MM_PER_M).max(f64::MIN_POSITIVE);
            [
                direction * speed * MM_PER_M,
                scene.friction.steady_force(direction * speed),
            ]
        })
    };
    let mut points: Vec<[f64; 2]> = slide(-1.0).collect();
    points.reverse();
    if held.positive > 0.0 || held.negative > 0.0 {
        points.extend([BREAK, [0.0, -held.negative], [0.0, held.positive], BREAK]);
    }
    points.extend(slide(1.0));
    points
}

/// Half of the width of the band in which the block sticks or slides, mm/s.
fn band(scene: Option<&Scene>) -> f64 {
    let of = |parameter| {
        scene
            .and_then(|scene| scene.value(parameter))
            .map_or(0.0, |value| value.positive)
    };
    let [threshold, stribeck] = [Parameter::VelocityThreshold, Parameter::StribeckVelocity].map(of);
    (4.0 * threshold.max(stribeck) * MM_PER_M).max(NARROW_BAND_MMPS)
}

/// The time whose samples are drawn.
fn drawn(tapes: &Tapes, scope: &Scope) -> TimeRange {
    let seen = scope.seen(tapes);
    let (from_s, to_s) = match scope.against.extent {
        Extent::LastSecond => (seen.from_s.max(seen.to_s - TRAIL_S), seen.to_s),
        Extent::Seen => (seen.from_s, seen.to_s),
        Extent::Cursors => scope.measured(tapes),
    };
    TimeRange { from_s, to_s, ..seen }
}

/// The components that are drawn: lengths where both signals have one, else x and y.
fn components(tapes: &Tapes, scope: &Scope) -> &'static [Component] {
    let Against { across, up, .. } = scope.against;
    let as_length = plane::has_length(across) && plane::has_length(up);
    match Component::of(up, scope.tape(tapes).is_plane(), as_length) {
        [Component::X, Component::Y] if across.quantity() == Quantity::Duration => &[Component::X],
        components => components,
    }
}

/// The samples of the first component that is drawn, to which cursors and pointer belong.
fn tape<'a>(tapes: &'a Tapes, scope: &'a Scope) -> &'a Tape {
    let tape = scope.tape(tapes);
    tape.component(components(tapes, scope)[0]).unwrap_or(tape)
}

/// Of how many samples one is drawn.
fn stride(tapes: &Tapes, scope: &Scope, drawn: &TimeRange) -> usize {
    let count = scope.tape(tapes).count(drawn.from_s, drawn.to_s);
    count.div_ceil(MAX_DRAWN).max(1)
}

/// The chart of the time that is drawn, with the law of a scene and the same time of the run that is kept.
pub(crate) fn chart(tapes: &Tapes, scope: &Scope, scene: Option<&Scene>, reference: Option<&Reference>) -> Chart {
    let Against { across, up, .. } = scope.against;
    let drawn = drawn(tapes, scope);
    let stride = stride(tapes, scope, &drawn);
    // The law says nothing of samples without force.
    let with_force = scope.against.shows_law();
    let components = components(tapes, scope);
    let is_length = components == [Component::Length];
    let (mut low, mut high, mut newest) = (f64::INFINITY, f64::NEG_INFINITY, Vec::new());
    for tape in components
        .iter()
        .filter_map(|component| scope.tape(tapes).component(*component))
    {
        let mut last = None;
        let samples = tape.pairs_every(stride, with_force, (drawn.from_s, drawn.to_s));
        for (before, sample) in samples.flatten() {
            let value = across.of(before, sample);
            (low, high) = (low.min(value), high.max(value));
            last = Some([value, up.of(before, sample)]);
        }
        newest.extend(last);
    }
    let under = reference.and_then(|reference| under(reference, &scope.against, components[0], &drawn));
    for [value, _] in under.iter().flat_map(|curve| &curve.points) {
        (low, high) = (low.min(*value), high.max(*value));
    }
    let held = scope.against.across_axis.held();
    let (shown, mut overlays) = if scope.against.shows_law() {
        let widest = widest(&scope.against, scene, low.abs().max(high.abs()));
        // A length has one side.
        let least = if is_length { 0.0 } else { -widest };
        let shown = held.unwrap_or((least, widest));
        (shown, law(scene, shown, is_length))
    } else {
        let values = [low, high].into_iter().filter(|value| value.is_finite());
        let fitted = reach(values, across.quantity().smallest_span());
        (held.unwrap_or(fitted), Vec::new())
    };
    overlays.extend(under.map(Overlay::Curve));
    overlays.push(Overlay::Dots {
        name: if scope.ends_now(tapes) { "Now" } else { "Newest seen" },
        at: newest,
        radius: DOT_RADIUS,
        color: |palette| palette.device,
    });
    let at_cursors = at_cursors(tapes, scope);
    overlays.extend(at_cursors.map(|at| Overlay::Dots {
        name: "At a cursor",
        at: at.into_iter().flatten().collect(),
        radius: DOT_RADIUS,
        color: |palette| palette.cursor,
    }));
    let label = |signal: Signal| {
        let name = if is_length {
            Component::Length.name(signal)
        } else {
            signal.name().into()
        };
        format!("{name} ({})", signal.quantity().unit())
    };
    let axes = Axes {
        seen: drawn,
        columns: 1.0,
        across: shown,
        up: scope.against.up_axis.held(),
        smallest_span: up.quantity().smallest_span(),
        labels: [label(across), label(up)],
    };
    let trail = |component: &Component| Trace {
        name: match component {
            Component::Whole | Component::Length => "Trail".into(),
            Component::X => "Trail, x".into(),
            Component::Y => "Trail, y".into(),
        },
        across: Across::Signal {
            signal: across,
            stride,
            with_force,
        },
        signal: up,
        component: *component,
        ink: Ink {
            is_dashed: *component == Component::Y,
            ..Ink::solid(|palette| palette.block, 1.0)
        },
    };
    let trails: Vec<Trace> = components.iter().map(trail).collect();
    Chart::new(scope.tape(tapes), &trails, &overlays, axes)
}

/// The line of the run that is kept, fainter than the trail.
fn under(reference: &Reference, against: &Against, component: Component, drawn: &TimeRange) -> Option<Curve> {
    let offset_s = reference.offset_s(drawn.zero_s);
    let (from_s, to_s) = (drawn.from_s - offset_s, drawn.to_s - offset_s);
    let tape = reference.tape.component(component)?;
    let stride = tape.count(from_s, to_s).div_ceil(MAX_DRAWN).max(1);
    let samples = tape.pairs_every(stride, against.shows_law(), (from_s, to_s));
    let point = |(before, sample)| [against.across.of(before, sample), against.up.of(before, sample)];
    let points = samples.map(|pair| pair.map_or(BREAK, point));
    Some(Curve {
        name: "Trail, reference".into(),
        hint: "The run that was kept with Compare",
        points: points.collect(),
        ink: Ink {
            opacity: REFERENCE_OPACITY,
            ..Ink::solid(|palette| palette.device, 1.0)
        },
    })
}

/// Half of the width of the axis of velocity, mm/s, for a block that was this fast, which is infinite without
/// a sample.
fn widest(against: &Against, scene: Option<&Scene>, fastest_mmps: f64) -> f64 {
    if against.zooms_to_stick_band {
        band(scene)
    } else if fastest_mmps.is_finite() {
        (fastest_mmps * 1.1).max(NARROWEST_MMPS)
    } else {
        NARROWEST_MMPS
    }
}

/// The law's curve over an axis of velocity, mm/s, or of speed, and its thresholds.
fn law(scene: Option<&Scene>, (slowest_mmps, fastest_mmps): (f64, f64), of_lengths: bool) -> Vec<Overlay> {
    let reach_mmps = slowest_mmps.abs().max(fastest_mmps.abs()) * 1.2;
    let mut points = scene.map_or_else(Vec::new, |scene| curve(scene, reach_mmps));
    points.retain(|point| !of_lengths || point.iter().all(|value| *value >= 0.0));
    let curve = Overlay::Curve(Curve {
        name: "Law".into(),
        hint: "The law's force of a steady slide, with its hold at rest",
        points,
        ink: Ink::solid(|palette| palette.law, 2.0),
    });
    [curve].into_iter().chain(thresholds(scene)).collect()
}

/// Both signals at either cursor, if they are shown.
fn at_cursors(tapes: &Tapes, scope: &Scope) -> Option<[Option<[f64; 2]>; 2]> {
    let Against { across, up, .. } = scope.against;
    let (tape, zero_s) = (tape(tapes, scope), scope.seen(tapes).zero_s);
    scope.cursors.shown.then(|| {
        scope.cursors.at_s.map(|at_s| {
            let value = |signal| tape.value_at(signal, zero_s + at_s);
            Some([value(across)?, value(up)?])
        })
    })
}

/// The velocities at which the block starts to stick, if the law has a threshold.
fn thresholds(scene: Option<&Scene>) -> impl Iterator<Item = Overlay> {
    let threshold = scene.and_then(|scene| scene.value(Parameter::VelocityThreshold));
    let mmps = threshold.map(|value| value.positive * MM_PER_M);
    let both = mmps
        .filter(|mmps| *mmps > 0.0)
        .into_iter()
        .flat_map(|mmps| [-mmps, mmps]);
    both.map(|at| Overlay::Mark {
        at,
        label: "DV".into(),
        is_dashed: true,
        ink: Ink::solid(|palette| palette.mark, 1.0),
    })
}

/// Shows the plot in `height` points, with a law and a run to compare with.
pub(crate) fn show(
    ui: &mut Ui,
    tapes: &Tapes,
    scope: &mut Scope,
    (scene, reference): (Option<&Scene>, Option<&Reference>),
    height: f32,
) {
    let palette = Palette::of(ui);
    let top = ui.cursor().top();
    show_choice(ui, &mut scope.against);
    let chart = chart(tapes, scope, scene, reference);
    scope.against.across_axis.saw(chart.across);
    scope.against.up_axis.saw(chart.up);
    ui.horizontal(|ui| {
        ui.add_space(AXIS_WIDTH);
        legend::show(ui, &legend::entries(&chart, palette));
        let stride = stride(tapes, scope, &drawn(tapes, scope));
        if stride > 1 {
            ui.label(RichText::new(format!("one of {stride} samples")).small().weak());
        }
    });
    if let Some(at) = at_cursors(tapes, scope) {
        // As much room for a short text as for a long one, so that the plot stays where it is.
        let room = vec2(ui.available_width(), 2.0 * ui.text_style_height(&TextStyle::Small));
        ui.allocate_ui(room, |ui| {
            ui.set_min_size(room);
            ui.add(Label::new(RichText::new(readings(&scope.against, at)).small()).wrap());
        });
    }
    let height = (height - (ui.cursor().top() - top)).max(80.0);
    let name = if scope.against.shows_law() {
        "Force against velocity plot".to_owned()
    } else {
        let Against { across, up, .. } = &scope.against;
        format!("{} against {} plot", up.name(), across.name().to_lowercase())
    };
    let plot = frame::plot(&name, height, height, FEW, AXIS_WIDTH)
        .width(ui.available_width() - RIGHT_MARGIN)
        .x_axis_label(chart.labels[0].as_str())
        .y_axis_label(chart.labels[1].as_str())
        .sense(Sense::click_and_drag());
    let mut shown = plot.show(ui, |plot| frame::draw(plot, &chart, palette));
    shown.response = shown.response.accessible_name(name);
    take_pointer(ui, tapes, scope, &shown);
}

fn show_choice(ui: &mut Ui, against: &mut Against) {
    ui.horizontal_wrapped(|ui| {
        picture::hide_controls(ui);
        for (name, chosen) in [
            ("vertical signal", &mut against.up),
            ("horizontal signal", &mut against.across),
        ] {
            let signal = *chosen;
            let items = || Signal::ALL.map(|other| Item::new(other, other.name(), &signal)).into();
            let (other, list) = drop_down::show(ui, name, 118.0, signal.name(), items);
            list.on_hover_text("Any signal against any other");
            if let Some(other) = other {
                *chosen = other;
                against.across_axis.fit();
                against.up_axis.fit();
            }
        }
        let extent = against.extent;
        let items = || Extent::ALL.map(|other| Item::new(other, other.name(), &extent)).into();
        let (chosen, _) = drop_down::show(ui, "samples drawn", 104.0, extent.name(), items);
        against.extent = chosen.unwrap_or(extent);
        if against.shows_law() {
            let toggle = ui.checkbox(&mut against.zooms_to_stick_band, "Zoom to the stick band");
            if toggle
                .on_hover_text("Velocities at which it is decided whether the block sticks: a few times DV, or ws")
                .changed()
            {
                against.across_axis.fit();
            }
        }
    });
}

/// Both signals at the cursors, and their difference.
fn readings(against: &Against, at: [Option<[f64; 2]>; 2]) -> String {
    let units = [against.across, against.up].map(|signal| signal.quantity().unit());
    let shown = |values: [f64; 2]| {
        let [across, up] = values.map(|value| significant(value, 4));
        format!("{across} {}, {up} {}", units[0], units[1])
    };
    let [first, second] = at;
    let points = [first, second].map(|at| at.map_or_else(|| "no sample".to_owned(), shown));
    let difference = first
        .zip(second)
        .map(|(first, second)| shown([second[0] - first[0], second[1] - first[1]]));
    let difference = difference.map_or_else(String::new, |difference| format!("; difference {difference}"));
    format!("Cursor 1: {}; cursor 2: {}{difference}", points[0], points[1])
}

/// The wheel zooms both axes around the pointer, a drag moves them or takes a cursor's dot along its trail, a double
/// click fits them again.
fn take_pointer(ui: &Ui, tapes: &Tapes, scope: &mut Scope, shown: &PlotResponse<()>) {
    let (response, transform) = (&shown.response, &shown.transform);
    if response.double_clicked() {
        scope.against.fit();
        return;
    }
    if let Some(pos) = response.hover_pos()
        && let Some(factor) = zoom(ui)
    {
        let at = transform.value_from_position(pos);
        scope.against.across_axis.zoom(factor, at.x);
        scope.against.up_axis.zoom(factor, at.y);
    }
    let grabbed = response.id.with("grabbed cursor");
    if response.drag_started() {
        let origin = ui.input(|input| input.pointer.press_origin());
        let near = origin.and_then(|pos| cursor_near(tapes, scope, pos, transform));
        ui.data_mut(|data| data.insert_temp(grabbed, near));
    }
    let drag = response.drag_delta();
    if !response.dragged() || drag == egui::Vec2::ZERO {
        return;
    }
    let grabbed = ui.data(|data| data.get_temp::<Option<usize>>(grabbed)).flatten();
    match (grabbed, response.interact_pointer_pos()) {
        (Some(cursor), Some(pos)) => {
            if let Some(at_s) = on_trail(tapes, scope, cursor, pos, transform) {
                scope.cursors.at_s[cursor] = at_s;
            }
        }
        _ => {
            let against = &mut scope.against;
            against
                .across_axis
                .shift(-f64::from(drag.x) / transform.dpos_dvalue_x());
            against.up_axis.shift(-f64::from(drag.y) / transform.dpos_dvalue_y());
        }
    }
}

/// The cursor whose dot can be grabbed at a place of the screen.
fn cursor_near(tapes: &Tapes, scope: &Scope, pos: Pos2, transform: &PlotTransform) -> Option<usize> {
    let dots = at_cursors(tapes, scope)?.into_iter().enumerate();
    let distances = dots.filter_map(|(cursor, at)| {
        let [across, up] = at?;
        let dot = transform.position_from_point(&PlotPoint::new(across, up));
        Some((cursor, dot.distance(pos)))
    });
    let (cursor, distance) = distances.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (distance <= GRAB).then_some(cursor)
}

/// The time on the plots' axis, s, of the sample of the trail that lies under the pointer. Where the trail passes there
/// more than once, it is the time next to that of the cursor: a dot stays on its turn.
fn on_trail(tapes: &Tapes, scope: &Scope, cursor: usize, pos: Pos2, transform: &PlotTransform) -> Option<f64> {
    let Against { across, up, .. } = scope.against;
    let mut drawn = drawn(tapes, scope);
    let now_s = drawn.zero_s + scope.cursors.at_s[cursor];
    // The part between the cursors could only shrink; and a dot beside what is drawn would jump there.
    if scope.against.extent == Extent::Cursors || !(drawn.from_s..=drawn.to_s).contains(&now_s) {
        drawn = scope.seen(tapes);
    }
    let stride = stride(tapes, scope, &drawn);
    let with_force = scope.against.shows_law();
    let samples = tape(tapes, scope)
        .pairs_every(stride, with_force, (drawn.from_s, drawn.to_s))
        .flatten()
        .map(|(before, sample)| {
            let point = PlotPoint::new(across.of(before, sample), up.of(before, sample));
            (sample.t_s, transform.position_from_point(&point).distance(pos))
        });
    let samples: Vec<_> = samples.collect();
    let nearest = samples.iter().map(|(_, distance)| *distance).min_by(f32::total_cmp)?;
    let under = samples.iter().filter(|(_, distance)| *distance <= nearest + SAME_PLACE);
    let next = under.min_by(|(a, _), (b, _)| (a - now_s).abs().total_cmp(&(b - now_s).abs()));
    next.map(|(t_s, _)| t_s - drawn.zero_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_holds_at_rest_and_slides_at_the_kinetic_force() {
        let law = curve(&Scene::paper(), 100.0);
        assert_eq!(law.first(), Some(&[-100.0, -3.5]));
        assert_eq!(law.last(), Some(&[100.0, 3.5]));
        let lines: Vec<_> = law.split(|point| point[0].is_nan()).collect();
        assert_eq!(lines[1], [[0.0, -4.0], [0.0, 4.0]], "it turns back on itself");
        assert!(lines.concat().is_sorted_by(|a, b| a[0] <= b[0]));
        let drag = Scene::paper().with_law("viscous").expect("a law").expect("a scene");
        let slide = curve(&drag, 1000.0);
        assert_eq!(slide.last(), Some(&[1000.0, 2.0]));
        // It holds nothing.
        let is_drag = |[velocity, force]: &[f64; 2]| (force - velocity / 500.0).abs() < 1e-9;
        assert!(slide.iter().all(is_drag));
    }
}

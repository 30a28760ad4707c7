//! The picture, for 80 columns and 24 lines and more.

use super::model::{Model, WINDOW_S};
use crate::timing;
use haptic_ipc::{Percentiles, RigState, Sample};
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Clear, Dataset, GraphType, Paragraph};

/// Colours, or what takes their place where there are none.
#[derive(Clone, Copy)]
pub(super) struct Theme {
    coloured: bool,
}

impl Theme {
    pub(super) const fn new(coloured: bool) -> Self {
        Self { coloured }
    }

    fn colour(self, colour: Color) -> Style {
        if self.coloured {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    fn state(self, state: RigState) -> Style {
        let colour = match state {
            RigState::Engaged | RigState::Engaging => Color::Green,
            RigState::Releasing => Color::Yellow,
            RigState::Stopped | RigState::Faulted => Color::Red,
            RigState::Idle | RigState::Disconnected => Color::Gray,
        };
        self.colour(colour).add_modifier(Modifier::REVERSED | Modifier::BOLD)
    }
}

/// Lines of how the loop keeps time.
const LOOPS_HEIGHT: u16 = 10;

/// Lines of the curves below which all room is theirs.
const CURVES_HEIGHT: u16 = 5;

/// Columns in which a curve's name and value can be read.
const CURVE_WIDTH: u16 = 36;

pub(super) fn draw(frame: &mut Frame<'_>, model: &Model, theme: Theme) {
    // What the hand feels is worth more than how the loop keeps time.
    let has_room_for_loops = frame.area().height >= 4 + CURVES_HEIGHT + LOOPS_HEIGHT;
    let [title, scene, message, plots, loops, keys] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Fill(1),
        Constraint::Length(if has_room_for_loops { LOOPS_HEIGHT } else { 0 }),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    draw_title(frame, title, model, theme);
    draw_scene(frame, scene, model);
    draw_message(frame, message, model, theme);
    let halves = [Constraint::Fill(1), Constraint::Fill(1)];
    let [force, position] = if plots.width >= 2 * CURVE_WIDTH {
        Layout::horizontal(halves).areas(plots)
    } else {
        Layout::vertical(halves).areas(plots)
    };
    let force_limit = model.status.as_ref().map_or(1.0, |status| status.device.force_limit_n);
    let force_curve = Curve {
        title: "force on the hand",
        unit: "N",
        value: |sample| sample.command_force_n,
        full_scale: Some(force_limit),
        style: theme.colour(Color::Cyan),
    };
    force_curve.draw(frame, force, model);
    let position_curve = Curve {
        title: "position of the device",
        unit: "mm",
        value: |sample| sample.device_position_m * 1e3,
        full_scale: None,
        style: theme.colour(Color::Yellow),
    };
    position_curve.draw(frame, position, model);
    let [histogram, health] = Layout::horizontal([Constraint::Length(38), Constraint::Fill(1)]).areas(loops);
    draw_histogram(frame, histogram, model);
    draw_health(frame, health, model, theme);
    let help = " space/Esc STOP   e engage   r release   R reset   ? help   q quit";
    frame.render_widget(Paragraph::new(help).style(Modifier::REVERSED), keys);
    if model.help {
        draw_help(frame);
    }
}

fn draw_title(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let [left, middle, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(16), Constraint::Fill(1)]).areas(area);
    frame.render_widget(Paragraph::new(format!(" {}", model.server)), left);
    if let Some(state) = &model.state {
        let shown = state.state.to_string().to_uppercase();
        let style = theme.state(state.state);
        frame.render_widget(Paragraph::new(shown).style(style).alignment(Alignment::Center), middle);
    }
    if let Some(status) = &model.status {
        let shown = format!("{:.0} Hz, up {} ", status.rate_hz, elapsed(status.uptime_s));
        frame.render_widget(Paragraph::new(shown).alignment(Alignment::Right), right);
    }
}

fn draw_scene(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let Some(state) = &model.state else { return };
    let name = if state.scene.is_empty() {
        "unnamed"
    } else {
        &state.scene
    };
    let shown = format!(
        " scene {name}, {}, revision {} (undo {}, redo {})",
        state.law, state.revision, state.undo_depth, state.redo_depth
    );
    frame.render_widget(Paragraph::new(shown), area);
}

/// The last answer, and a fault for as long as there is one.
fn draw_message(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let bad = theme.colour(Color::Red).add_modifier(Modifier::BOLD);
    let fault = model.state.as_ref().and_then(|state| state.fault.as_ref());
    let fault = fault.map(|fault| format!("fault: {fault}; R resets"));
    let message = model.message.as_ref();
    let is_bad = fault.is_some() || message.is_some_and(|message| message.is_bad);
    let texts: Vec<String> = message
        .map(|message| message.text.clone())
        .into_iter()
        .chain(fault)
        .collect();
    let style = if is_bad {
        bad
    } else {
        Style::new().add_modifier(Modifier::BOLD)
    };
    frame.render_widget(Paragraph::new(format!(" {}", texts.join("   "))).style(style), area);
}

/// A value over time, with its newest on a gauge.
struct Curve {
    title: &'static str,
    unit: &'static str,
    value: fn(&Sample) -> f64,
    /// Where the gauge ends on either side; without one it ends where the curve does.
    full_scale: Option<f64>,
    style: Style,
}

impl Curve {
    fn draw(&self, frame: &mut Frame<'_>, area: Rect, model: &Model) {
        let points: Vec<(f64, f64)> = model
            .past
            .iter()
            .map(|sample| (sample.t_s, (self.value)(sample)))
            .collect();
        let newest = points.last().copied();
        let title = newest.map_or_else(
            || format!(" {} ", self.title),
            |(_, value)| format!(" {}  {value:+.2} {} ", self.title, self.unit),
        );
        let block = Block::bordered().title(title);
        let inner = block.inner(area);
        frame.render_widget(block, area);
        let [plot, gauge] = Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]).areas(inner);
        let Some((now_s, value)) = newest else { return };
        let largest = points.iter().map(|(_, value)| value.abs()).fold(0.0, f64::max);
        let limit = round_up(largest);
        let dataset = Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(self.style)
            .data(&points);
        let chart = Chart::new(vec![dataset])
            .x_axis(Axis::default().bounds([now_s - WINDOW_S, now_s]))
            .y_axis(Axis::default().bounds([-limit, limit]).labels([
                format!("{:+}", -limit),
                "0".to_owned(),
                format!("{limit:+}"),
            ]));
        frame.render_widget(chart, plot);
        let full_scale = self.full_scale.unwrap_or(limit);
        let text = signed_gauge(value / full_scale, usize::from(gauge.width));
        frame.render_widget(Paragraph::new(text).style(self.style), gauge);
    }
}

/// The next of 1, 2, 5, 10, 20... that is not smaller.
fn round_up(value: f64) -> f64 {
    let least = value.max(0.1);
    let decade = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * decade >= least);
    step.unwrap_or(10.0) * decade
}

/// A bar to the right or the left of the middle for a share from -1 to 1 of its half.
fn signed_gauge(share: f64, width: usize) -> String {
    let half = width.saturating_sub(1) / 2;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a share of a line's width"
    )]
    let filled = (share.abs().min(1.0) * half as f64).round() as usize;
    let (left, right) = if share < 0.0 { (filled, 0) } else { (0, filled) };
    format!(
        "{}{}|{}{}",
        "\u{b7}".repeat(half - left),
        "\u{2588}".repeat(left),
        "\u{2588}".repeat(right),
        "\u{b7}".repeat(half - right)
    )
}

fn draw_histogram(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let block = Block::bordered().title(" wake-up latency, last 10 s ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let Some(timing) = &model.timing else { return };
    let buckets = &timing.last_10_s.histogram.wake_latency_ns;
    let shown = buckets.iter().skip_while(|bucket| bucket.count == 0).count();
    // The slowest are those to be seen.
    let first = buckets.len() - shown.min(usize::from(inner.height));
    let text = timing::histogram(&buckets[first..], 12.0);
    frame.render_widget(Paragraph::new(text), inner);
}

fn draw_health(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let block = Block::bordered().title(" loop and link ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let doubtful = |count: u64| {
        if count > 0 {
            theme.colour(Color::Red).add_modifier(Modifier::BOLD)
        } else {
            Style::new()
        }
    };
    let mut lines: Vec<Line<'_>> = Vec::new();
    if let Some(timing) = &model.timing {
        let window = &timing.last_10_s;
        lines.push(Line::from("               p50      p99      max us"));
        lines.push(percentiles("wake-up", &window.wake_latency_ns));
        lines.push(percentiles("tick", &window.tick_ns));
        let counts = [
            ("overruns", timing.since_start.overruns),
            ("missed", timing.since_start.missed_periods),
            ("lost", timing.since_start.telemetry_dropped + model.lost),
        ];
        lines.push(Line::from_iter(counts.into_iter().flat_map(|(name, count)| {
            [
                Span::raw(format!("{name} ")),
                Span::styled(format!("{count}  "), doubtful(count)),
            ]
        })));
    }
    if let Some(status) = &model.status {
        match &status.device.link {
            None => lines.push(Line::from("rig: in the daemon itself")),
            Some(link) => {
                lines.push(Line::from(format!(
                    "link: {:.0} us (max {:.0}), {:.0} us old",
                    link.round_trip_us, link.round_trip_max_us, link.age_us
                )));
                let counts = &link.counts;
                let bad = counts.lost + counts.bad_crc + counts.malformed;
                let text = format!(
                    "lost {}, bad CRC {}, malformed {}",
                    counts.lost, counts.bad_crc, counts.malformed
                );
                lines.push(Line::styled(text, doubtful(bad)));
            }
        }
        let thread = &status.real_time;
        lines.push(Line::from(format!("{}, {}", thread.scheduling(), thread.place())));
        lines.push(Line::from(format!(
            "{}, {} clients",
            thread.memory(),
            // This program is two of them.
            status.clients
        )));
        lines.push(Line::from(status.device.description.clone()));
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

#[expect(clippy::cast_precision_loss, reason = "durations below 2^53 ns")]
fn percentiles(name: &str, of: &Percentiles) -> Line<'static> {
    let shown = |ns: u64| {
        let us = ns as f64 * 1e-3;
        if us < 1e5 {
            format!("{us:.1}")
        } else {
            format!("{:.0} ms", us * 1e-3)
        }
    };
    Line::from(format!(
        "{name:9}{:>9}{:>9}{:>9}",
        shown(of.p50),
        shown(of.p99),
        shown(of.max)
    ))
}

fn draw_help(frame: &mut Frame<'_>) {
    let text = "\
space, Esc   STOP: zero force at once
e            engage: let the force in, along a ramp
r            release: let the force out, along a ramp
R            reset: clear a stop or a fault
?, h         this help
q, Ctrl-C    quit; the rig stays as it is

A stop is shown with the tick that carried it out.";
    let area = frame.area();
    let (width, height) = (58.min(area.width), 10.min(area.height));
    let area = Rect {
        x: (area.width - width) / 2,
        y: (area.height - height) / 2,
        width,
        height,
    };
    frame.render_widget(Clear, area);
    frame.render_widget(Paragraph::new(text).block(Block::bordered().title(" keys ")), area);
}

fn elapsed(seconds: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the cast saturates"
    )]
    let whole = seconds as u64;
    format!("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60)
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::{Bucket, Event, SamplesEvent, StateEvent, StateReply, Timing, TimingHistogram, TimingWindow};
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    /// A model with something in every pane.
    fn busy() -> Model {
        let mut model = Model::new("hapticd 0.1.0".into());
        let rows = (0..500)
            .map(|k| Sample {
                tick: k,
                t_s: 0.02 * f64::from(u32::try_from(k).expect("small")),
                state: RigState::Engaged,
                contact: 1,
                device_position_m: 0.03,
                device_velocity_mps: 0.0,
                block_position_m: 0.0,
                block_velocity_mps: 0.0,
                coupling_force_n: 0.0,
                command_force_n: -25.0,
                revision: 1,
                wake_latency_ns: 0,
                tick_ns: 0,
                device_round_trip_ns: 0,
                ..Sample::default()
            })
            .collect();
        let window = TimingWindow {
            histogram: TimingHistogram {
                wake_latency_ns: (0..20)
                    .map(|k| Bucket {
                        up_to: 1 << k,
                        count: k,
                    })
                    .collect(),
                tick_ns: Vec::new(),
            },
            ..TimingWindow::default()
        };
        for event in [
            Event::Samples(SamplesEvent {
                seq: 0,
                dropped: 3,
                rows,
            }),
            Event::Timing(Box::new(Timing {
                rate_hz: 1000.0,
                since_start: window.clone(),
                last_10_s: window,
                ..Timing::default()
            })),
            Event::State(StateEvent {
                state: RigState::Faulted,
                fault: Some("the device sent no new sample for too long".into()),
                tick: 7,
                revision: 1,
                scene: "a scene with a name that is longer than any line on a small terminal can be".into(),
                law: "karnopp".into(),
                params: std::collections::BTreeMap::new(),
                undo_depth: 1,
                redo_depth: 0,
            }),
        ] {
            model.take(event);
        }
        model.help = true;
        model
    }

    fn shown(model: &Model, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("memory");
        terminal
            .draw(|frame| draw(frame, model, Theme::new(true)))
            .expect("drawn");
        terminal.backend().to_string()
    }

    #[test]
    fn no_terminal_is_too_small_to_draw_on() {
        let model = busy();
        for width in 1..100 {
            for height in [1, 2, 3, 5, 8, 13, 24, 60] {
                shown(&model, width, height);
                shown(&Model::new(String::new()), width, height);
            }
        }
    }

    #[test]
    fn on_a_small_terminal_force_and_position_stay() {
        for (width, height) in [(50, 12), (40, 14), (80, 12)] {
            let mut model = busy();
            model.help = false;
            let small = shown(&model, width, height);
            for part in ["force on the hand  -25.00 N", "position of the device  +30.00 mm"] {
                assert!(small.contains(part), "{width}x{height}: {part} is missing:\n{small}");
            }
            assert!(!small.contains("wake-up"), "{small}");
        }
        assert!(shown(&busy(), 80, 24).contains("wake-up"));
    }

    #[test]
    fn a_stop_is_confirmed_in_sight_while_there_is_a_fault() {
        let mut model = busy();
        model.help = false;
        model.moved(
            super::super::model::Intent::Stop,
            &StateReply {
                state: RigState::Faulted,
                tick: 4711,
            },
        );
        let shown = shown(&model, 80, 24);
        assert!(shown.contains("stop confirmed at tick 4711"), "{shown}");
        assert!(shown.contains("fault: the device"), "{shown}");
    }

    #[test]
    fn a_gauge_fills_from_the_middle() {
        assert_eq!(signed_gauge(0.0, 9), "····|····");
        assert_eq!(signed_gauge(0.5, 9), "····|██··");
        assert_eq!(signed_gauge(-3.0, 9), "████|····");
        assert_eq!(signed_gauge(1.0, 0), "|");
    }

    #[test]
    fn an_axis_ends_at_a_round_number() {
        for (value, end) in [
            (0.0, 0.1),
            (0.9, 1.0),
            (1.0, 1.0),
            (3.4, 5.0),
            (5.1, 10.0),
            (12.0, 20.0),
        ] {
            assert!((round_up(value) - end).abs() < 1e-9, "{value}: {}", round_up(value));
        }
    }
}

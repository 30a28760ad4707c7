//! The picture, for 80 columns and 24 lines and more.

use super::curve::Curve;
use super::loops::{draw_health, draw_histogram};
use super::model::{Message, Model};
use haptic_ipc::RigState;
use ratatui::Frame;
use ratatui::layout::{Alignment, Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::widgets::{Block, Clear, Paragraph, Wrap};

/// Lines of the panes of the loop.
const LOOPS_HEIGHT: u16 = 10;

/// Lines of the curves below which they take all room.
const CURVES_HEIGHT: u16 = 5;

/// Columns in which a curve's name and value can be read.
const CURVE_WIDTH: u16 = 36;

pub(super) fn draw(frame: &mut Frame<'_>, model: &Model, theme: Theme) {
    // The force on the hand is worth more than the timing of the loop.
    let has_room_for_loops = frame.area().height >= 4 + CURVES_HEIGHT + LOOPS_HEIGHT;
    let said = Said::of(model);
    let [title, scene, message, plots, loops, keys] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(1),
        Constraint::Length(said.lines(frame.area().width)),
        Constraint::Fill(1),
        Constraint::Length(if has_room_for_loops { LOOPS_HEIGHT } else { 0 }),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    draw_title(frame, title, model, theme);
    draw_scene(frame, scene, model);
    said.draw(frame, message, theme);
    let halves = [Constraint::Fill(1), Constraint::Fill(1)];
    let [force, position] = if plots.width >= 2 * CURVE_WIDTH {
        Layout::horizontal(halves).areas(plots)
    } else {
        Layout::vertical(halves).areas(plots)
    };
    draw_curves(frame, force, position, model, theme);
    let [histogram, health] = Layout::horizontal([Constraint::Length(38), Constraint::Fill(1)]).areas(loops);
    draw_histogram(frame, histogram, model);
    draw_health(frame, health, model, theme);
    let help = " space/Esc STOP   e engage   r release   R reset   ? help   q quit";
    frame.render_widget(Paragraph::new(help).style(Modifier::REVERSED), keys);
    if model.help {
        draw_help(frame);
    }
}

fn draw_curves(frame: &mut Frame<'_>, force: Rect, position: Rect, model: &Model, theme: Theme) {
    let device = model.daemon.status.as_ref().map(|status| &status.device);
    let force_limit = device.map_or(1.0, |device| device.force_limit_n);
    let is_plane = device.is_some_and(|device| device.axes == 2);
    let force_curve = Curve {
        title: if is_plane {
            "force on the hand, length"
        } else {
            "force on the hand"
        },
        unit: "N",
        value: |sample, y| {
            y.map_or(sample.command_force_n, |y| {
                sample.command_force_n.hypot(y.command_force_n)
            })
        },
        beside: None,
        full_scale: Some(force_limit),
        style: theme.colour(Color::Cyan),
    };
    force_curve.draw(frame, force, model);
    let position_curve = Curve {
        title: if is_plane {
            "position of the device, x and y"
        } else {
            "position of the device"
        },
        unit: "mm",
        value: |sample, _| sample.device_position_m * 1e3,
        beside: Some(|y| y.device_position_m * 1e3),
        full_scale: None,
        style: theme.colour(Color::Yellow),
    };
    position_curve.draw(frame, position, model);
}

fn draw_title(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let [left, middle, right] =
        Layout::horizontal([Constraint::Fill(1), Constraint::Length(16), Constraint::Fill(1)]).areas(area);
    frame.render_widget(Paragraph::new(format!(" {}", model.daemon.server)), left);
    if let Some(rig) = model.daemon.rig() {
        let mut shown = rig.state.to_string().to_uppercase();
        if model.is_silent() {
            shown.push_str(", last");
        }
        let style = theme.state(rig.state);
        frame.render_widget(Paragraph::new(shown).style(style).alignment(Alignment::Center), middle);
    }
    if let Some(status) = &model.daemon.status {
        let shown = format!("{:.0} Hz, up {} ", status.rate_hz, elapsed(status.uptime_s));
        frame.render_widget(Paragraph::new(shown).alignment(Alignment::Right), right);
    }
}

fn draw_scene(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let scene = &model.daemon.scene;
    let Some(revision) = scene.revision else { return };
    let name = if scene.name.is_empty() { "unnamed" } else { &scene.name };
    let shown = format!(
        " scene {name}, {}, revision {revision} (undo {}, redo {})",
        scene.law, scene.undo_depth, scene.redo_depth
    );
    frame.render_widget(Paragraph::new(shown), area);
}

/// The last answer, and a fault for as long as there is one.
struct Said {
    text: String,
    is_bad: bool,
}

impl Said {
    fn of(model: &Model) -> Self {
        let fault = model.daemon.rig().and_then(|rig| rig.fault.as_ref());
        let fault = fault.map(|fault| format!("fault: {fault}; R resets"));
        let message = model.message.as_ref();
        let is_bad = fault.is_some() || message.is_some_and(Message::is_bad);
        let texts: Vec<String> = message
            .map(|message| message.text.clone())
            .into_iter()
            .chain(fault)
            .collect();
        Self {
            text: texts.join("   "),
            is_bad,
        }
    }

    /// Lines that it takes: a long refusal has its end where it says what to do.
    fn lines(&self, width: u16) -> u16 {
        const LONGEST_WORD: usize = 12;
        let usable = usize::from(width).saturating_sub(1 + LONGEST_WORD).max(1);
        if self.text.len() < usize::from(width) {
            return 1;
        }
        u16::try_from(self.text.len().div_ceil(usable))
            .unwrap_or(u16::MAX)
            .min(4)
    }

    fn draw(&self, frame: &mut Frame<'_>, area: Rect, theme: Theme) {
        let style = if self.is_bad {
            theme.colour(Color::Red).add_modifier(Modifier::BOLD)
        } else {
            Style::new().add_modifier(Modifier::BOLD)
        };
        let text = format!(" {}", self.text);
        frame.render_widget(Paragraph::new(text).style(style).wrap(Wrap { trim: false }), area);
    }
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

/// The styles of the picture, with or without colours.
#[derive(Clone, Copy)]
pub(super) struct Theme {
    coloured: bool,
}

impl Theme {
    pub(super) const fn new(coloured: bool) -> Self {
        Self { coloured }
    }

    pub(super) fn colour(self, colour: Color) -> Style {
        if self.coloured {
            Style::new().fg(colour)
        } else {
            Style::new()
        }
    }

    pub(super) fn state(self, state: RigState) -> Style {
        let colour = match state {
            RigState::Engaged | RigState::Engaging => Color::Green,
            RigState::Releasing => Color::Yellow,
            RigState::Stopped | RigState::Faulted => Color::Red,
            RigState::Idle | RigState::Disconnected => Color::Gray,
        };
        self.colour(colour).add_modifier(Modifier::REVERSED | Modifier::BOLD)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::failure::Failure;
    use haptic_ipc::{
        Bucket, Event, RigState, Sample, SampleY, SamplesEvent, StateEvent, StateReply, Timing, TimingHistogram,
        TimingWindow,
    };
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    /// A model with something in every pane.
    fn busy() -> Model {
        let mut model = Model::new("hapticd 0.1.0");
        let rows = (0..500)
            .map(|k| Sample {
                tick: k,
                t_s: 0.02 * f64::from(u32::try_from(k).expect("small")),
                state: RigState::Engaged,
                device_position_m: 0.03,
                command_force_n: -25.0,
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
                dropped: 3,
                rows,
                ..SamplesEvent::default()
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
                revision: 1,
                scene: "a scene with a name that is longer than any line on a small terminal can be".into(),
                ..StateEvent::default()
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
        for width in (1..100).step_by(test_run::extent(23, 1)) {
            for height in [1, 2, 3, 5, 8, 13, 24, 60] {
                shown(&model, width, height);
                shown(&Model::new(""), width, height);
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
    fn both_axes_of_a_plane_are_in_sight() {
        let mut model = Model::new("hapticd 0.1.0");
        let row = Sample {
            device_position_m: 0.03,
            ..Sample::default()
        };
        let y = SampleY {
            device_position_m: -0.012,
            ..SampleY::default()
        };
        model.take(Event::Samples(SamplesEvent {
            rows: vec![row],
            rows_y: vec![y],
            ..SamplesEvent::default()
        }));
        let shown = shown(&model, 120, 24);
        assert!(shown.contains("position of the device  +30.00, -12.00 mm"), "{shown}");
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
        let enter = |model: &mut Model, state: RigState, tick: u64| {
            let event = serde_json::json!({ "state": state, "tick": tick, "revision": 1, "scene": "", "params": {} });
            model.take(Event::State(serde_json::from_value(event).expect("an event")));
            self::shown(model, 80, 24)
        };
        assert!(enter(&mut model, RigState::Faulted, 4712).contains("stop confirmed"));
        // Another client has reset and engaged it since, and then released it.
        assert!(!enter(&mut model, RigState::Engaged, 5000).contains("stop confirmed"));
        model.refused(
            super::super::model::Intent::Engage,
            &Failure::Halted("cannot engage".to_owned()),
        );
        assert!(enter(&mut model, RigState::Engaged, 5001).contains("cannot engage"));
        assert!(!enter(&mut model, RigState::Releasing, 6000).contains("cannot engage"));
    }
}

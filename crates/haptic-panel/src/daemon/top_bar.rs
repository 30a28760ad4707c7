//! The connection, the state of the rig, and the buttons that change it.

use super::{Daemon, Link};
use crate::intent::Intent;
use crate::stop::button;
use crate::stop::report::is_halted;
use crate::theme::Palette;
use crate::words::{is_name_of, shortened};
use egui::text::LayoutJob;
use egui::{
    Align, Align2, Area, Button, Color32, Frame, Id, Label, Layout, Rect, RichText, TextStyle, Ui, UiBuilder, Vec2,
    vec2,
};
use haptic_ipc::RigState;
use haptic_ipc::socket_path::{NamedSocket, label};

/// Size for the longest name of a state.
const BADGE_SIZE: Vec2 = vec2(136.0, 36.0);
const COMMAND_SIZE: Vec2 = vec2(84.0, 36.0);

/// Height of the bar, points: four lines in small type.
const HEIGHT: f32 = 60.0;

/// Width of Stop and of the switch of the theme, points. Of what is left, the lines beside the commands have a half,
/// and the reports the other.
const RIGHT_WIDTH: f32 = 230.0;

/// Letters of the reports that fit in a narrow window in usual type.
const MAX_LETTERS: usize = 80;

/// Shows the bar; returns whether Stop was pressed. There is no button for it where a recording is looked at and
/// there was never a rig to stop: its place stays empty, and the keys stop all the same.
pub(crate) fn show(ui: &mut Ui, daemon: &Daemon, is_at_recording: bool, intents: &mut Vec<Intent>) -> bool {
    ui.add_space(4.0);
    let mut stop = false;
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        show_state(ui, daemon, intents);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if is_at_recording && !daemon.stop.is_shown() {
                ui.allocate_space(button::SIZE);
            } else {
                stop = button::show(ui, daemon.is_connected());
            }
            show_theme_switch(ui);
            show_reports(ui, daemon);
        });
    });
    ui.add_space(2.0);
    stop
}

fn show_theme_switch(ui: &mut Ui) {
    let (other, name) = if ui.visuals().dark_mode {
        (egui::Theme::Light, "Light")
    } else {
        (egui::Theme::Dark, "Dark")
    };
    let button = ui.button(RichText::new(name).small());
    if button
        .on_hover_text(format!("{name} colours"))
        .accessible_name("switch theme")
        .clicked()
    {
        ui.ctx().set_theme(other);
    }
}

/// The outcome of the stop, the fault of the rig, why there is none, and the refusal of the daemon. They stand beside
/// the buttons, so that nothing moves away from under the pointer.
fn show_reports(ui: &mut Ui, daemon: &Daemon) {
    let palette = Palette::of(ui);
    let fault = daemon.rig().and_then(|rig| rig.fault.as_ref());
    let lost = match &daemon.link {
        Link::Lost { reason, .. } if daemon.was_connected => Some(reason),
        _ => None,
    };
    let reports = [
        // First: of the others the rest may be cut.
        button::report(ui, &daemon.stop, daemon.rig()),
        lost.map(|why| (format!("Connection lost: {why}"), palette.error_text)),
        daemon
            .why_no_rig()
            .map(|why| (format!("No rig: {why}"), palette.caution_text)),
        fault.map(|fault| (format!("Fault: {fault}"), palette.error_text)),
        daemon
            .refusal()
            .map(|why| (format!("Refused: {why}"), palette.error_text)),
    ];
    let reports: Vec<_> = reports.into_iter().flatten().collect();
    let letters: usize = reports.iter().map(|(text, _)| text.len()).sum();
    let style = if letters > MAX_LETTERS {
        TextStyle::Small
    } else {
        TextStyle::Body
    };
    // It takes no part in the layout: the bar has the same height with and without it.
    let place = ui.available_rect_before_wrap();
    let place = Rect::from_center_size(place.center(), vec2(place.width(), HEIGHT));
    let layout = Layout::top_down(Align::Max);
    let mut child = ui.new_child(UiBuilder::new().max_rect(place).layout(layout));
    child.spacing_mut().item_spacing.y = 0.0;
    // A single report stands in the middle of the bar.
    child.add_space(if letters < MAX_LETTERS / 2 { 16.0 } else { 0.0 });
    let font = style.resolve(child.style());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few rows")]
    let mut rows_left = (HEIGHT / child.text_style_height(&style)) as usize;
    for (text, color) in reports {
        let mut job = LayoutJob::simple(text.clone(), font.clone(), color, place.width());
        (job.wrap.max_rows, job.halign) = (rows_left, Align::Max);
        let lines = child.painter().layout_job(job);
        rows_left = rows_left.saturating_sub(lines.rows.len());
        child.add(Label::new(lines)).on_hover_text(text);
        if rows_left == 0 {
            break;
        }
    }
}

fn show_state(ui: &mut Ui, daemon: &Daemon, intents: &mut Vec<Intent>) {
    let palette = Palette::of(ui);
    let is_silent = daemon.silence().is_some();
    let last: String;
    let (badge, fill) = match (&daemon.link, daemon.rig()) {
        (Link::Connecting { .. }, _) => ("Connecting", palette.caution),
        (Link::Lost { .. }, _) if !daemon.was_connected => ("No daemon", palette.rest),
        (Link::Lost { .. }, _) => ("Not connected", palette.halt),
        (Link::Connected { .. }, None) => ("Connected", palette.rest),
        (Link::Connected { .. }, Some(rig)) if is_silent => {
            last = format!("{}, last", describe(rig.state));
            (last.as_str(), palette.rest)
        }
        (Link::Connected { .. }, Some(rig)) => (describe(rig.state), palette.state(rig.state)),
    };
    show_badge(ui, badge, fill);
    let state = daemon.rig().map(|rig| rig.state).filter(|_| daemon.takes_commands());
    show_commands(ui, state, daemon.asks_before_engaging(), intents);
    let (first, second, hint) = match &daemon.link {
        Link::Connected { path } => {
            let hint = path.display().to_string();
            (
                format!("{}, {}", label(path), daemon.mirror.server),
                scene_line(daemon),
                hint,
            )
        }
        Link::Lost { path, .. } if daemon.was_connected => {
            let hint = "The panel keeps trying and connects by itself".to_owned();
            (label(path), "Trying to connect".to_owned(), hint)
        }
        _ => return,
    };
    let width = ((ui.available_width() - RIGHT_WIDTH) / 2.0).max(0.0);
    ui.allocate_ui_with_layout(vec2(width, HEIGHT), Layout::top_down(Align::Min), |ui| {
        ui.add_space(8.0);
        ui.add(Label::new(first).truncate()).on_hover_text(hint);
        shortened(ui, RichText::new(&second).weak(), &second);
    });
}

/// The active scene, the scene of the library that it comes from, and whether it was changed since.
fn scene_line(daemon: &Daemon) -> String {
    let scene = &daemon.mirror.scene.name;
    if scene.is_empty() {
        return String::new();
    }
    let status = daemon.mirror.status.as_ref();
    let origin = status.and_then(|status| status.library_scene.as_ref());
    let origin = origin.map(|origin| {
        let name = if is_name_of(&origin.name, scene) {
            "library"
        } else {
            &origin.name
        };
        let changed = if origin.changed { ", changed" } else { "" };
        format!(" ({name}{changed})")
    });
    format!("Scene: {scene}{}", origin.unwrap_or_default())
}

/// Shows the state. The buttons beside it never move.
fn show_badge(ui: &mut Ui, text: &str, fill: Color32) {
    let palette = Palette::of(ui);
    Frame::new().fill(fill).corner_radius(4).show(ui, |ui| {
        let text = RichText::new(text).size(18.0).strong().color(palette.on_fill);
        ui.add_sized(BADGE_SIZE, Label::new(text));
    });
}

/// The commands in a state, except Stop; without a daemon none can be given. No other button ever stands in the place
/// of Engage: a second click on Reset must not engage the rig.
fn show_commands(ui: &mut Ui, state: Option<RigState>, asked: Option<Intent>, intents: &mut Vec<Intent>) {
    let engages = matches!(state, Some(RigState::Idle | RigState::Releasing));
    let is_halted = state.is_some_and(is_halted);
    let hint = if is_halted { "Reset first" } else { "Ramp the force up" };
    show_command(ui, "Engage", hint, engages, Intent::Engage, intents);
    let asked = asked.filter(|_| state == Some(RigState::Idle));
    let is_asked = asked.is_some();
    let (label, hint, intent) = match (state, asked) {
        _ if is_halted => (
            "Reset",
            "Clear the stop or the fault; the force stays off until you engage",
            Intent::Reset,
        ),
        (_, Some(Intent::SameRig)) => (
            "Same rig",
            "Say that this is the rig that was commissioned; then engage it",
            Intent::SameRig,
        ),
        (_, Some(intent)) => (
            "Anyway",
            "Engage with this scene once, although the rig would chatter; keep a finger on Stop",
            intent,
        ),
        _ => ("Release", "Ramp the force down", Intent::Release),
    };
    let has_none = |state| matches!(state, RigState::Disconnected | RigState::Idle | RigState::Releasing);
    let is_of_use = is_asked || state.is_some_and(|state| !has_none(state));
    show_command(ui, label, hint, is_of_use, intent, intents);
}

fn show_command(ui: &mut Ui, label: &str, hint: &str, is_enabled: bool, intent: Intent, intents: &mut Vec<Intent>) {
    let button = Button::new(RichText::new(label).size(16.0)).min_size(COMMAND_SIZE);
    let button = ui.add_enabled(is_enabled, button).on_disabled_hover_text(hint);
    if button.on_hover_text(hint).clicked() {
        intents.push(intent);
    }
}

fn describe(state: RigState) -> &'static str {
    match state {
        RigState::Disconnected => "No rig",
        RigState::Idle => "Idle",
        RigState::Engaging => "Engaging",
        RigState::Engaged => "Engaged",
        RigState::Releasing => "Releasing",
        RigState::Stopped => "Stopped",
        RigState::Faulted => "Faulted",
    }
}

/// Explains why there is neither a scene nor a plot. Whoever looks at a recording misses no daemon.
pub(crate) fn explain_no_daemon(ui: &mut Ui, daemon: &Daemon, is_at_recording: bool, intents: &mut Vec<Intent>) {
    let color = if is_at_recording {
        ui.visuals().text_color()
    } else {
        Palette::of(ui).error_text
    };
    match &daemon.link {
        Link::Connected { .. } => {}
        Link::Connecting { path } => {
            ui.heading("Connecting to the daemon");
            ui.label(format!("Socket: {}", path.display()));
        }
        Link::Lost { path, reason } => {
            ui.heading("Not connected to a daemon");
            ui.label(format!("Socket: {}", path.display()));
            ui.add(Label::new(RichText::new(reason).color(color)).wrap());
            ui.label("The panel keeps trying and connects by itself.");
            ui.add_space(8.0);
            offer_rigs(ui, &daemon.rigs, intents);
        }
    }
}

/// Offers the rigs that there are instead of one that is gone, over its plots, which stay. While nobody knows whether
/// that one pulls, nothing leads away from it.
pub(crate) fn offer_others(ui: &Ui, daemon: &Daemon, intents: &mut Vec<Intent>) {
    if let (true, false, Link::Lost { .. }) = (daemon.was_connected, daemon.is_rig_unknown(), &daemon.link) {
        let area = Area::new(Id::unique("other rigs")).anchor(Align2::CENTER_CENTER, Vec2::ZERO);
        area.show(ui.ctx(), |ui| {
            Frame::popup(ui.style()).show(ui, |ui| offer_rigs(ui, &daemon.rigs, intents));
        });
    }
}

/// A button for each rig that the panel can connect to instead, the fake one included.
fn offer_rigs(ui: &mut Ui, rigs: &[NamedSocket], intents: &mut Vec<Intent>) {
    offer_named_rigs(ui, rigs, intents);
    let start = ui.add(Button::new(RichText::new("Start the fake rig").size(16.0)).min_size(vec2(0.0, 36.0)));
    let hint = "A simulated rig, until this window closes; the pointer is your hand on it";
    if start.on_hover_text(hint).clicked() {
        intents.push(Intent::StartFakeRig);
    }
}

fn offer_named_rigs(ui: &mut Ui, rigs: &[NamedSocket], intents: &mut Vec<Intent>) {
    if rigs.is_empty() {
        return;
    }
    ui.label("Other rigs of this machine:");
    ui.horizontal_wrapped(|ui| {
        for NamedSocket { path, .. } in rigs {
            let button = Button::new(RichText::new(label(path)).size(16.0)).min_size(vec2(0.0, 36.0));
            let hint = format!("Connect to {}", path.display());
            if ui.add(button).on_hover_text(hint).clicked() {
                intents.push(Intent::ConnectTo { path: path.clone() });
            }
        }
    });
    ui.add_space(8.0);
}

//! The subject's window: cursor and targets, or which surface is felt, and what to do. It can be read at two metres,
//! and shows nothing of the scene. Space and Escape stop here as well.

mod surfaces;
mod targets;
mod words;

use crate::stop::button;
use crate::study::{SubjectAction, SubjectFrame, SubjectScreen, subject_window_id};
use egui::{CentralPanel, Context, Event, Key, Modifiers, PointerButton, Ui, ViewportBuilder, ViewportId};
use haptic_studies::session::Phase;
use std::sync::Arc;
use std::time::{Duration, Instant};

const TITLE: &str = "Subject's screen";

/// Its usual size, points.
const SIZE: [f32; 2] = [1024.0, 640.0];

/// Time between two places of a pointer that rests and is the hand on the rig.
const AGAIN: Duration = Duration::from_millis(33);

/// Shows the window while it is open.
pub(crate) fn show(ctx: &Context, screen: &Arc<SubjectScreen>) {
    if !screen.is_open() {
        return;
    }
    let window = ViewportBuilder::default()
        .with_title(TITLE)
        .with_app_id("haptic-gui")
        .with_inner_size(SIZE)
        .with_fullscreen(screen.is_full_screen());
    let screen = Arc::clone(screen);
    ctx.show_viewport_deferred(subject_window_id(), window, move |ui, _| draw(ui, &screen));
}

fn draw(ui: &mut Ui, screen: &SubjectScreen) {
    // The key was sent when it was seen; the panel shows what becomes of it.
    if button::take_keys(ui) {
        ui.ctx().request_repaint_of(ViewportId::ROOT);
    }
    let is_closed = ui.input(|input| input.viewport().close_requested());
    if is_closed {
        screen.set_open(None);
        ui.ctx().request_repaint_of(ViewportId::ROOT);
        return;
    }
    if ui.input_mut(|input| input.consume_key(Modifiers::NONE, Key::F11)) {
        screen.set_full_screen(!screen.is_full_screen());
        ui.ctx().request_repaint_of(ViewportId::ROOT);
    }
    let frame = screen.begin_frame(Instant::now());
    if let Some(target_m) = pointed_m(ui, &frame) {
        screen.point(target_m);
        ui.ctx().request_repaint_after(AGAIN);
    }
    let shown = CentralPanel::no_frame().show(ui, |ui| contents(ui, &frame));
    for action in shown.inner {
        screen.act(action);
    }
}

/// Where the pointer is, m of the rig, where it is the hand on the rig.
fn pointed_m(ui: &Ui, frame: &SubjectFrame) -> Option<f64> {
    let hand = frame.hand.as_ref()?;
    let at = ui.input(|input| input.pointer.hover_pos())?;
    Some(hand.mapping.rig_m(targets::task_m(ui.max_rect(), hand.reach_m, at)))
}

/// Draws what the subject sees; returns what the subject does.
fn contents(ui: &mut Ui, frame: &SubjectFrame) -> Vec<SubjectAction> {
    let Some(view) = &frame.view else {
        words::show(ui, &words::NOBODY, None);
        return Vec::new();
    };
    if let Phase::Wait | Phase::Feel(_) | Phase::Question = view.phase {
        let answer = surfaces::show(ui, view.phase);
        return answer.into_iter().map(SubjectAction::Answer).collect();
    }
    match &view.phase {
        Phase::Targets(targets) => targets::show(ui, targets, frame, view.feedback),
        _ => words::show(ui, &words::of(view, frame.reach_m > 0.0), Some(view)),
    }
    vec![SubjectAction::Click; clicks(ui)]
}

/// The clicks of the mouse and Enter since the last frame: each press counts, though its release may be in the same
/// frame, and not the release; a held key is one click.
fn clicks(ui: &Ui) -> usize {
    let area = ui.max_rect();
    let is_click = |event: &&Event| match event {
        Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed: true,
            ..
        } => area.contains(*pos),
        Event::Key {
            key: Key::Enter,
            pressed: true,
            repeat: false,
            ..
        } => true,
        _ => false,
    };
    ui.input(|input| input.events.iter().filter(is_click).count())
}

#[cfg(test)]
pub(super) mod tests;

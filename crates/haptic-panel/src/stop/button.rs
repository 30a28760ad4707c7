//! Stop: a button that is always visible, and two keys: Escape stops always, and Space where no text is typed.

use super::report::{StopReport, is_halted};
use crate::theme::{Palette, SMALLEST_TEXT};
use egui::{Align2, Button, Color32, Event, FontId, Key, Ui, vec2};
use haptic_ipc::{RigMirror, RigState};

pub(crate) const SIZE: egui::Vec2 = vec2(168.0, 52.0);

/// Whether an event is a press of Escape, or of Space unless that is typed. A key that is held down is one stop.
pub(crate) fn is_stop_key(event: &Event, is_typing: bool) -> bool {
    let Event::Key {
        key, pressed, repeat, ..
    } = event
    else {
        return false;
    };
    let stops = match key {
        Key::Space => !is_typing,
        key => *key == Key::Escape,
    };
    stops && *pressed && !*repeat
}

/// Removes Space and Escape from the input of every widget; returns whether one of them stops. In a text field Space
/// is typed.
pub(crate) fn take_keys(ui: &Ui) -> bool {
    let is_typing = ui.ctx().text_edit_focused();
    ui.input_mut(|input| {
        let mut stop = false;
        input.events.retain(|event| {
            stop |= is_stop_key(event, is_typing);
            match event {
                Event::Key { key, .. } => !matches!(key, Key::Space | Key::Escape),
                Event::Text(text) => is_typing || text != " ",
                _ => true,
            }
        });
        stop
    })
}

/// Shows the button, which may reach no daemon; returns whether it was pressed.
pub(crate) fn show(ui: &mut Ui, is_reachable: bool) -> bool {
    let palette = Palette::of(ui);
    let hint = match is_reachable {
        true if ui.ctx().text_edit_focused() => "Esc stops",
        true => "Space or Escape",
        false => "cannot reach the daemon",
    };
    let fill = if is_reachable { palette.halt } else { palette.rest };
    let button = ui
        .add_sized(SIZE, Button::new("").fill(fill))
        .accessible_name("Stop")
        .on_hover_text("Zero force at once. Escape does the same, and Space unless you type in a text field.");
    // A button has one line of text; this one needs two.
    for (text, size, y) in [("Stop", 22.0, -8.0), (hint, SMALLEST_TEXT, 14.0)] {
        let at = button.rect.center() + vec2(0.0, y);
        let font = FontId::proportional(size);
        ui.painter()
            .text(at, Align2::CENTER_CENTER, text, font, palette.on_fill);
    }
    // On the press instead of the release: a pulled hand does not click neatly.
    let (pressed, released) = ui.input(|input| (input.pointer.primary_pressed(), input.pointer.primary_released()));
    let by_press = pressed && button.is_pointer_button_down_on();
    // A click by keyboard or screen reader has no press; a quick click has both in one frame.
    by_press || (button.clicked() && (!released || pressed))
}

/// The outcome of the stop, or what the known rig says of one, and the colour of its text.
pub(crate) fn report(ui: &Ui, stop: &StopReport, rig: Option<&RigMirror>) -> Option<(String, Color32)> {
    let palette = Palette::of(ui);
    let plain = ui.visuals().strong_text_color();
    const CUT: &str = "Cut the motor's power";
    let confirmed = match stop {
        StopReport::Waiting { .. } => return Some(("Stop asked for, not sent yet".to_owned(), palette.caution_text)),
        StopReport::Sent { is_late: false, .. } => {
            return Some(("Stop sent, not confirmed yet".to_owned(), palette.caution_text));
        }
        StopReport::Sent { is_late: true, .. } => {
            let text = format!("Stop sent, NOT confirmed: the daemon does not answer. {CUT}.");
            return Some((text, palette.error_text));
        }
        StopReport::Failed { reason } => return Some((format!("Not stopped: {reason}"), palette.error_text)),
        StopReport::NoDevice { reason } => return Some((format!("Stop not heard: {reason}"), palette.error_text)),
        StopReport::NotSent { reason } => {
            return Some((
                format!("Stop NOT sent: {reason}. {CUT}. It is still tried."),
                palette.error_text,
            ));
        }
        StopReport::Confirmed { after, tick } => Some((format!(" (confirmed, {} ms)", after.as_millis()), *tick)),
        StopReport::Settled => None,
    };
    let rig = rig.filter(|rig| is_halted(rig.state))?;
    let what = if rig.state == RigState::Stopped {
        "Stopped"
    } else {
        "Zero force"
    };
    let earlier = if rig.is_begin_seen { "" } else { " or earlier" };
    let text = match (confirmed, rig.state) {
        (Some((confirmed, tick)), _) => format!("{what}{confirmed} at tick {tick}"),
        (None, RigState::Stopped) => format!("Stopped at tick {}", rig.tick) + earlier,
        (None, _) => format!("Zero force since tick {}", rig.tick) + earlier,
    };
    Some((text, plain))
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::Modifiers;
    use egui_kittest::Harness;

    #[test]
    fn no_widget_sees_the_keys_that_stop() {
        let key = |key| Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::CTRL,
        };
        for (event, stops) in [
            (key(Key::Space), true),
            (key(Key::Escape), true),
            (Event::Text(" ".into()), false),
        ] {
            let draw = |ui: &mut Ui, (stopped, left_over): &mut (bool, bool)| {
                *stopped |= take_keys(ui);
                *left_over |= ui.input(|input| input.events.contains(&event));
            };
            let mut harness = Harness::new_ui_state(draw, (false, false));
            harness.event(event.clone());
            harness.run();
            assert_eq!(*harness.state(), (stops, false), "{event:?}");
        }
    }
}

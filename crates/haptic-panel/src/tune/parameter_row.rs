//! One parameter on the screen: its name and symbol, a slider and a field for each direction, and the
//! outcome of the last change.

use super::advice_lines;
use super::edit::{Edit, EditBy, Outcome, ParameterEdits};
use crate::daemon::Daemon;
use crate::daemon::advice::active_value;
use crate::theme::Palette;
use crate::words::{sentence_case, spoken};
use egui::accesskit::Action;
use egui::text::{CCursor, CCursorRange};
use egui::text_edit::TextEditState;
use egui::{Align, Align2, Id, Key, Label, Layout, RichText, Sense, Slider, SliderClamping, TextEdit, Ui, vec2};
use haptic_core::Direction;
use haptic_ipc::quantity::{self, number};
use haptic_ipc::{ParameterDescription, set_command};

const FIELD_WIDTH: f32 = 84.0;
const UNIT_WIDTH: f32 = 44.0;
const SIGN_WIDTH: f32 = 12.0;

/// Height of the line with the name, points.
const TITLE_HEIGHT: f32 = 18.0;

/// Share of the length of a slider by which an arrow key moves it.
const KEY_STEP: f64 = 0.01;

/// The same with Shift.
const FINE_KEY_STEP: f64 = 0.001;

/// Shows the parameter, and takes the changes of the user.
pub(crate) fn show(ui: &mut Ui, about: &ParameterDescription, edits: &mut ParameterEdits, daemon: &Daemon) {
    ui.spacing_mut().item_spacing.y = 0.0;
    let height = ui.spacing().interact_size.y;
    ui.spacing_mut().interact_size.y = TITLE_HEIGHT;
    ui.horizontal(|ui| {
        // It takes no keyboard focus: the journal copies by keyboard.
        let title = Label::new(RichText::new(sentence_case(&about.name)).strong()).sense(Sense::CLICK);
        let title = ui.add(title);
        let symbol = ui.label(RichText::new(&about.symbol).italics().weak());
        let title = title.union(symbol).on_hover_text(explanation(about));
        let command = daemon.addressed(set_command([(about.symbol.as_str(), about.value)]));
        title.context_menu(|ui| {
            if ui
                .button("Copy as haptic-ctl command")
                .on_hover_text(&command)
                .clicked()
            {
                ui.ctx().copy_text(command);
            }
        });
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if about.directional {
                show_split(ui, about, edits);
            }
            show_outcome(ui, edits);
        });
    });
    ui.spacing_mut().interact_size.y = height;
    let is_split = edits.is_split(about);
    let directions: &[_] = if is_split {
        &[Some(Direction::Positive), Some(Direction::Negative)]
    } else {
        &[None]
    };
    for &direction in directions {
        show_value(ui, about, edits, direction);
    }
    if is_split {
        // A value for both, as a fix of the adviser sets it, has no row of its own.
        show_refusal(ui, edits.edit(None));
    }
    advice_lines::show(ui, about, edits, &daemon.advised);
}

/// The outcome of the last change, beside the name.
fn show_outcome(ui: &mut Ui, edits: &ParameterEdits) {
    let palette = Palette::of(ui);
    let (text, color) = match edits.outcome() {
        Outcome::None => return,
        Outcome::Pending => ("pending".to_owned(), palette.caution_text),
        Outcome::Applied(0) => ("applied".to_owned(), ui.visuals().weak_text_color()),
        Outcome::Applied(tick) => (format!("applied at tick {tick}"), ui.visuals().weak_text_color()),
        Outcome::Refused => ("refused".to_owned(), palette.error_text),
    };
    ui.label(RichText::new(text).small().color(color));
}

/// The toggle between one row and a row for each direction.
fn show_split(ui: &mut Ui, about: &ParameterDescription, edits: &mut ParameterEdits) {
    let is_split = edits.is_split(about);
    let hint = if is_split {
        "One value for both directions: that of the positive one"
    } else {
        "A value for each direction of motion"
    };
    let name = format!("{} by direction", spoken(&about.name));
    let toggle = ui
        .add(
            egui::Button::selectable(is_split, "±")
                .small()
                .frame_when_inactive(true),
        )
        .accessible_name(name)
        .on_hover_text(hint);
    if toggle.clicked() {
        if is_split {
            edits.join(about);
        } else {
            edits.split = true;
        }
    }
}

fn show_value(ui: &mut Ui, about: &ParameterDescription, edits: &mut ParameterEdits, direction: Option<Direction>) {
    let active = active_value(about, direction);
    let (sign, spoken_name) = match direction {
        None => ("", spoken(&about.name)),
        Some(Direction::Positive) => ("+", format!("{} +", spoken(&about.name))),
        Some(Direction::Negative) => ("-", format!("{} -", spoken(&about.name))),
    };
    let edit = edits.edit(direction);
    ui.horizontal(|ui| {
        if !sign.is_empty() {
            ui.add_sized(vec2(SIGN_WIDTH, ui.spacing().interact_size.y), Label::new(sign));
        }
        let others = FIELD_WIDTH + UNIT_WIDTH + 2.0 * ui.spacing().item_spacing.x;
        let width = ui.available_width() - others;
        show_slider(ui, width, about, edit, active, &spoken_name);
        show_field(ui, about, edit, active, &spoken_name);
        ui.label(&about.unit);
    });
    show_refusal(ui, edit);
}

fn show_refusal(ui: &mut Ui, edit: &Edit) {
    if let Some(refusal) = &edit.refusal {
        let color = Palette::of(ui).error_text;
        ui.add(Label::new(RichText::new(refusal).color(color)).wrap());
    }
}

fn show_slider(ui: &mut Ui, width: f32, about: &ParameterDescription, edit: &mut Edit, active: f64, spoken_name: &str) {
    if about.slider_min >= about.slider_max {
        ui.add_space(width + ui.spacing().item_spacing.x);
        return;
    }
    let mut value = edit.shown(active);
    ui.spacing_mut().slider_width = width;
    let mut slider = Slider::new(&mut value, about.slider_min..=about.slider_max)
        .logarithmic(about.logarithmic)
        .smallest_positive(about.step.max(f64::MIN_POSITIVE))
        .show_value(false)
        // A value typed beyond the slider's range is kept.
        .clamping(SliderClamping::Never);
    if about.step > 0.0 {
        slider = slider.step_by(about.step);
    }
    let before = edit.shown(active);
    let slider = ui
        .add(slider)
        .accessible_name(format!("{spoken_name} slider"))
        .on_hover_text(explanation(about));
    let is_held = slider.is_pointer_button_down_on() || slider.dragged();
    edit.hold(is_held);
    let steps = key_steps(ui, slider.id);
    if steps != 0.0 {
        // The slider's own step is the smallest useful one: a thousand from end to end.
        edit.change(stepped(about, before, steps), EditBy::Keys);
        edit.typing = None;
    } else if slider.changed() {
        // The last change of a drag may come with its end; the rest is a screen reader.
        let hand = if is_held || slider.drag_stopped() {
            EditBy::Drag
        } else {
            EditBy::Once
        };
        edit.change(round_to_step(value, about.step), hand);
        edit.typing = None;
    }
}

/// The share of its length by which the keyboard, or a screen reader, moves a slider now.
fn key_steps(ui: &Ui, slider: Id) -> f64 {
    let has_focus = ui.memory(|memory| memory.has_focus(slider));
    ui.input(|input| {
        let presses = |key| if has_focus { input.num_presses(key) } else { 0 };
        let asked = |action| input.num_accesskit_action_requests(slider, action);
        let up = presses(Key::ArrowRight) + asked(Action::Increment);
        let down = presses(Key::ArrowLeft) + asked(Action::Decrement);
        let step = if input.modifiers.shift { FINE_KEY_STEP } else { KEY_STEP };
        #[expect(clippy::cast_precision_loss, reason = "presses in a frame")]
        let steps = up as f64 - down as f64;
        steps * step
    })
}

/// A value that is moved by a share of the slider's length: at least one step, and not beyond the ends.
fn stepped(about: &ParameterDescription, value: f64, share: f64) -> f64 {
    let ParameterDescription {
        slider_min: low,
        slider_max: high,
        step,
        ..
    } = *about;
    let moved = if about.logarithmic {
        let least = low.max(step).max(f64::MIN_POSITIVE);
        let moved = value.max(least) * (high / least).powf(share);
        if moved < least { low } else { three_digits(moved) }
    } else {
        value + share * (high - low)
    };
    let rounded = round_to_step(moved, step);
    let moved = if rounded == value {
        value + step * share.signum()
    } else {
        rounded
    };
    // A value typed beyond the ends is not moved farther.
    moved.clamp(low.min(value), high.max(value))
}

fn show_field(ui: &mut Ui, about: &ParameterDescription, edit: &mut Edit, active: f64, spoken_name: &str) {
    let mut text = edit.typing.clone().unwrap_or_else(|| number(edit.shown(active)));
    let field = ui
        .add(
            TextEdit::singleline(&mut text)
                // It keeps the focus when another law has other parameters above it.
                .id(Id::unique(("value of", spoken_name)))
                .desired_width(FIELD_WIDTH - 8.0)
                .align(Align2::RIGHT_CENTER),
        )
        .accessible_name(format!("{spoken_name} value"))
        .on_hover_text(explanation(about));
    if field.changed() {
        edit.typing = Some(text);
    }
    if field.changed() || field.gained_focus() {
        edit.refusal = None;
    }
    let is_left_by_key = ui.input(|input| input.key_pressed(Key::Enter) || input.key_pressed(Key::Tab));
    if field.lost_focus()
        && let Some(typed) = edit.typing.take()
        // A click elsewhere drops what is typed by half.
        && is_left_by_key
    {
        match quantity::parse(&typed, &about.unit) {
            Ok(value) => edit.change(value, EditBy::Once),
            Err(why) => edit.refusal = Some(why.to_string()),
        }
    }
    if field.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter)) {
        select_all(ui, field.id, &number(edit.shown(active)));
    }
    edit.field = Some(field.id);
}

/// Selects the whole text of a field, so that the next number replaces it.
fn select_all(ui: &Ui, field: Id, text: &str) {
    let mut state = TextEditState::load(ui.ctx(), field).unwrap_or_default();
    let end = CCursor::new(text.chars().count());
    state
        .cursor
        .set_char_range(Some(CCursorRange::two(CCursor::default(), end)));
    state.store(ui.ctx(), field);
}

/// The value in three significant digits, to the nearest.
fn three_digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Rounds a slider's value to as many decimals as its step has.
fn round_to_step(value: f64, step: f64) -> f64 {
    if !(step > 0.0 && step <= 1.0) {
        return value.round();
    }
    // More decimals than the seventeen digits of a float are noise.
    let decimals = (-step.log10()).ceil().clamp(0.0, 17.0);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "clamped to 0..=17"
    )]
    let decimals = decimals as usize;
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

fn explanation(about: &ParameterDescription) -> String {
    let ParameterDescription { min, max, unit, .. } = about;
    let range = format!(
        "Accepted: {} to {} {unit}; typed as {}",
        number(*min),
        number(*max),
        quantity::accepted(unit)
    );
    format!("More of it: {}.\n{range}", about.feel)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sliders_value_has_no_noise() {
        assert_eq!(round_to_step(0.1 + 0.2, 0.01), 0.3);
        assert_eq!(round_to_step(24_999.7, 1.0), 25_000.0);
        assert_eq!(round_to_step(24_999.7, 0.0), 25_000.0);
        assert_eq!(round_to_step(0.012_345, 1e-300), 0.012_345);
    }

    #[test]
    fn an_arrow_key_moves_a_slider_by_a_step_that_is_felt() {
        let about = |name: &str| {
            let mut rows = ParameterDescription::all_of(&haptic_core::Scene::paper()).into_iter();
            rows.find(|row| row.name == name).expect("a parameter")
        };
        // The mass and the stiffness are logarithmic, the force is not.
        for (name, value, up, fine) in [
            ("mass", 0.5, 0.536, 0.503),
            ("mass", 0.01, 0.011, 0.011),
            ("mass", 10.0, 10.0, 10.0),
            ("mass", 50.0, 50.0, 50.0),
            ("stiffness", 25_000.0, 26_800.0, 25_200.0),
            ("static_force", 4.0, 4.2, 4.02),
            ("velocity_threshold", 0.0, 0.0005, 0.0001),
        ] {
            let about = about(name);
            assert_eq!(stepped(&about, value, KEY_STEP), up, "{name} from {value}");
            assert_eq!(stepped(&about, value, FINE_KEY_STEP), fine, "{name} from {value}, fine");
        }
        assert_eq!(stepped(&about("mass"), 0.536, -KEY_STEP), 0.5, "and back");
        assert_eq!(stepped(&about("static_force"), 0.1, -KEY_STEP), 0.0);
    }
}

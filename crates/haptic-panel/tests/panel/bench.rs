//! A panel on the bench: its model, what it asks for, and a daemon's updates to feed it.

pub(crate) use crate::state::state_event;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_core::Scene;
use haptic_ipc::{
    Description, ErrorCode, Event, Hello, ParameterDescription, RigState, SAMPLE_COLUMNS, Sample, WireError,
};
use haptic_panel::{Answer, Files, Intent, Model, Page, Target, Update};
use std::time::{Duration, Instant};

pub(crate) const SOCKET: &str = "/run/user/1000/hapticd/control.sock";

/// The panel and its intents.
pub(crate) struct Bench {
    pub(crate) model: Model,
    asked: Vec<Intent>,
    /// Zero of the interface's clock, by the system's clock.
    began: Instant,
}

impl Bench {
    /// The system's time.
    fn now(&self, ui: &egui::Ui) -> Instant {
        self.began + Duration::from_secs_f64(ui.input(|input| input.time))
    }
}

pub(crate) type Panel = Harness<'static, Bench>;

/// What hands do to a panel, each with the frames after it.
pub(crate) trait Hands {
    fn hit(&mut self, key: Key);
    fn hit_with(&mut self, modifiers: Modifiers, key: Key);
    fn click_on(&mut self, label: &str);
    fn focus_on(&mut self, label: &str);
}

impl Hands for Panel {
    fn hit(&mut self, key: Key) {
        self.hit_with(Modifiers::NONE, key);
    }

    fn hit_with(&mut self, modifiers: Modifiers, key: Key) {
        self.key_press_modifiers(modifiers, key);
        self.run();
    }

    fn click_on(&mut self, label: &str) {
        self.get_by_label(label).click();
        self.run();
    }

    fn focus_on(&mut self, label: &str) {
        self.get_by_label(label).focus();
        self.run();
    }
}

pub(crate) fn panel() -> Panel {
    let draw = |ui: &mut egui::Ui, bench: &mut Bench| {
        let now = bench.now(ui);
        let asked = haptic_panel::ui(ui, &mut bench.model, now);
        bench.asked.extend(asked);
    };
    let bench = Bench {
        model: Model::new(),
        asked: Vec::new(),
        began: Instant::now(),
    };
    // The smallest supported window.
    let mut panel = Harness::builder()
        .with_size([1024.0, 640.0])
        .with_context_setup(|ctx| {
            haptic_panel::theme::install(ctx);
            draw_glyphs_once(ctx);
        })
        .build_ui_state(draw, bench);
    panel.run();
    panel
}

/// Nobody looks at the pixels, and a new context draws each glyph, unoptimised, for each fraction of a pixel.
fn draw_glyphs_once(ctx: &egui::Context) {
    ctx.all_styles_mut(|style| {
        style.visuals.text_options.subpixel_binning = false;
        style.visuals.text_options.font_hinting = false;
    });
}

/// The daemon's greeting.
pub(crate) fn greeted(path: &str, session: &str) -> Update {
    Update::Connected {
        path: path.into(),
        hello: Hello {
            protocol: 1,
            server: "hapticd 0.1.0".into(),
            session: session.into(),
            rights: haptic_ipc::Rights::All,
        },
        ctl_options: Some("--rig left".into()),
    }
}

/// The daemon's end.
pub(crate) fn lost(path: &str) -> Update {
    Update::Disconnected {
        path: path.into(),
        reason: "the daemon closed the connection".into(),
    }
}

pub(crate) fn lose_the_daemon(panel: &mut Panel) {
    hear(panel, lost(SOCKET));
}

pub(crate) fn find_another_daemon(panel: &mut Panel) {
    hear(panel, greeted(SOCKET, "1-2"));
    hear(panel, in_state(RigState::Idle, 1));
}

/// A panel whose daemon renders the paper's scene.
pub(crate) fn connected(state: RigState) -> Panel {
    let mut panel = panel();
    let scene = Scene::paper();
    let description = Description {
        laws: Vec::new(),
        law: scene.friction.law().to_owned(),
        parameters: ParameterDescription::all_of(&scene),
        sample_columns: SAMPLE_COLUMNS.iter().map(ToString::to_string).collect(),
    };
    hear(&mut panel, greeted(SOCKET, "1-1"));
    hear(&mut panel, Update::Described(description));
    hear(&mut panel, in_state(state, 100));
    panel
}

/// The panel on another page, without what that page asks for by itself.
pub(crate) fn at_page(mut panel: Panel, page: Page) -> Panel {
    panel.state_mut().model.turn_to(page);
    panel.run();
    asked(&mut panel);
    panel
}

pub(crate) fn hear(panel: &mut Panel, update: Update) {
    panel.state_mut().model.apply(update);
    panel.run();
}

/// The daemon has carried out an intent.
pub(crate) fn answer(panel: &mut Panel, intent: Intent, answer: Answer) {
    let result = Ok(answer);
    hear(panel, Update::Answered { intent, result });
}

/// The daemon refuses an intent.
pub(crate) fn refuse(panel: &mut Panel, intent: Intent, code: ErrorCode, message: &str) {
    let result = Err(WireError::new(code, message));
    hear(panel, Update::Answered { intent, result });
}

pub(crate) fn in_state(state: RigState, tick: u64) -> Update {
    Update::Event(Event::State(state_event(state, tick)))
}

pub(crate) fn set(name: &str, value: f64) -> Intent {
    let target = Target {
        name: name.into(),
        direction: None,
    };
    Intent::Set {
        target,
        value,
        merge: false,
    }
}

pub(crate) fn asked(panel: &mut Panel) -> Vec<Intent> {
    std::mem::take(&mut panel.state_mut().asked)
}

pub(crate) fn type_into(panel: &mut Panel, field: &str, text: &str) {
    panel.get_by_label(field).focus();
    panel.run();
    panel.key_press_modifiers(Modifiers::COMMAND, Key::A);
    panel.run();
    panel.get_by_label(field).type_text(text);
    panel.run();
}

/// Types into a field, and presses Enter.
pub(crate) fn enter(panel: &mut Panel, field: &str, text: &str) {
    type_into(panel, field, text);
    panel.hit(Key::Enter);
}

/// Types a text as a keyboard does: a key goes down, gives its letter, and goes up.
pub(crate) fn strike(panel: &mut Panel, text: &str) {
    for letter in text.chars() {
        strike_in_one_frame(panel, &letter.to_string());
    }
}

/// The same, so quickly that no frame is drawn between two keys.
pub(crate) fn strike_in_one_frame(panel: &mut Panel, text: &str) {
    for letter in text.chars() {
        let name = if letter == ' ' {
            "Space".to_owned()
        } else {
            letter.to_uppercase().to_string()
        };
        let key = |pressed| egui::Event::Key {
            key: Key::from_name(&name).expect("a key"),
            physical_key: None,
            pressed,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        let events = [key(true), egui::Event::Text(letter.to_string()), key(false)];
        panel.input_mut().events.extend(events);
    }
    panel.run();
}

/// Runs frames for some seconds of the interface's clock.
pub(crate) fn wait(panel: &mut Panel, seconds: f64) {
    let begin = panel.ctx.input(|input| input.time);
    while panel.ctx.input(|input| input.time) < begin + seconds {
        panel.step();
    }
}

/// The first news of files that `pick` takes.
pub(crate) fn answer_of<T>(files: &Files, pick: impl Fn(Update) -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(answer) = files.updates().find_map(&pick) {
            return answer;
        }
        assert!(began.elapsed() < Duration::from_secs(60), "no answer in time");
        std::thread::yield_now();
    }
}

pub(crate) fn of_depth(undo_depth: usize, redo_depth: usize) -> Update {
    let mut event = state_event(RigState::Engaged, 200);
    (event.undo_depth, event.redo_depth) = (undo_depth, redo_depth);
    Update::Event(Event::State(event))
}

pub(crate) fn is_enabled(panel: &Panel, label: &str) -> bool {
    !panel.get_by_label(label).accesskit_node().is_disabled()
}

pub(crate) fn value_of(panel: &Panel, field: &str) -> String {
    panel.get_by_label(field).value().unwrap_or_default()
}

pub(crate) fn sample(t_s: f64) -> Sample {
    Sample {
        tick: 1,
        t_s,
        state: RigState::Engaged,
        device_position_m: 0.012_34,
        block_position_m: 0.012,
        coupling_force_n: 3.5,
        command_force_n: -3.5,
        revision: 1,
        ..Sample::default()
    }
}

/// Presses a button that may have to be scrolled to.
pub(crate) fn press(panel: &mut Panel, button: &str) {
    panel.get_by_label(button).scroll_to_me();
    panel.run();
    panel.get_by_label(button).click();
    panel.run();
}

/// Presses what bears a label that a text has as well, as the name of a line above its plot.
pub(crate) fn press_item(panel: &mut Panel, item: &str) {
    item_of(panel, item).click();
    panel.run();
}

/// What bears a label, and is no text.
pub(crate) fn item_of<'a>(panel: &'a Panel, item: &'a str) -> egui_kittest::Node<'a> {
    let items = panel.get_all_by_label(item);
    let mut items = items.filter(|node| node.accesskit_node().role() != Role::Label);
    items.next().unwrap_or_else(|| panic!("no {item} to press"))
}

/// Chooses an item of a list.
pub(crate) fn choose_item(panel: &mut Panel, list: &str, item: &str) {
    press(panel, list);
    press_item(panel, item);
}

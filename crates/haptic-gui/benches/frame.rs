//! The cost of a frame of the panel: a minute of samples at 1 kHz in sight, 30 frames a second, and
//! an hour's recording.
//!
//! A frame includes the reading of the daemon's lines, the layout of the whole window and its
//! triangles, without the work of the graphics card. Run with `cargo bench -p haptic-gui`.

#[path = "../../haptic-panel/tests/fixture/metadata.rs"]
mod metadata;
#[path = "../../haptic-panel/tests/fixture/row.rs"]
mod row;
#[path = "../../haptic-panel/tests/fixture/state.rs"]
mod state;

use egui::{Context, RawInput, Rect, vec2};
use haptic_core::Scene;
use haptic_ipc::{Description, Event, Hello, ParameterDescription, RigState, SamplesEvent, SceneReply, params_of};
use haptic_panel::{Loaded, Model, Update, theme};
use haptic_recording::Ending;
use row::row;
use state::state_event;
use std::hint::black_box;
use std::time::{Duration, Instant};

const FRAMES_A_SECOND: u32 = 30;
const ROWS_A_SECOND: u32 = 1000;
const ROWS_A_FRAME: u32 = ROWS_A_SECOND / FRAMES_A_SECOND;

/// Frames that are measured: ten seconds of them.
const FRAMES: u32 = 10 * FRAMES_A_SECOND;

fn batch(from: u32, rows: u32) -> Event {
    Event::Samples(SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: (from..from + rows).map(row).collect(),
        ..SamplesEvent::default()
    })
}

fn connected() -> Model {
    let scene = Scene::paper();
    let mut model = Model::new();
    let hello = Hello {
        protocol: 1,
        server: "hapticd".into(),
        session: "1-1".into(),
        rights: haptic_ipc::Rights::All,
    };
    let path = "/run/hapticd/control.sock".into();
    model.apply(Update::Connected {
        path,
        hello,
        ctl_options: None,
    });
    model.apply(Update::Described(Description {
        laws: vec![],
        law: "karnopp".into(),
        parameters: ParameterDescription::all_of(&scene),
        sample_columns: vec![],
    }));
    model.apply(Update::Event(Event::State(state_event(RigState::Engaged, 0))));
    model.apply(Update::Scene(Ok(Box::new(SceneReply {
        revision: 1,
        params: params_of(&scene),
        scene,
    }))));
    model
}

/// Lays out the window and makes its triangles.
fn draw(ctx: &Context, model: &mut Model) {
    let input = RawInput {
        screen_rect: Some(Rect::from_min_size(egui::Pos2::ZERO, vec2(1280.0, 800.0))),
        ..RawInput::default()
    };
    let mut output = ctx.run_ui(input, |ui| {
        black_box(haptic_panel::ui(ui, model, Instant::now()));
    });
    // There is no graphics card for the fonts.
    output.textures_delta.clear();
    black_box(ctx.tessellate(output.shapes, output.pixels_per_point));
}

/// Time of a frame, reading included, with `seconds` in sight, and the time between two frames.
fn frame(seconds: u32) -> (Duration, Duration) {
    let mut model = connected();
    let ctx = Context::default();
    theme::install(&ctx);
    model.show_span(f64::from(seconds));
    model.apply(Update::Event(batch(0, 60 * ROWS_A_SECOND)));
    let lines: Vec<String> = (0..FRAMES)
        .map(|frame| batch(60 * ROWS_A_SECOND + frame * ROWS_A_FRAME, ROWS_A_FRAME))
        .map(|event| serde_json::to_string(&event).expect("it is written"))
        .collect();
    let mut began = Instant::now();
    for (place, line) in lines.iter().enumerate() {
        if place == 30 {
            // Fonts and caches are there by now.
            began = Instant::now();
        }
        let event: Event = serde_json::from_str(line).expect("it reads");
        model.apply(Update::Event(event));
        draw(&ctx, &mut model);
    }
    (began.elapsed() / (FRAMES - 30), model.pace())
}

/// Time of the usual and of the longest frame with an hour's recording in sight, while samples arrive.
fn frame_of_an_hour() -> (Duration, Duration) {
    let mut model = connected();
    let ctx = Context::default();
    theme::install(&ctx);
    let path = std::path::PathBuf::from("hour.csv");
    let hour = Loaded::new(
        path.clone(),
        metadata::metadata(),
        (0..3600 * ROWS_A_SECOND).map(row),
        &[],
        Ending::Complete,
    );
    model.apply(Update::Opened {
        path,
        result: Ok(Box::new(hour)),
    });
    let mut times: Vec<Duration> = (0..FRAMES)
        .map(|number| {
            let began = Instant::now();
            model.apply(Update::Event(batch(number * ROWS_A_FRAME, ROWS_A_FRAME)));
            draw(&ctx, &mut model);
            began.elapsed()
        })
        .skip(30)
        .collect();
    times.sort();
    (times[times.len() / 2], times[times.len() - 1])
}

fn main() {
    let (usual, longest) = frame_of_an_hour();
    println!(
        "an hour's recording open: {:.2} ms a frame, the longest {:.2} ms",
        usual.as_secs_f64() * 1e3,
        longest.as_secs_f64() * 1e3
    );
    for seconds in [5, 60] {
        let (frame, pace) = frame(seconds);
        println!(
            "{seconds:2} s of 1 kHz in sight: {:.2} ms a frame, {:.1} % of a core at {:.0} frames a second",
            frame.as_secs_f64() * 1e3,
            frame.as_secs_f64() / pace.as_secs_f64() * 100.0,
            1.0 / pace.as_secs_f64()
        );
    }
}

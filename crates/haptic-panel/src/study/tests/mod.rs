//! A subject's study at a daemon that the test plays: what is asked of it, what is kept, and what voids a trial.

mod choosing;
#[path = "../../../tests/fixture/state.rs"]
mod state;

use super::subject_screen::SubjectScreen;
use super::*;
use crate::intent::Intent;
use crate::tape::tests::{at, batch};
use crate::update::{Answer, Update};
use crate::update_sender::UpdateSender;
use haptic_core::Scene;
use haptic_ipc::{
    ChangeReply, ErrorCode, Event, RigState, Sample, SceneReply, StateEvent, Status, SubscribeReply, WireError,
    params_of,
};
use haptic_studies::session::Phase;
use haptic_studies::store;
use haptic_studies::trial::{FittsTrial, PerceptionTrial};
use state::state_event;
use std::path::Path;
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

/// One condition, one resistance, two trials a segment.
const TARGETS: &str = r#"
task = "fitts"
name = "two trials"
practice_segments = 0
trials_per_segment = 2
rest_every_segments = 9
rest_s = 5
baseline = "simulated"
[cursor]
diameter_m = 0.006
[rig]
gain = 2
center_m = 0
range_m = [-0.1, 0.1]
[[conditions]]
name = "1"
amplitude_m = 0.1
width_m = 0.02
[[resistances]]
name = "simulated"
[resistances.scene]
block = { mass = 0.5 }
coupling = { stiffness = 25000, damping = 10 }
[resistances.scene.friction]
law = "karnopp"
static_force = 4.0
dynamic_force = 3.5
"#;

/// One case with a trial at each of three levels.
const SURFACES: &str = r#"
task = "perception"
name = "one question"
practice_trials = 0
interval_s = 0.2
gap_s = 0.3
rest_every_trials = 40
rest_s = 60
[base]
block = { mass = 0.5 }
coupling = { stiffness = 25000, damping = 10 }
[base.friction]
law = "karnopp"
static_force = 4.0
dynamic_force = 3.5
[[tests]]
case = "A"
[tests.constant]
levels_N = [1.0, 1.5, 2.0]
trials_per_level = 1
"#;

const PATIENCE: Duration = Duration::from_secs(30);

/// A study, and the daemon that the test plays.
struct Daemon {
    link: StudyLink,
    updates: mpsc::Receiver<Update>,
    intents: mpsc::Receiver<Intent>,
    folder: tempfile::TempDir,
    tick: u64,
    revision: u64,
    state: RigState,
    position_m: f64,
    rows: Vec<StudyRow>,
    stage: Option<Stage>,
}

impl Daemon {
    /// Makes a study of two subjects from a plan, and opens it.
    fn with_study(plan: &str) -> Self {
        let (updates, received) = UpdateSender::new(|_| {});
        let (asked, intents) = mpsc::channel();
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("plan.toml");
        std::fs::write(&path, plan).expect("a plan");
        let mut daemon = Self {
            link: StudyLink::new(Arc::new(move |intent| asked.send(intent).unwrap_or_default()), updates),
            updates: received,
            intents,
            folder,
            tick: 1000,
            revision: 1,
            state: RigState::Idle,
            position_m: 0.0,
            rows: Vec::new(),
            stage: None,
        };
        daemon.greet();
        daemon.link.command(StudyCommand::Create {
            folder: daemon.study(),
            plan: StudyPlan::File(path),
            subjects: vec!["P7".to_owned(), "P8".to_owned()],
            seed: 1,
        });
        assert_eq!(daemon.intent(), Intent::Stream { batch_ms: 4 });
        daemon.until(|stage| matches!(stage, Stage::Held { is_trouble: false, .. }));
        daemon
    }

    fn study(&self) -> std::path::PathBuf {
        self.folder.path().join("study")
    }

    fn screen(&self) -> &SubjectScreen {
        self.link.screen()
    }

    fn greet(&self) {
        let hello = serde_json::from_str(r#"{"protocol":1,"server":"hapticd","session":"1-1"}"#).expect("a greeting");
        let path = "s".into();
        self.link.hear(&Update::Connected {
            path,
            hello,
            ctl_options: None,
        });
        self.link.hear(&Update::Subscribed(Box::new(SubscribeReply {
            topics: Vec::new(),
            rate_hz: 1000.0,
            batch_ms: 4,
            columns: Vec::new(),
            servo: None,
        })));
        self.tell_state();
        self.link.hear(&Update::Scene(Ok(Box::new(SceneReply {
            revision: self.revision,
            params: params_of(&Scene::paper()),
            scene: Scene::paper(),
        }))));
        self.link.hear(&Update::Status(Ok(Box::new(Self::status()))));
    }

    fn status() -> Status {
        let status = r#"{"server":"hapticd 0.1.0","state":"idle","tick":1,"uptime_s":1,"rate_hz":1000,"scheme":"exact",
            "velocity_estimator":"foaw","revision":1,"scene":"paper","command_force_N":0,"device_position_m":0,"clients":1,
            "device":{"description":"fake rig","force_limit_N":20},"real_time":{"memory_locked":true,"problems":[]}}"#;
        serde_json::from_str(status).expect("a status")
    }

    fn tell_state(&self) {
        self.link.hear(&Update::Event(Event::State(StateEvent {
            fault: (self.state == RigState::Faulted).then(|| "control_lost".to_owned()),
            revision: self.revision,
            ..state_event(self.state, self.tick)
        })));
    }

    fn turn(&mut self, state: RigState) {
        self.state = state;
        self.tell_state();
    }

    /// Lets a number of ticks go by.
    fn ticks(&mut self, count: u64) {
        #[expect(clippy::cast_precision_loss, reason = "few ticks")]
        let row = |tick: u64| Sample {
            tick,
            state: self.state,
            revision: self.revision,
            device_position_m: self.position_m,
            ..at(tick as f64 * 1e-3)
        };
        let rows = (self.tick..self.tick + count).map(row).collect();
        self.tick += count;
        self.link.hear(&Update::Event(Event::Samples(batch(rows))));
    }

    /// The next intent, other than that of the lease.
    fn intent(&self) -> Intent {
        loop {
            match self.intents.recv_timeout(PATIENCE).expect("an intent") {
                Intent::Lease { timeout_ms: 3000 } => {}
                intent => return intent,
            }
        }
    }

    /// Takes the next news.
    fn take_news(&mut self) {
        match self.updates.recv_timeout(PATIENCE) {
            Ok(Update::Study(StudyNews::State(state))) => self.stage = Some(state.stage),
            Ok(Update::Study(StudyNews::Row(row))) => self.rows.push(row),
            Ok(Update::Study(StudyNews::Failed(why))) => panic!("{why}"),
            Ok(_) => {}
            Err(error) => panic!("{error}: {:?}", self.stage),
        }
    }

    /// Waits until the experimenter is shown a stage.
    fn until(&mut self, is_wanted: impl Fn(&Stage) -> bool) {
        while !self.stage.as_ref().is_some_and(&is_wanted) {
            self.take_news();
        }
    }

    /// Waits for the next row of the table.
    fn row(&mut self) -> StudyRow {
        if self.rows.is_empty() {
            self.stage = None;
        }
        while self.rows.is_empty() {
            self.take_news();
        }
        self.rows.remove(0)
    }

    /// Carries out the change of scene that is asked for.
    fn render(&mut self) -> Scene {
        let intent = self.intent();
        self.carry_out(intent, 200)
    }

    /// Carries out a change of scene with a ramp of so many ticks.
    fn carry_out(&mut self, intent: Intent, ramp: u64) -> Scene {
        let Intent::TrialScene {
            scene,
            if_revision,
            ramp_ms,
        } = intent.clone()
        else {
            panic!("no scene is asked for");
        };
        assert_eq!((if_revision, ramp_ms), (self.revision, 200.0));
        self.revision += 1;
        self.tell_state();
        let reply = ChangeReply {
            revision: self.revision,
            changed: true,
            tick: Some(self.tick),
            ramp_ends_tick: Some(self.tick + ramp),
            ..ChangeReply::default()
        };
        let result = Ok(Answer::Changed(reply));
        self.link.hear(&Update::Answered { intent, result });
        *scene
    }

    /// The subject reads the words, and continues.
    fn read(&mut self) {
        self.ticks(600);
        self.screen().act(SubjectAction::Click);
        self.ticks(1);
    }

    /// Moves to a position and clicks there.
    fn click_at(&mut self, position_m: f64) {
        self.position_m = position_m;
        self.ticks(100);
        self.screen().act(SubjectAction::Click);
        self.ticks(1);
    }

    fn go_on(&mut self) {
        self.link.command(StudyCommand::GoOn);
    }

    /// Begins, up to the first scene.
    fn begin_reading(&mut self) {
        self.go_on();
        self.until(|stage| matches!(stage, Stage::Running { what } if what.contains("instructions")));
        self.read();
    }

    /// Begins, up to the first target.
    fn begin(&mut self) {
        self.begin_reading();
        self.render();
        for (state, advice) in [
            (RigState::Idle, "Waiting for the rig: engage it in"),
            (RigState::Faulted, "Waiting for the rig: reset, then engage it in"),
        ] {
            self.turn(state);
            self.until(|stage| matches!(stage, Stage::Waiting { what } if what.starts_with(advice)));
        }
        self.turn(RigState::Engaged);
        self.ticks(300);
        self.until(|stage| matches!(stage, Stage::Running { what } if what.contains("first target")));
    }
}

fn rows(study: &Path) -> Vec<FittsTrial> {
    store::trials(study).expect("rows")
}

fn is_held(stage: &Stage) -> bool {
    let begins = |why: &str| {
        ["Reset, then engage", "Engage", "Go on"]
            .iter()
            .any(|what| why.starts_with(what))
    };
    matches!(stage, Stage::Held { is_trouble: true, why } if begins(why))
}

#[test]
fn a_rig_of_two_axes_gets_no_study() {
    let mut daemon = Daemon::with_study(TARGETS);
    let mut status = Daemon::status();
    status.device.axes = 2;
    daemon.link.hear(&Update::Status(Ok(Box::new(status))));
    daemon.go_on();
    daemon.until(|stage| matches!(stage, Stage::Waiting { what } if what.contains("one axis")));
    let mut asked = daemon.intents.try_iter();
    assert!(asked.all(|intent| matches!(intent, Intent::Lease { .. })));
}

#[test]
fn trial_is_saved_with_its_recording() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin();
    daemon.click_at(-0.025);
    daemon.click_at(0.01);
    daemon.click_at(0.026);
    let row = daemon.row();
    assert_eq!(
        (row.cells[0].as_str(), row.cells[6].as_str(), row.void),
        ("1", "1", None)
    );
    let frame = daemon.screen().begin_frame(Instant::now());
    assert!((frame.cursor_m.expect("a cursor") - 0.052).abs() < 1e-9);
    assert!((frame.reach_m - 0.06).abs() < 1e-9);
    let kept = rows(&daemon.study());
    assert_eq!((kept.len(), kept[0].errors, kept[0].subject.as_str()), (1, 1, "P7"));
    let time_s = kept[0].movement_time_s;
    assert!((time_s - 0.202).abs() < 1e-9, "{time_s}");
    let recording = daemon.study().join(kept[0].recording.as_ref().expect("a recording"));
    assert!(haptic_recording::read(&recording).expect("it is read").rows.len() >= 202);
}

#[test]
fn fault_lost_rig_or_foreign_change_holds_the_study() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin();
    type Trouble = (&'static str, fn(&mut Daemon));
    let troubles: [Trouble; 3] = [
        // The ramp ends before the fault has its name.
        ("the rig is faulted: control_lost", |daemon| {
            daemon.state = RigState::Releasing;
            daemon.ticks(80);
            daemon.tell_state();
            daemon.state = RigState::Faulted;
            daemon.ticks(8);
            daemon.tell_state();
        }),
        ("the rig is disconnected", |daemon| daemon.turn(RigState::Disconnected)),
        ("another program changed the scene", |daemon| {
            daemon.revision += 1;
            daemon.tell_state();
        }),
    ];
    for (why, trouble) in troubles {
        daemon.click_at(-0.025);
        daemon.ticks(50);
        daemon.until(|stage| matches!(stage, Stage::Running { what } if what.contains("moves to")));
        trouble(&mut daemon);
        // Of a rig that is unplugged no tick comes any more.
        if daemon.state != RigState::Disconnected {
            daemon.ticks(10);
        }
        let void = daemon.row().void.expect("it is void");
        assert!(void.starts_with(why), "{why}: {void}");
        daemon.until(is_held);
        // Not by itself, whatever the rig does.
        daemon.turn(RigState::Engaged);
        daemon.ticks(500);
        assert!(daemon.screen().begin_frame(Instant::now()).cursor_m.is_none());
        daemon.go_on();
        if why.starts_with("another") {
            daemon.render();
        }
        daemon.ticks(300);
        daemon.until(|stage| matches!(stage, Stage::Running { what } if what.contains("first target")));
    }
    assert!(rows(&daemon.study()).is_empty());
    daemon.click_at(-0.025);
    daemon.click_at(0.025);
    assert_eq!(daemon.row().void, None);
    assert_eq!(rows(&daemon.study())[0].voided, 3);
}

#[test]
fn a_refused_scene_is_shown_and_asked_for_again_after_consent() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin_reading();
    let intent = daemon.intent();
    daemon.revision += 1;
    daemon.tell_state();
    let error = WireError::new(ErrorCode::Conflict, "the scene is at revision 2");
    let result = Err(error);
    daemon.link.hear(&Update::Answered { intent, result });
    daemon.until(|stage| matches!(stage, Stage::Held { why, .. } if why.contains("the scene is at revision 2")));
    daemon.go_on();
    daemon.render();
}

#[test]
fn question_renders_its_surfaces_in_turn_and_keeps_answer() {
    let mut daemon = Daemon::with_study(SURFACES);
    daemon.begin_reading();
    daemon.turn(RigState::Engaged);
    let mut felt = vec![daemon.render()];
    let began = Instant::now();
    let phase = |daemon: &Daemon| daemon.screen().begin_frame(Instant::now()).view.map(|view| view.phase);
    while phase(&daemon) != Some(Phase::Question) {
        assert!(began.elapsed() < PATIENCE, "{:?}", daemon.stage);
        daemon.ticks(50);
        if let Ok(intent @ Intent::TrialScene { .. }) = daemon.intents.recv_timeout(Duration::from_millis(5)) {
            felt.push(daemon.carry_out(intent, 0));
        }
    }
    assert!(
        felt.len() >= 2 && felt.windows(2).all(|pair| pair[0] != pair[1]),
        "{felt:?}"
    );
    daemon.ticks(700);
    daemon.screen().act(SubjectAction::Answer(1));
    daemon.ticks(1);
    assert_eq!(daemon.row().cells[4], "first");
    let kept: Vec<PerceptionTrial> = store::trials(&daemon.study()).expect("rows");
    assert_eq!((kept.len(), kept[0].answer), (1, 1));
    assert!(kept[0].response_time_s.is_some_and(|time_s| time_s >= 0.7));
}

#[test]
fn closed_study_returns_the_rig_and_can_be_resumed() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin();
    daemon.click_at(-0.025);
    daemon.click_at(0.025);
    daemon.row();
    daemon.link.command(StudyCommand::Note("a \"good\" one".to_owned()));
    daemon.link.command(StudyCommand::Close);
    let mut noted = false;
    loop {
        match daemon.updates.recv_timeout(PATIENCE).expect("news") {
            Update::Study(StudyNews::Closed) => break,
            Update::Study(StudyNews::Noted { outcome, .. }) => noted = outcome.is_ok(),
            _ => {}
        }
    }
    assert!(noted);
    let text = "late".to_owned();
    daemon.link.command(StudyCommand::Note(text.clone()));
    let news = daemon.updates.recv_timeout(PATIENCE).expect("news");
    let is_given_back =
        matches!(&news, Update::Study(StudyNews::Noted { text: given, outcome: Err(_) }) if *given == text);
    assert!(is_given_back, "{news:?}");
    let put_back = Intent::TrialScene {
        scene: Box::new(Scene::paper()),
        if_revision: daemon.revision,
        ramp_ms: 200.0,
    };
    let given_back = [
        put_back,
        Intent::Lease { timeout_ms: 0 },
        Intent::Stream { batch_ms: 34 },
    ];
    let asked: Vec<Intent> = daemon.intents.try_iter().collect();
    assert!(asked.ends_with(&given_back), "{asked:?}");
    daemon.link.command(StudyCommand::Open { folder: daemon.study() });
    let state = loop {
        match daemon.updates.recv_timeout(PATIENCE).expect("news") {
            Update::Study(StudyNews::State(state)) if state.subjects[0].progress.is_some() => break state,
            Update::Study(StudyNews::Failed(why)) => panic!("{why}"),
            _ => {}
        }
    };
    assert_eq!(state.subjects[0].progress, Some((1, Some(4))));
}

#[test]
fn the_subjects_pointer_is_the_hand_where_the_rig_takes_one() {
    let mut daemon = Daemon::with_study(TARGETS);
    assert_eq!(daemon.screen().begin_frame(Instant::now()).hand, None);
    let mut status = Daemon::status();
    status.device.takes_hand = true;
    daemon.link.hear(&Update::Status(Ok(Box::new(status))));
    let scale = daemon.screen().begin_frame(Instant::now()).hand.expect("it takes one");
    assert_eq!(scale.mapping.gain, 2.0);
    daemon.screen().point(0.02);
    daemon.ticks(4);
    daemon.ticks(4);
    assert_eq!(daemon.intent(), Intent::Hand { target_m: 0.02 });
    assert!(daemon.intents.try_recv().is_err(), "once for each place");
}

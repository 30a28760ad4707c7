mod files;

use super::super::perception::Answer;
use super::super::plan::Plan;
use super::super::session::{Feedback, Frame, Instruction, Phase};
use super::super::small_plans::{small_fitts, small_perception};
use super::super::store::{StudyDescription, trials};
use super::super::subject_table::SubjectTable;
use super::super::trial::{FittsTrial, Operator, PerceptionTrial};
use super::*;
use haptic_core::Scene;
use haptic_ipc::{RigState, Sample, SamplesEvent};
use std::path::PathBuf;

fn rig() -> RigDescription {
    RigDescription {
        server: "hapticd".to_owned(),
        device: "a rig".to_owned(),
        loop_rate_hz: 1000.0,
        servo: None,
        configuration: None,
        click_buttons: 0b10,
    }
}

/// Makes a study for people with one subject.
fn make(folder: &Path, text: &str) {
    let plan = Plan::read(text).expect("a plan");
    let subjects = SubjectTable::of_codes(&["P7".to_owned()]);
    let about = StudyDescription::people(&plan, text, 1, &subjects);
    drop(Study::create(folder, text, &about, &subjects).expect("created"));
}

/// A daemon, a rig and a person, tick by tick.
struct Person {
    session: PersonSession,
    tick: u64,
    revision: u64,
    state: RigState,
    position_m: f64,
    buttons: u8,
    session_events: Vec<SessionEvent>,
    /// Scenes that were rendered.
    scenes: Vec<Scene>,
}

impl Person {
    fn new(folder: &Path) -> Self {
        let session = PersonSession::open(folder, "P7", rig()).expect("opened");
        Self {
            session,
            tick: 100,
            revision: 7,
            state: RigState::Engaged,
            position_m: 0.0,
            buttons: 0,
            session_events: Vec::new(),
            scenes: Vec::new(),
        }
    }

    fn tick(&mut self) {
        if let Some(scene) = self.session.take_scene() {
            self.revision += 1;
            self.session.rendered(self.revision, self.tick + 20);
            self.scenes.push(scene);
        }
        self.tick += 1;
        let row = Sample {
            tick: self.tick,
            state: self.state,
            device_position_m: self.position_m,
            revision: self.revision,
            input_flags: u32::from(self.buttons) << 5,
            ..Sample::default()
        };
        self.session.event(&Event::Samples(SamplesEvent {
            rows: vec![row],
            ..SamplesEvent::default()
        }));
        self.listen();
    }

    fn listen(&mut self) {
        self.session.keep(&mut self.session_events).expect("kept");
    }

    fn ticks(&mut self, count: u32) {
        for _ in 0..count {
            self.tick();
        }
    }

    fn phase(&self) -> Phase {
        self.session.view().phase
    }

    /// Goes on until this is so, or all is done.
    fn until(&mut self, is_there: impl Fn(Phase) -> bool) {
        while !is_there(self.phase()) && self.phase() != Phase::Done {
            self.session.proceed();
            self.tick();
        }
    }

    fn find_target(&mut self) {
        self.until(|phase| matches!(phase, Phase::Targets(_)));
    }

    /// Moves to the active target within 300 ticks.
    fn reach(&mut self) {
        if let Phase::Targets(targets) = self.phase() {
            self.position_m = targets.active_m / 3.0;
        }
        self.ticks(300);
    }

    /// Moves to the active target and clicks.
    fn click(&mut self) {
        self.reach();
        self.session.click(self.tick);
        self.listen();
    }

    /// Ends the program: another one continues.
    fn end(self) -> Vec<SessionEvent> {
        self.session.close().expect("closed");
        self.session_events
    }

    /// The row of the last trial that was kept, of the targeting task.
    #[track_caller]
    fn last_row(&self) -> FittsTrial {
        match self.session_events.last() {
            Some(SessionEvent::Kept(TrialRow::Fitts(row))) => (**row).clone(),
            other => panic!("{other:?}"),
        }
    }

    fn kept(&self) -> usize {
        let kept = |event: &&SessionEvent| matches!(event, SessionEvent::Kept(_));
        self.session_events.iter().filter(kept).count()
    }
}

fn a_folder() -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    (parent, folder)
}

/// A study for people with one subject, of this plan.
fn a_study(text: &str) -> (tempfile::TempDir, PathBuf) {
    let (parent, folder) = a_folder();
    make(&folder, text);
    (parent, folder)
}

/// Why a session is not opened.
fn refused(folder: &Path, code: &str) -> String {
    PersonSession::open(folder, code, rig())
        .expect_err("refused")
        .to_string()
}

#[test]
fn a_person_goes_on_after_any_end_and_two_programs_cannot_fight() {
    let (_parent, folder) = a_study(&small_fitts());
    let mut done = 0;
    loop {
        // The program ends after every second click, and so within a segment.
        let mut person = Person::new(&folder);
        assert!(matches!(person.phase(), Phase::Instruction(_)), "{:?}", person.phase());
        let second = refused(&folder, "P7");
        assert!(second.ends_with("another program is running this study"), "{second}");
        for _ in 0..2 {
            person.find_target();
            person.click();
            assert!(matches!(person.session.view().feedback, Some(Feedback::Hit)));
        }
        done += person.kept();
        assert_eq!(person.session.view().done, done);
        let events = person.end();
        let study = Study::open(&folder).expect("opened");
        let subject = study.subject_of("P7").expect("a subject");
        assert_eq!(study.progress(&subject).expect("read"), (done, Some(14)));
        if events.contains(&SessionEvent::Finished) {
            break;
        }
    }
    // Practice, the baseline and two resistances in two conditions, of two trials each.
    assert_eq!(done, 2 + 3 * 2 * 2);
    let all = folder.join("trials.parquet");
    let bytes = std::fs::read(&all).expect("it is there");
    let rows = trials::<FittsTrial>(&folder).expect("read");
    assert!(
        rows.iter()
            .all(|row| row.operator == Some(Operator::Human) && row.subject == "P7")
    );
    // As if the program had been killed after the last row.
    std::fs::remove_file(&all).expect("removed");
    let mut again = Person::new(&folder);
    assert_eq!(again.phase(), Phase::Done);
    again.listen();
    assert_eq!(again.end(), [SessionEvent::Finished]);
    assert_eq!(std::fs::read(&all).expect("it is there again"), bytes);
    assert_eq!(
        refused(&folder, "P8"),
        "`P8` is not a subject of this study; there are P7"
    );
}

#[test]
fn what_disturbs_a_trial_voids_it_and_it_is_done_again() {
    type Disturb = fn(&mut Person);
    let (_parent, folder) = a_study(&small_fitts());
    let disturbances: [(Disturb, &str); 6] = [
        (|person| person.session.pause(), "paused"),
        (|person| person.state = RigState::Stopped, "the rig is stopped"),
        (|person| person.state = RigState::Faulted, "the rig is faulted"),
        (|person| person.tick += 3, "3 ticks are missing"),
        (
            |person| person.revision += 1,
            "another program changed the scene: revision ",
        ),
        (
            |person| person.session.new_link(),
            "the connection to the daemon was re-established",
        ),
    ];
    let mut person = Person::new(&folder);
    for (number, (disturb, reason)) in (1..).zip(disturbances) {
        person.find_target();
        person.click();
        person.ticks(100);
        person.session_events.clear();
        disturb(&mut person);
        // A rig that is stopped or faulted has 50 ms to say why.
        person.ticks(60);
        let [SessionEvent::Voided(voided)] = &person.session_events[..] else {
            panic!("{reason}: {:?}", person.session_events)
        };
        assert!(voided.reason.starts_with(reason), "{}", voided.reason);
        assert!((voided.row, voided.practice) == (1, true), "{voided:?}");
        assert_eq!(person.phase(), Phase::Paused);
        // Nothing continues before the rig is well again and the experimenter consents.
        person.state = RigState::Engaged;
        person.ticks(500);
        assert_eq!(person.phase(), Phase::Paused, "{reason}");
        if number == 3 {
            person.end();
            person = Person::new(&folder);
        }
    }
    person.find_target();
    person.click();
    person.click();
    let row = person.last_row();
    assert_eq!((row.trial, row.voided), (1, 6));
    // Its recording is of the attempt that counts, and knows its scene.
    let (metadata, entries) = recording_of(&folder, row.recording.as_deref());
    assert_eq!(metadata.scene.name, row.resistance);
    let ticks: Vec<u64> = entries.iter().map(|row| row.tick).collect();
    assert_eq!(ticks.last().copied(), row.end_tick);
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1) && Some(ticks[0]) <= row.start_tick);
    person.end();
    let mut person = Person::new(&folder);
    person.find_target();
    // Before a trial nothing is void, but nobody knows what the rig renders.
    person.session.new_link();
    person.ticks(2);
    assert_eq!(person.phase(), Phase::Paused);
    person.find_target();
    person.click();
    person.click();
    let row = person.last_row();
    assert_eq!((row.trial, row.voided), (2, 0), "the next trial has no void attempts");
}

fn recording_of(folder: &Path, path: Option<&str>) -> (haptic_recording::Metadata, Vec<Sample>) {
    let path = folder.join(path.expect("it has a recording"));
    let reader = haptic_recording::open(&path).expect("opened");
    let metadata = reader.metadata().clone();
    let rows = reader.filter_map(|entry| match entry.expect("read") {
        haptic_recording::Entry::Row(row, _) => Some(row),
        haptic_recording::Entry::Mark(_) => None,
    });
    (metadata, rows.collect())
}

#[test]
fn click_counts_at_its_tick_however_late_it_arrives() {
    let (_parent, folder) = a_study(&small_fitts());
    let mut person = Person::new(&folder);
    person.find_target();
    person.reach();
    // A button that does not click, and then the one that does, held down.
    person.buttons = 0b01;
    person.tick();
    person.buttons = 0b11;
    person.ticks(400);
    person.buttons = 0;
    let started = person.tick - 399;
    let (latency_s, lasted_s) = (0.02, 0.0125);
    person.session.frame(Frame { latency_s, lasted_s });
    person.reach();
    // Reported 200 ticks late, and by then the hand is elsewhere.
    let clicked = person.tick;
    person.position_m = 0.0;
    person.ticks(200);
    person.session.click(clicked);
    person.listen();
    let first = person.last_row();
    assert_eq!(
        (first.start_tick, first.end_tick, first.errors),
        (Some(started), Some(clicked), 0)
    );
    assert_eq!(
        (first.cursor_latency_s, first.cursor_latency_p95_s, first.frame_rate_hz),
        (Some(0.02), Some(0.02), Some(80.0))
    );
    // Reported before its tick.
    if let Phase::Targets(targets) = person.phase() {
        person.position_m = targets.active_m / 3.0;
    }
    let coming = person.tick + 50;
    person.session.click(coming);
    person.ticks(60);
    let second = person.last_row();
    assert_eq!((second.start_tick, second.end_tick), (Some(clicked), Some(coming)));
    assert_eq!(second.cursor_latency_s, None);
}

#[test]
fn a_person_tells_surfaces_apart_and_sees_nothing_of_them() {
    let (_parent, folder) = a_study(&small_perception());
    let mut person = Person::new(&folder);
    assert_eq!(person.phase(), Phase::Instruction(Instruction::Practice));
    let mut rows = Vec::new();
    while person.phase() != Phase::Done {
        person.until(|phase| phase == Phase::Question);
        let is_practice = person.session.view().is_practice;
        person.session.answer(Answer::First, person.tick);
        person.listen();
        let feedback = person.session.view().feedback;
        assert_eq!(feedback == Some(Feedback::Answered), !is_practice, "{feedback:?}");
        rows.extend(person.session_events.drain(..).filter_map(|event| match event {
            SessionEvent::Kept(TrialRow::Perception(row)) => Some(*row),
            _ => None,
        }));
    }
    assert_eq!(trials::<PerceptionTrial>(&folder).expect("read"), rows[1..]);
    let forces: Vec<f64> = rows.iter().map(|row| row.comparison_static_n).collect();
    for row in &rows {
        assert_eq!((row.operator, row.answer), (Some(Operator::Human), 1));
        let (metadata, ticks) = recording_of(&folder, row.recording.as_deref());
        assert!(ticks.iter().any(|tick| Some(tick.tick) == row.start_tick) && metadata.scene.block.is_some());
    }
    // Each comparison was rendered once, and the base before it.
    assert!(person.scenes.len() >= 2 * forces.len(), "{}", person.scenes.len());
}

#[test]
fn a_surface_that_is_late_makes_the_gap_longer() {
    let (_parent, folder) = a_study(&small_perception());
    let mut person = Person::new(&folder);
    person.until(|phase| phase == Phase::Wait);
    // Whichever of the two gaps brings the comparison: it is taken, and not set for two seconds.
    let scene = loop {
        if let Some(scene) = person.session.take_scene() {
            break scene;
        }
        person.tick();
    };
    assert_eq!(person.phase(), Phase::Wait);
    person.ticks(2000);
    assert_eq!(person.phase(), Phase::Wait);
    person.revision += 1;
    person.session.rendered(person.revision, person.tick + 30);
    person.ticks(29);
    assert_eq!(person.phase(), Phase::Wait, "it still ramps");
    person.ticks(2);
    assert!(matches!(person.phase(), Phase::Feel(_)), "{:?}", person.phase());
    drop(scene);
    person.session.refused("refused");
    person.ticks(1);
    assert_eq!(person.phase(), Phase::Paused);
}

#[test]
fn people_and_models_are_refused_each_others_studies() {
    let (_parent, folder) = a_folder();
    let text = small_fitts();
    let plan = Plan::read(&text).expect("a plan");
    let one = SubjectTable::of_codes(&["01".to_owned()]);
    let about = StudyDescription::simulated(&plan, &text, 1, &one, false);
    drop(Study::create(&folder, &text, &about, &one).expect("created"));
    let error = refused(&folder, "01");
    assert!(error.starts_with("simulated operators do this study"), "{error}");
    let people = folder.with_file_name("people");
    make(&people, &text);
    let study = Study::open(&people).expect("opened");
    let error = super::super::run::run(&study, 1, &Default::default()).expect_err("people's");
    assert!(error.to_string().starts_with("people do this study"), "{error}");
    assert!(!people.join("data").exists());
}

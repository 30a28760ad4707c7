//! The study's thread: it feeds the session with ticks, has each trial on the disk before the next batch of them, and
//! reports to the experimenter.

use super::conductor::{self, Conductor, SceneBefore};
use super::news::{Stage, StudyCommand, StudyNews, StudyPlan, StudyState, SubjectState};
use super::subject_screen::{SubjectScreen, TaskScale};
use super::table;
use crate::intent::{BATCH_MS, Intent};
use crate::update::Update;
use crate::update_sender::UpdateSender;
use haptic_ipc::{DaemonMirror, Event};
use haptic_studies::person::{PersonSession, SessionEvent};
use haptic_studies::plan::Plan;
use haptic_studies::session::{Phase, View};
use haptic_studies::store::{self, Study, StudyDescription};
use haptic_studies::subject::Subject;
use haptic_studies::subject_table::SubjectTable;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc;

/// Batches of samples while a study is open: the cursor follows them.
const FAST: Intent = Intent::Stream { batch_ms: 4 };

/// Work of the thread.
#[derive(Debug)]
pub(super) enum Job {
    /// What the daemon sent.
    Hear(Update),
    /// What the experimenter asks.
    Command(StudyCommand),
}

/// A study whose subjects can be chosen.
#[derive(Debug)]
struct OpenStudy {
    folder: PathBuf,
    plan: Plan,
    subjects: Vec<Subject>,
}

/// Sends intents to the daemon, ahead of whom a stop goes.
pub(crate) type SendIntent = Arc<dyn Fn(Intent) + Send + Sync>;

pub(super) struct SessionThread {
    screen: Arc<SubjectScreen>,
    send: SendIntent,
    updates: UpdateSender,
    daemon: DaemonMirror,
    before: SceneBefore,
    study: Option<OpenStudy>,
    /// The chosen subject, by its place.
    subject: usize,
    conductor: Option<Conductor>,
    /// Why the study does not continue, where the disk or the study's files are to blame.
    problem: Option<String>,
    reported: Option<Box<StudyState>>,
    /// What the subject sees.
    shown: Option<View>,
}

impl SessionThread {
    pub(super) fn new(
        screen: Arc<SubjectScreen>,
        send: SendIntent,
        updates: UpdateSender,
        daemon: DaemonMirror,
    ) -> Self {
        Self {
            screen,
            send,
            updates,
            daemon,
            before: SceneBefore::default(),
            study: None,
            subject: 0,
            conductor: None,
            problem: None,
            reported: None,
            shown: None,
        }
    }

    /// Works until the study is closed.
    pub(super) fn run(mut self, jobs: &mpsc::Receiver<Job>) {
        for job in jobs {
            let is_of_samples = matches!(job, Job::Hear(Update::Event(Event::Samples(_))));
            match job {
                Job::Hear(update) => self.hear(&update),
                Job::Command(command) => {
                    if !self.carry_out(command) {
                        break;
                    }
                }
            }
            // The subject sees the next target at once; the disk may take its time.
            self.show(is_of_samples);
            self.go_on();
        }
        self.close();
    }

    fn report(&self, news: StudyNews) {
        // A closed panel needs no news.
        self.updates.send(Update::Study(news)).unwrap_or_default();
    }

    fn ask(&self, intents: impl IntoIterator<Item = Intent>) {
        for intent in intents {
            (self.send)(intent);
        }
    }

    /// Carries out a command; whether the study stays open.
    fn carry_out(&mut self, command: StudyCommand) -> bool {
        match command {
            StudyCommand::Create {
                folder,
                plan,
                subjects,
                seed,
            } => return self.open(&folder, create(&folder, &plan, &subjects, seed)),
            StudyCommand::Open { folder } => return self.open(&folder, Ok(())),
            StudyCommand::Close => return false,
            StudyCommand::Choose(place) => {
                self.subject = place;
                self.start();
            }
            StudyCommand::GoOn => {
                if self.problem.is_some() {
                    self.start();
                }
                let asked = self.conductor.as_mut().map(Conductor::go_on);
                self.ask(asked);
            }
            StudyCommand::Pause => {
                if let Some(conductor) = &mut self.conductor {
                    conductor.pause();
                }
            }
            StudyCommand::Note(text) => self.note(text),
        }
        true
    }

    /// Takes up a study; whether there is one.
    fn open(&mut self, folder: &Path, made: Result<(), String>) -> bool {
        let read = made.and_then(|()| store::read(folder).map_err(|error| error.to_string()));
        let (plan, about) = match read {
            Ok(study) => study,
            Err(why) => {
                self.report(StudyNews::Failed(why));
                return false;
            }
        };
        self.screen.set_scale(scale(&plan));
        self.screen.forget_latency();
        self.study = Some(OpenStudy {
            folder: folder.to_path_buf(),
            plan,
            subjects: about.all_subjects().collect(),
        });
        self.ask([FAST]);
        self.start();
        true
    }

    /// Opens the files of the chosen subject, once the daemon has sent what they need.
    fn start(&mut self) {
        self.end();
        self.problem = None;
        let Some(study) = &self.study else { return };
        let Some(subject) = study.subjects.get(self.subject) else {
            return;
        };
        match table::rows(&study.folder, study.plan.task(), subject) {
            Ok(rows) => self.report(StudyNews::Subject(rows)),
            Err(error) => {
                self.report(StudyNews::Subject(Vec::new()));
                self.problem = Some(error.to_string());
                return;
            }
        }
        let Some(rig) = conductor::description(&self.daemon) else {
            return;
        };
        let period_s = rig.loop_rate_hz.recip();
        match PersonSession::open(&study.folder, &subject.code, rig) {
            Ok(session) => self.conductor = Some(Conductor::new(session, period_s)),
            Err(error) => self.problem = Some(error.to_string()),
        }
    }

    /// Closes the files of the subject, once all is on the disk.
    fn end(&mut self) {
        if let Some(Err(error)) = self.conductor.take().map(Conductor::close) {
            self.report(StudyNews::Failed(error.to_string()));
        }
    }

    fn hear(&mut self, update: &Update) {
        update.tell(&mut self.daemon);
        self.before.take(update);
        if let (Update::Connected { .. }, Some(_)) = (update, &self.study) {
            self.ask([FAST]);
        }
        // Another daemon may have another rate.
        let period_s = self.daemon.rate_hz.map(f64::recip);
        let is_of_rig = |conductor: &Conductor| Some(conductor.period_s) == period_s;
        if self.problem.is_none()
            && conductor::what_is_missing(&self.daemon).is_none()
            && !self.conductor.as_ref().is_some_and(is_of_rig)
        {
            self.start();
        }
        if let Update::Event(Event::Samples(batch)) = update
            && let Some(last) = batch.rows.last()
        {
            self.act(last.tick);
        }
        let Some(conductor) = &mut self.conductor else { return };
        conductor.take(update);
        match update {
            Update::Event(Event::Timing(_)) => {
                let lease = conductor.lease();
                self.ask(lease);
            }
            Update::Answered {
                intent: Intent::Lease { timeout_ms: 1.. },
                result: Err(error),
            } => {
                conductor.pause();
                self.report(StudyNews::Failed(format!("No lease: {}", error.message)));
            }
            _ => {}
        }
    }

    /// Takes what the subject did up to a tick, and how late the cursor was.
    fn act(&mut self, last_tick: u64) {
        let (actions, frames) = self.screen.take_actions(last_tick);
        let Some(conductor) = &mut self.conductor else { return };
        for (frame, _) in frames {
            conductor.frame(frame);
        }
        for (action, tick) in actions {
            conductor.act(action, tick);
        }
    }

    /// Asks the daemon for what is due, has the trials that are done on the disk, and reports what happened.
    fn go_on(&mut self) {
        let Some(conductor) = &mut self.conductor else { return };
        // No rig is held while the disk works.
        let intents = conductor.due(&self.daemon, &mut self.before);
        self.ask(intents);
        let Some(conductor) = &mut self.conductor else { return };
        let mut happened = Vec::new();
        let kept = conductor.keep(&mut happened);
        let scene = kept
            .is_ok()
            .then(|| conductor.scene_due(&self.daemon, &mut self.before));
        self.ask(scene.flatten());
        for happening in happened {
            match happening {
                SessionEvent::Kept(row) => self.report(StudyNews::Row(table::row(&row))),
                SessionEvent::Voided(voided) => self.report(StudyNews::Row(table::void(&voided))),
                SessionEvent::Finished => {}
            }
        }
        if let Err(error) = kept {
            // What is on the disk decides where it continues.
            self.problem = Some(error.to_string());
            self.conductor = None;
            self.show(false);
        }
    }

    fn note(&self, text: String) {
        let outcome = match &self.study {
            None => Err("No study is open".to_owned()),
            Some(study) => {
                let subject = study.subjects.get(self.subject);
                let code = subject.map_or("", |subject| &subject.code);
                let noted = store::note(&study.folder, code, self.screen.newest_tick(), &text);
                let noted = noted.map(|path| format!("Noted in {}", path.display()));
                noted.map_err(|error| error.to_string())
            }
        };
        self.report(StudyNews::Noted { text, outcome });
    }

    /// Shows the subject and the experimenter where the study is. Most samples change nothing of it.
    fn show(&mut self, is_of_samples: bool) {
        let view = self.conductor.as_ref().and_then(Conductor::view);
        if is_of_samples && view == self.shown {
            return;
        }
        self.screen.set_view(view);
        self.shown = view;
        let Some(state) = self.state().map(Box::new) else {
            return;
        };
        if self.reported.as_ref() != Some(&state) {
            self.report(StudyNews::State(state.clone()));
            self.reported = Some(state);
        }
    }

    fn state(&self) -> Option<StudyState> {
        let study = self.study.as_ref()?;
        let session = self.conductor.as_ref().map(|conductor| &conductor.session);
        let subjects = study.subjects.iter().enumerate().map(|(place, subject)| {
            let view = session.filter(|_| place == self.subject).map(|session| session.view());
            SubjectState {
                code: subject.code.clone(),
                progress: view.map(|view| (view.done, view.of)),
                time_left: view.and_then(|_| self.conductor.as_ref()?.time_left()),
                is_finished: view.is_some_and(|view| view.phase == Phase::Done),
            }
        });
        let stage = match (&self.problem, &self.conductor) {
            (Some(why), _) => Stage::Held {
                why: why.clone(),
                is_trouble: true,
            },
            (None, Some(conductor)) => conductor.stage(&self.daemon),
            (None, None) => Stage::Waiting {
                what: conductor::what_is_missing(&self.daemon).unwrap_or_default().to_owned(),
            },
        };
        Some(StudyState {
            folder: study.folder.clone(),
            task: study.plan.task(),
            plan: study.plan.name().to_owned(),
            subjects: subjects.collect(),
            subject: self.subject,
            stage,
            now: session.map(|session| table::now(session.task())).unwrap_or_default(),
            target_m: session.and_then(table::target_m),
            columns: table::columns(study.plan.task()),
        })
    }

    /// Gives the rig and the screen back.
    fn close(mut self) {
        self.screen.set_view(None);
        self.screen.set_scale(None);
        if self.study.is_none() {
            return;
        }
        let scene = self.before.put_back(&self.daemon);
        self.ask(scene);
        let (timeout_ms, batch_ms) = (0, BATCH_MS);
        self.ask([Intent::Lease { timeout_ms }, Intent::Stream { batch_ms }]);
        self.end();
        self.report(StudyNews::Closed);
    }
}

/// Makes a study for people.
fn create(folder: &Path, plan: &StudyPlan, subjects: &[String], seed: u64) -> Result<(), String> {
    let text = match plan {
        StudyPlan::BuiltIn(task) => task.built_in_plan().to_owned(),
        StudyPlan::File(path) => {
            fs::read_to_string(path).map_err(|error| format!("cannot read the plan {}: {error}", path.display()))?
        }
    };
    let plan = Plan::read(&text).map_err(|error| error.to_string())?;
    let subjects = SubjectTable::of_codes(subjects);
    let about = StudyDescription::people(&plan, &text, seed, &subjects);
    let made = Study::create(folder, &text, &about, &subjects);
    made.map(drop).map_err(|error| error.to_string())
}

fn scale(plan: &Plan) -> Option<TaskScale> {
    let Plan::Fitts(plan) = plan else { return None };
    let reaches = plan
        .conditions
        .iter()
        .map(|condition| 0.5 * (condition.amplitude_m + condition.width_m));
    Some(TaskScale {
        mapping: plan.rig,
        reach_m: reaches.fold(0.0, f64::max),
    })
}

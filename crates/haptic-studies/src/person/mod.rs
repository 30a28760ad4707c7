//! A person's session at a study on the disk, for a program with a screen.
//!
//! ```text
//! events, clicks, answers --> Session --finished trial--> thread --fsync--> study's folder
//!                                ^                           |
//!                                +------ what came since ----+   once it is on the disk
//! ```
//!
//! No call waits for the disk. While a row is on its way to it, what comes is put aside, and goes into the session once
//! the row is there: no trial ends before the one before it is kept. Clicks, answers and ticks carry their ticks, so
//! that this changes no time.

use super::perception::Answer;
use super::session::{Frame, Interruption, Mounting, News, Session, Task, TrialRow, View};
use super::store::{Keeper, RigDescription, StoreError, Study};
use super::subject::Subject;
use super::trial::{Operator, VoidedTrial};
use haptic_core::Scene;
use haptic_ipc::Event;
use haptic_recording::StateMarks;
use std::collections::VecDeque;
use std::io;
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};

/// Why a person's session cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum PersonError {
    /// The study cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Simulated operators do this study.
    #[error("simulated operators do this study, and no people: continue with `haptic-ctl study resume`")]
    Simulated,
    /// No thread can be started.
    #[error("no thread can be started: {0}")]
    Thread(#[from] io::Error),
}

/// What happened in a person's session.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionEvent {
    /// A trial is on the disk, with this row.
    Kept(TrialRow),
    /// A trial under way is void, and done again.
    Voided(VoidedTrial),
    /// All trials of this subject are done, and the study's trials are in one file.
    Finished,
}

/// What waits until the row before it is on the disk.
#[derive(Debug)]
enum Input {
    Event(Event),
    Click(u64),
    Answer(Answer, u64),
    Frame(Frame),
    NewLink,
    Pause,
    Interrupt(Interruption),
    Rendered { revision: u64, whole_tick: u64 },
    Refused(String),
    Proceed,
}

/// A person's session. It holds the study's lock while it is there, so that no other program continues the study.
#[derive(Debug)]
pub struct PersonSession {
    session: Session,
    subject: Subject,
    state_marks: StateMarks,
    writer: WriterThread,
    /// Rows and voided attempts on their way to the disk.
    unkept: usize,
    waiting: VecDeque<Input>,
    session_events: VecDeque<SessionEvent>,
    /// The study's trials are in one file, or on their way there, since all of this subject's are done.
    is_collected: bool,
}

impl PersonSession {
    /// Opens a study to continue with a subject at the trial where the subject stopped, be that days ago.
    ///
    /// # Errors
    /// It is not a study for people, another program has it open, there is no such subject, or its rows are not those
    /// of the plan.
    pub fn open(folder: &Path, code: &str, rig: RigDescription) -> Result<Self, PersonError> {
        let study = Study::open(folder)?;
        if study.about().operator == Operator::Simulated {
            return Err(PersonError::Simulated);
        }
        let subject = study.subject_of(code)?;
        let (keeper, session) = Keeper::open(&study, &subject, rig)?;
        let mut opened = Self {
            session,
            subject,
            state_marks: StateMarks::default(),
            writer: WriterThread::spawn(study, keeper)?,
            unkept: 0,
            waiting: VecDeque::new(),
            session_events: VecDeque::new(),
            is_collected: false,
        };
        // The program may have been killed after the last row.
        opened.pass_on();
        Ok(opened)
    }

    /// The subject.
    #[must_use]
    pub fn subject(&self) -> &Subject {
        &self.subject
    }

    /// What the subject's screen shows.
    #[must_use]
    pub fn view(&self) -> View {
        self.session.view()
    }

    /// Where the cursor is, m of the task, with the handle at a position, m; none in the perception tests.
    #[must_use]
    pub fn cursor_m(&self, position_m: f64) -> Option<f64> {
        self.session.cursor_m(position_m)
    }

    /// The task, for the experimenter.
    #[must_use]
    pub fn task(&self) -> &Task {
        self.session.task()
    }

    /// What the experimenter does at the handle now.
    #[must_use]
    pub fn mounting(&self) -> Option<Mounting> {
        self.session.mounting()
    }

    /// Why it is interrupted, while it is.
    #[must_use]
    pub fn interruption(&self) -> Option<&Interruption> {
        self.session.interruption()
    }

    /// Takes an event of the subscription to the topics `state` and `samples`, at the loop's whole rate.
    pub fn event(&mut self, event: &Event) {
        if matches!(event, Event::Samples(_) | Event::State(_) | Event::Servo(_)) {
            self.put(Input::Event(event.clone()));
        }
    }

    /// Takes a click by a mouse or a key at a tick, which may be one that has not come yet.
    pub fn click(&mut self, tick: u64) {
        self.put(Input::Click(tick));
    }

    /// Takes an answer at a tick.
    pub fn answer(&mut self, answer: Answer, tick: u64) {
        self.put(Input::Answer(answer, tick));
    }

    /// Takes a frame that showed the cursor.
    pub fn frame(&mut self, frame: Frame) {
        self.put(Input::Frame(frame));
    }

    /// Continues: from instructions, from a break, after mounting, after an interruption. The last is the
    /// experimenter's.
    pub fn proceed(&mut self) {
        self.put(Input::Proceed);
    }

    /// Pauses. A trial under way is void.
    pub fn pause(&mut self) {
        self.put(Input::Pause);
    }

    /// Interrupts where a trial, or the wait for one, is under way.
    pub fn interrupt(&mut self, why: Interruption) {
        self.put(Input::Interrupt(why));
    }

    /// Says that the daemon was started again, or the connection to it re-established.
    pub fn new_link(&mut self) {
        self.put(Input::NewLink);
    }

    /// The scene that the rig shall change to, once; none where it is active, or on its way. Not for the subject.
    pub fn take_scene(&mut self) -> Option<Scene> {
        if self.unkept > 0 {
            return None;
        }
        self.session.take_scene()
    }

    /// Says that the scene that was taken is active with this revision, and from this tick on rendered alone.
    pub fn rendered(&mut self, revision: u64, whole_tick: u64) {
        self.put(Input::Rendered { revision, whole_tick });
    }

    /// Says that the scene that was taken could not be set.
    pub fn refused(&mut self, why: &str) {
        self.put(Input::Refused(why.to_owned()));
    }

    /// Continues with what waited for the disk, and says what happened. Call it in every frame.
    ///
    /// # Errors
    /// A row cannot be written. The session is at its end: close it; one that is opened again continues at that trial.
    pub fn poll(&mut self) -> Result<Vec<SessionEvent>, PersonError> {
        while let Ok(outcome) = self.writer.outcomes.try_recv() {
            self.job_done(outcome?);
        }
        Ok(self.session_events.drain(..).collect())
    }

    /// The same, but waits for the disk first.
    ///
    /// # Errors
    /// As of [`poll`](Self::poll).
    pub fn wait(&mut self) -> Result<Vec<SessionEvent>, PersonError> {
        while self.unkept > 0 {
            let Ok(outcome) = self.writer.outcomes.recv() else {
                break;
            };
            self.job_done(outcome?);
        }
        self.poll()
    }

    /// Ends it: what became final is on the disk, and another program may continue the study, when this returns.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn close(mut self) -> Result<(), PersonError> {
        let waited = self.wait().map(drop);
        self.session.close_reason();
        self.pass_on();
        let result = waited.and_then(|()| self.wait().map(drop));
        self.writer.join();
        result
    }

    fn job_done(&mut self, outcome: Option<SessionEvent>) {
        self.unkept = self.unkept.saturating_sub(1);
        self.session_events.extend(outcome);
        while self.unkept == 0 {
            let Some(input) = self.waiting.pop_front() else { return };
            self.take(input);
        }
    }

    fn put(&mut self, input: Input) {
        if self.unkept > 0 {
            self.waiting.push_back(input);
        } else {
            self.take(input);
        }
    }

    fn take(&mut self, input: Input) {
        match input {
            Input::Event(event) => return self.take_event(event),
            Input::Click(tick) => self.session.click(tick),
            Input::Answer(answer, tick) => self.session.answer(answer, tick),
            Input::Frame(frame) => self.session.frame(frame),
            Input::NewLink => {
                self.state_marks = StateMarks::default();
                self.session.new_link();
            }
            Input::Pause => self.session.pause(),
            Input::Interrupt(why) => self.session.interrupt(why),
            Input::Rendered { revision, whole_tick } => self.session.rendered(revision, whole_tick),
            Input::Refused(why) => self.session.refused(&why),
            Input::Proceed => self.session.proceed(),
        }
        self.pass_on();
    }

    fn take_event(&mut self, event: Event) {
        match event {
            Event::State(state) => {
                for mark in self.state_marks.of(&state) {
                    self.session.mark(mark);
                }
            }
            Event::Servo(event) => self.session.mark((*event).into()),
            Event::Samples(mut samples) => {
                let mut rows = samples.rows.iter();
                while let Some(row) = rows.next() {
                    self.session.row(row);
                    self.pass_on();
                    if self.unkept > 0 {
                        // The rest of the batch comes first once the row is kept.
                        samples.rows = rows.copied().collect();
                        self.waiting.push_front(Input::Event(Event::Samples(samples)));
                        return;
                    }
                }
            }
            _ => {}
        }
    }

    /// Passes on what became final.
    fn pass_on(&mut self) {
        while let Some(news) = self.session.take_news() {
            if let News::Voided(voided) = &news {
                self.session_events.push_back(SessionEvent::Voided(voided.clone()));
            }
            self.unkept += 1;
            self.writer.put(Some(news));
        }
        if self.session.is_done() && !self.is_collected {
            self.is_collected = true;
            self.unkept += 1;
            self.writer.put(None);
        }
    }
}

/// The thread that keeps what becomes final: only it waits for the disk. It ends with this, after what it was given.
#[derive(Debug)]
struct WriterThread {
    /// What is to be kept; nothing for all trials of the study to be put into one file.
    jobs: Sender<Option<News>>,
    /// What was done, once it is on the disk.
    outcomes: Receiver<Result<Option<SessionEvent>, StoreError>>,
    thread: JoinHandle<()>,
}

impl WriterThread {
    /// Starts it. It holds the study, and with it the lock.
    fn spawn(study: Study, mut keeper: Keeper) -> io::Result<Self> {
        let (jobs, work) = channel();
        let (done, outcomes) = channel();
        let thread = thread::Builder::new().name("study files".to_owned()).spawn(move || {
            for job in work {
                let result = match job {
                    Some(news) => keeper.keep(news).map(|row| row.map(SessionEvent::Kept)),
                    None => study.collect().map(|_| Some(SessionEvent::Finished)),
                };
                let failed = result.is_err();
                // Nobody may be left to hear of it; what was given is kept all the same.
                done.send(result).unwrap_or_default();
                if failed {
                    return;
                }
            }
        })?;
        Ok(Self { jobs, outcomes, thread })
    }

    fn put(&self, job: Option<News>) {
        // A thread that failed has reported it.
        self.jobs.send(job).unwrap_or_default();
    }

    /// Ends it, and waits until it has let the study go.
    fn join(self) {
        let Self { jobs, thread, .. } = self;
        drop(jobs);
        // A panic of the thread has printed its message.
        thread.join().unwrap_or_default();
    }
}

#[cfg(test)]
mod tests;

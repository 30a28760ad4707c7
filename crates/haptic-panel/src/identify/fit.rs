//! What the user asks an identification for, how far it is, and what comes of it.

use super::{Found, Headings};
use crate::intent::Intent;
use crate::notice::Notice;
use crate::tune::saving::Saving;
use crate::update::Answer;
use haptic_core::Scene;
use haptic_ipc::{Advice, WireError};
use haptic_lab::identify::ModelKind;
use haptic_lab::identify::record_file::MovingMass;
use haptic_motion::table::Columns;
use std::path::{Path, PathBuf};

/// Where the samples come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Origin {
    #[default]
    File,
    /// What is seen of the rig on the page of tuning.
    Rig,
    /// What is seen of the opened recording.
    Recording,
}

/// The user's choices, as they are typed.
#[derive(Debug)]
pub(crate) struct Choice {
    pub(crate) origin: Origin,
    pub(crate) path: String,
    pub(crate) columns: Columns,
    pub(crate) position_gain: String,
    pub(crate) force_gain: String,
    pub(crate) moving: MovingMass,
    pub(crate) model: ModelKind,
    pub(crate) mass: String,
    pub(crate) offset: String,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            origin: Origin::default(),
            path: String::new(),
            columns: Columns::default(),
            position_gain: String::new(),
            force_gain: String::new(),
            moving: MovingMass::Auto,
            model: ModelKind::Karnopp,
            mass: String::new(),
            offset: String::new(),
        }
    }
}

/// How far the identification is.
#[derive(Debug, Default)]
pub(crate) enum Progress {
    /// Nobody has asked.
    #[default]
    None,
    /// It is running; the share that is done, if it is known.
    Asked {
        share: Option<f64>,
    },
    Found(Box<Found>),
    /// Why nothing was found.
    Failed(String),
}

/// The page of identification.
#[derive(Debug, Default)]
pub(crate) struct Fitting {
    pub(crate) choice: Choice,
    /// The columns of a file, once they are read; those of a recording are known.
    headings: Option<(PathBuf, Headings)>,
    /// The file whose columns were asked for.
    headings_of: Option<PathBuf>,
    /// Number of the newest question.
    questions: u64,
    pub(super) progress: Progress,
    /// What the daemon says of the scene.
    pub(super) advice: Foreseen,
    /// The scene that the advice is on.
    foreseen: Option<Scene>,
    trial: TrialStep,
    pub(crate) saving: Saving,
    /// Outcome of the last try or save.
    pub(crate) report: Option<Notice>,
}

/// What the daemon says of the scene that was found.
#[derive(Debug, Default)]
pub(crate) enum Foreseen {
    #[default]
    Unasked,
    Asked,
    Known(Result<Vec<Advice>, String>),
}

/// The steps of a try: a lease first, so that the rig is released should the panel be lost meanwhile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum TrialStep {
    #[default]
    None,
    /// The lease is asked for.
    Leasing,
    /// The lease is held: the scene is sent next.
    Leased,
    /// The scene is sent, and goes back by itself.
    Trying,
}

/// Longest silence of the panel during a try, ms. The panel asks for the status once a second, which renews it.
pub(crate) const TRIAL_LEASE_MS: u32 = 3000;

impl Fitting {
    /// Whether a try is under way.
    pub(crate) fn is_trying(&self) -> bool {
        self.trial != TrialStep::None
    }

    /// The scene that was found, with the coupling of the active one: that suits the rig.
    pub(crate) fn scene(&self, active: Option<&Scene>) -> Option<Scene> {
        let Progress::Found(found) = &self.progress else {
            return None;
        };
        let file = found.scene.as_ref().ok()?.scene.clone();
        Some(file.on(active.and_then(|active| active.coupling)))
    }

    /// The names of the columns of the chosen file, or why they cannot be read; `None` before they are.
    pub(crate) fn headings(&self) -> Option<&Headings> {
        let (path, names) = self.headings.as_ref()?;
        (path == Path::new(self.choice.path.trim())).then_some(names)
    }

    /// Asks for the columns of the chosen file, once.
    pub(crate) fn ask_headings(&mut self) -> Option<Intent> {
        let path = PathBuf::from(self.choice.path.trim());
        if path.as_os_str().is_empty() || self.headings_of.as_ref() == Some(&path) {
            return None;
        }
        self.headings_of = Some(path.clone());
        // Those of another file mean nothing here.
        self.choice.columns = Columns::default();
        Some(Intent::ReadHeadings { path })
    }

    pub(crate) fn take_headings(&mut self, path: PathBuf, names: Headings) {
        self.headings = Some((path, names));
    }

    pub(crate) fn choose_file(&mut self, path: &Path) {
        self.choice.origin = Origin::File;
        self.choice.path = path.display().to_string();
        // It may have changed since it was read.
        self.headings_of = None;
    }

    /// Asks the question. Returns its number.
    pub(crate) fn ask(&mut self) -> u64 {
        self.give_up();
        self.progress = Progress::Asked { share: None };
        self.questions
    }

    /// Expects no answer any more.
    pub(crate) fn give_up(&mut self) {
        self.questions += 1;
        (self.progress, self.advice, self.foreseen) = (Progress::None, Foreseen::Unasked, None);
    }

    /// Takes the share that is done.
    pub(crate) fn take_share(&mut self, number: u64, share: f64) {
        if let Progress::Asked { share: known } = &mut self.progress
            && number == self.questions
        {
            *known = Some(share);
        }
    }

    /// Takes the answer to the newest question.
    pub(crate) fn take_found(&mut self, number: u64, result: Result<Box<Found>, String>) {
        if number == self.questions && matches!(self.progress, Progress::Asked { .. }) {
            self.progress = match result {
                Ok(found) => Progress::Found(found),
                Err(why) => Progress::Failed(why),
            };
        }
    }

    /// Begins a try of the scene that was found.
    pub(crate) fn begin_trial(&mut self) -> Intent {
        (self.trial, self.report) = (TrialStep::Leasing, None);
        Intent::Lease {
            timeout_ms: TRIAL_LEASE_MS,
        }
    }

    /// What to send now. `is_active` says whether a try has yet to go back.
    pub(crate) fn due(&mut self, is_connected: bool, is_active: bool, active: Option<&Scene>) -> Option<Intent> {
        let scene = self.scene(active).map(Box::new);
        match (self.trial, scene) {
            _ if !is_connected => None,
            (TrialStep::Leased, Some(scene)) => {
                self.trial = TrialStep::Trying;
                Some(Intent::Try { scene })
            }
            (TrialStep::Leased, None) => {
                self.trial = TrialStep::None;
                Some(Intent::Lease { timeout_ms: 0 })
            }
            (TrialStep::Trying, _) if !is_active => {
                self.trial = TrialStep::None;
                Some(Intent::Lease { timeout_ms: 0 })
            }
            (_, Some(scene)) if self.foreseen.as_ref() != Some(&scene) => {
                (self.advice, self.foreseen) = (Foreseen::Asked, Some((*scene).clone()));
                Some(Intent::Foresee { scene })
            }
            _ => None,
        }
    }

    /// The connection is lost, and the lease with it.
    pub(crate) fn lose_daemon(&mut self) {
        (self.trial, self.advice, self.foreseen) = (TrialStep::None, Foreseen::Unasked, None);
    }

    /// Takes the answer to an intent of this page; gives back an answer to any other.
    pub(crate) fn take_answer(
        &mut self,
        intent: &Intent,
        result: Result<Answer, WireError>,
    ) -> Option<Result<Answer, WireError>> {
        match (intent, result) {
            (Intent::Foresee { scene }, result) => {
                if self.foreseen.as_ref() == Some(&**scene) {
                    self.advice = Foreseen::Known(match result {
                        Ok(Answer::Changed(reply)) => Ok(reply.advice),
                        Ok(_) => Err("the daemon's answer is not that to a change".to_owned()),
                        Err(error) => Err(error.message),
                    });
                }
            }
            (Intent::Lease { timeout_ms }, result) if *timeout_ms > 0 && self.trial == TrialStep::Leasing => {
                self.trial = match result {
                    Ok(_) => TrialStep::Leased,
                    Err(error) => {
                        self.report = Some(Notice::new(Err(format!("Not tried: no lease: {}", error.message))));
                        TrialStep::None
                    }
                };
            }
            (Intent::Lease { .. }, _) => {}
            (
                Intent::Save {
                    scene: Some(_), name, ..
                },
                result,
            ) => {
                self.report = match result {
                    Ok(Answer::Saved(reply)) => Some(self.saving.answered(name, Ok(&reply))),
                    Ok(other) => return Some(Ok(other)),
                    Err(error) => Some(self.saving.answered(name, Err(error))),
                };
            }
            (_, result) => return Some(result),
        }
        None
    }
}

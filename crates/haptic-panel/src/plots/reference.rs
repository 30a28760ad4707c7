//! A run that is kept, to be drawn under another one: the same time, a recording, or an earlier moment of the rig.

use super::scope::Scope;
use super::scope::trigger::Trigger;
use crate::tape::Tape;
use crate::tapes::Tapes;

/// The run under the one that is seen.
#[derive(Debug)]
pub(crate) struct Reference {
    /// What it is, for people.
    pub(crate) name: String,
    pub(crate) tape: Tape,
    /// Time on its own clock that was at the zero of the axis, s.
    zero_s: f64,
    /// How far it is moved towards later times, s.
    pub(crate) shift_s: f64,
}

impl Reference {
    /// Keeps what is seen. No sample is copied.
    pub(crate) fn pin(scope: &Scope, tapes: &Tapes) -> Self {
        let seen = scope.seen(tapes);
        let name = match tapes.opened().filter(|_| !scope.is_of_rig()) {
            Some(opened) => {
                let file = opened.path.file_name().unwrap_or_default();
                file.to_string_lossy().into_owned()
            }
            None => format!("the rig at {:.1} s", seen.from_s),
        };
        Self {
            name,
            tape: scope.tape(tapes).part(seen.from_s, seen.to_s),
            zero_s: seen.zero_s,
            shift_s: 0.0,
        }
    }

    /// From its clock to that of a run whose axis has its zero at `zero_s`, s.
    pub(crate) fn offset_s(&self, zero_s: f64) -> f64 {
        zero_s - self.zero_s + self.shift_s
    }

    /// Moves it so that its first crossing of the trigger's level is at the first one in sight. Returns whether
    /// both cross it.
    pub(crate) fn align_at_crossing(&mut self, scope: &Scope, tapes: &Tapes) -> bool {
        let seen = scope.seen(tapes);
        let crossing = |tape: &Tape, from_s, to_s, trigger: &Trigger| trigger.first_crossing(tape, from_s, to_s);
        let here = crossing(scope.tape(tapes), seen.from_s, seen.to_s, &scope.trigger);
        let there = crossing(&self.tape, f64::NEG_INFINITY, f64::INFINITY, &scope.trigger);
        self.align(here, there, seen.zero_s)
    }

    /// The texts that mark a moment of both runs, each once.
    pub(crate) fn common_marks(&self, scope: &Scope, tapes: &Tapes) -> Vec<String> {
        let seen = scope.seen(tapes);
        let mut texts: Vec<String> = Vec::new();
        for (_, mark) in scope.tape(tapes).marks(seen.from_s, seen.to_s) {
            if !texts.contains(&mark.text) && moment(&self.tape, &mark.text).is_some() {
                texts.push(mark.text.clone());
            }
        }
        texts
    }

    /// Moves it so that its first moment of this text is at the first one in sight.
    pub(crate) fn align_at_mark(&mut self, text: &str, scope: &Scope, tapes: &Tapes) -> bool {
        let seen = scope.seen(tapes);
        let mut marks = scope.tape(tapes).marks(seen.from_s, seen.to_s);
        let here = marks.find(|(_, mark)| mark.text == text).map(|(t_s, _)| t_s);
        self.align(here, moment(&self.tape, text), seen.zero_s)
    }

    fn align(&mut self, here_s: Option<f64>, there_s: Option<f64>, zero_s: f64) -> bool {
        let (Some(here_s), Some(there_s)) = (here_s, there_s) else {
            return false;
        };
        self.shift_s += here_s - there_s - self.offset_s(zero_s);
        true
    }
}

/// The first moment with this text.
fn moment(tape: &Tape, text: &str) -> Option<f64> {
    // A part of a tape has the marks of the whole.
    let (oldest_s, newest_s) = (tape.oldest_s()?, tape.newest_s()?);
    let newest = tape.last()?.tick;
    let mut marks = tape.marks(oldest_s, newest_s).filter(|(_, mark)| mark.tick <= newest);
    marks.find(|(_, mark)| mark.text == text).map(|(t_s, _)| t_s)
}

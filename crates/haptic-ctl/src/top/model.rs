//! What is shown, and what the keys mean.

use crate::failure::Failure;
use crate::stop::NO_ANSWER_YET;
use crossterm::event::{KeyCode, KeyEvent, KeyModifiers};
use haptic_ipc::{DaemonMirror, Event, Request, RigState, Sample, SampleY, StateReply};
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Samples a second that are shown, Hz.
pub(super) const RATE_HZ: f64 = 50.0;
/// How much of the past is shown, s.
pub(super) const WINDOW_S: f64 = 10.0;

/// What a key asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Intent {
    Quit,
    Stop,
    Engage,
    Release,
    Reset,
    /// How everything is.
    Look,
}

impl Intent {
    /// What a key asks for. Every key that a hand in a hurry may hit for a stop is one.
    pub(super) fn of(key: KeyEvent) -> Option<Self> {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return (key.code == KeyCode::Char('c')).then_some(Self::Quit);
        }
        match key.code {
            KeyCode::Char(' ') | KeyCode::Esc => Some(Self::Stop),
            KeyCode::Char('q') => Some(Self::Quit),
            KeyCode::Char('e') => Some(Self::Engage),
            KeyCode::Char('r') => Some(Self::Release),
            KeyCode::Char('R') => Some(Self::Reset),
            _ => None,
        }
    }

    /// Whether it brings force, or lets others bring it.
    pub(super) const fn may_bring_force(self) -> bool {
        matches!(self, Self::Engage | Self::Reset)
    }

    /// Whether a stop overtook it: what was asked for before the stop could bring the force back.
    pub(super) const fn is_void(self, stops_before: u64, stops: u64) -> bool {
        self.may_bring_force() && stops_before != stops
    }

    pub(super) const fn request(self) -> Option<Request> {
        match self {
            Self::Quit => None,
            Self::Stop => Some(Request::Stop {}),
            Self::Engage => Some(Request::engage()),
            Self::Release => Some(Request::Release {}),
            Self::Reset => Some(Request::Reset {}),
            Self::Look => Some(Request::Status {}),
        }
    }
}

/// The last thing to say.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) text: String,
    pub(super) of: Of,
    /// The state of the rig in which it was said.
    state: Option<RigState>,
}

/// What a message is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Of {
    Success,
    Refusal,
    /// The daemon does not answer.
    Silence,
    /// It does not answer, and was not asked for what a key wants.
    Unsent,
    /// It has not confirmed a stop yet.
    StopLate,
    /// It has not confirmed a stop, and nobody waits for that any more.
    StopLost,
}

impl Message {
    pub(super) const fn is_bad(&self) -> bool {
        !matches!(self.of, Of::Success)
    }

    /// Whether the state that is shown is the last that came.
    pub(super) const fn is_of_silence(&self) -> bool {
        matches!(self.of, Of::Silence | Of::Unsent | Of::StopLate | Of::StopLost)
    }
}

pub(super) struct Model {
    pub(super) daemon: DaemonMirror,
    /// The ticks that are shown, with what they have of a second axis.
    pub(super) past: VecDeque<(Sample, Option<SampleY>)>,
    pub(super) message: Option<Message>,
    pub(super) help: bool,
}

impl Model {
    pub(super) fn new(server: &str) -> Self {
        let mut daemon = DaemonMirror::default();
        daemon.connect(server);
        Self {
            daemon,
            past: VecDeque::new(),
            message: None,
            help: false,
        }
    }

    pub(super) fn take(&mut self, event: Event) {
        self.daemon.take_event(&event);
        let state = self.state();
        // What is said of a silent daemon ends with its answer, anything else with the state.
        self.message
            .take_if(|message| message.state != state && !message.is_of_silence());
        if let Event::Samples(samples) = event {
            self.past.extend(samples.ticks().map(|(row, y)| (*row, y.copied())));
            let newest_s = self.past.back().map_or(0.0, |(newest, _)| newest.t_s);
            while self
                .past
                .front()
                .is_some_and(|(oldest, _)| oldest.t_s < newest_s - WINDOW_S)
            {
                self.past.pop_front();
            }
        }
    }

    /// The failure with which it ends: what a motor does under force nobody knows then.
    pub(super) fn lost(&self, failure: Failure) -> Failure {
        match self.daemon.rig().filter(|rig| rig.state.is_live()) {
            Some(rig) => Failure::NoRig(format!(
                "{failure}, and the rig was {}: if the motor pulls, cut its power",
                rig.state
            )),
            None => failure,
        }
    }

    /// A key that asks the daemon for nothing.
    pub(super) fn help_key(&mut self, key: KeyEvent) {
        self.help = matches!(key.code, KeyCode::Char('?' | 'h')) && !self.help;
    }

    pub(super) fn moved(&mut self, intent: Intent, reply: &StateReply) {
        self.daemon.take_state(reply);
        let text = if intent == Intent::Stop {
            format!("stop confirmed at tick {}: {}", reply.tick, reply.state)
        } else {
            format!("{} at tick {}", reply.state, reply.tick)
        };
        self.say(Of::Success, text);
    }

    fn state(&self) -> Option<RigState> {
        self.daemon.rig().map(|rig| rig.state)
    }

    fn say(&mut self, of: Of, text: impl Into<String>) {
        let text = text.into();
        let state = self.state();
        self.message = Some(Message { text, of, state });
    }

    /// The answer to a stop before this one is none to it.
    pub(super) fn stop_sent(&mut self) {
        self.say(Of::Success, "stop sent");
    }

    /// A stop has no answer yet.
    pub(super) fn late(&mut self) {
        self.say(Of::StopLate, NO_ANSWER_YET);
    }

    /// Nothing more can be asked before something has been answered.
    pub(super) fn hung(&mut self) {
        self.say(Of::StopLost, "the daemon does not answer: switch the motor off");
    }

    pub(super) fn refused(&mut self, intent: Intent, failure: &Failure) {
        let of = match failure {
            Failure::NoAnswer(_) if intent == Intent::Stop => Of::StopLost,
            Failure::NoAnswer(_) if intent.may_bring_force() => return self.unsent(intent, "withdrawn"),
            Failure::NoAnswer(_) => Of::Silence,
            _ => Of::Refusal,
        };
        if of == Of::Silence {
            self.say_silent(failure.to_string());
        } else {
            self.say(of, failure.to_string());
        }
    }

    /// The daemon has neither answered nor reported anything for a time.
    pub(super) fn silent(&mut self, time: Duration) {
        let text = format!(
            "no word from the daemon for {:.1} s: if the motor pulls, cut its power",
            time.as_secs_f64()
        );
        self.say_silent(text);
    }

    /// Whether what is shown is of a daemon that does not answer.
    pub(super) fn is_silent(&self) -> bool {
        self.message.as_ref().is_some_and(Message::is_of_silence)
    }

    /// A key wants what a silent daemon is not asked for, or no longer.
    pub(super) fn unsent(&mut self, intent: Intent, what: &str) {
        let wanted = if intent == Intent::Engage { "engage" } else { "reset" };
        let text = format!("{wanted} is {what}: no word from the daemon; if the motor pulls, cut its power");
        self.say(Of::Unsent, text);
    }

    fn say_silent(&mut self, text: String) {
        let shown = self.message.as_ref().map(|message| message.of);
        // What is shown of a key says more.
        if !matches!(shown, Some(Of::StopLate | Of::StopLost | Of::Unsent)) {
            self.say(Of::Silence, text);
        }
    }

    /// The daemon has answered to something.
    pub(super) fn answers(&mut self) {
        match self.message.as_ref().map(|message| message.of) {
            Some(Of::Silence | Of::Unsent) => self.message = None,
            Some(Of::StopLost) => self.say(
                Of::Refusal,
                "the daemon answers again, and has not confirmed that stop: press it again",
            ),
            _ => {}
        }
    }
}

/// The model, whatever became of a thread that had it.
pub(super) fn lock(model: &Mutex<Model>) -> MutexGuard<'_, Model> {
    model.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn engage_and_reset_from_before_a_stop_are_void() {
        for intent in [Intent::Engage, Intent::Reset] {
            assert!(intent.is_void(0, 1) && !intent.is_void(1, 1), "{intent:?}");
        }
        for intent in [Intent::Stop, Intent::Release, Intent::Look] {
            assert!(!intent.is_void(0, 1), "{intent:?}");
        }
    }

    #[test]
    fn every_key_that_a_hand_in_a_hurry_may_hit_stops() {
        let press = |code| Intent::of(KeyEvent::new(code, KeyModifiers::NONE));
        assert_eq!(press(KeyCode::Char(' ')), Some(Intent::Stop));
        assert_eq!(press(KeyCode::Esc), Some(Intent::Stop));
        assert_eq!(press(KeyCode::Char('r')), Some(Intent::Release));
        assert_eq!(press(KeyCode::Char('R')), Some(Intent::Reset));
        assert_eq!(press(KeyCode::Char('?')), None);
        let interrupt = KeyEvent::new(KeyCode::Char('c'), KeyModifiers::CONTROL);
        assert_eq!(Intent::of(interrupt), Some(Intent::Quit));
    }
}

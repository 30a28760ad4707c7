//! The states of the rig and the ramps between them.
//!
//! ```text
//! disconnected -> idle -> engaging -> engaged -> releasing -> idle
//! any -> stopped (by a person) or faulted (by a check): zero force at once, until a reset
//! any but stopped and faulted -> disconnected when the device cannot be read
//! ```
//!
//! Force flows only while engaging, engaged or releasing, scaled by a gain that moves along a ramp.

use super::state::{Command, Fault, RigState};
use crate::snapshot::Archive;

/// The command does not fit the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refused;

/// State and gain of the rig. Lives on the real-time thread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rig {
    state: RigState,
    fault: Option<Fault>,
    /// Share of the rendered force that reaches the hand, 0 to 1.
    gain: f64,
    ramp_s: f64,
    /// The ramp of the release that is under way, s.
    release_s: f64,
    /// What the release that is under way ends in, where that is a fault.
    fault_after_release: Option<Fault>,
    /// Longest time that one step along a ramp may count for, s.
    longest_step_s: f64,
}

impl Rig {
    /// A rig at rest whose ramps take `ramp_s` seconds. After a stall a ramp continues from where it
    /// was: one step counts for `longest_step_s` seconds at most.
    pub(super) fn new(ramp_s: f64, longest_step_s: f64) -> Self {
        Self {
            state: RigState::Idle,
            fault: None,
            gain: 0.0,
            ramp_s,
            release_s: ramp_s,
            fault_after_release: None,
            longest_step_s,
        }
    }

    /// Saves or loads it. Of a fault its kind is kept: nothing follows from more.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.choice("state", &mut self.state, &RigState::ALL);
        for (name, fault) in [
            ("fault", &mut self.fault),
            ("fault_after_release", &mut self.fault_after_release),
        ] {
            let of_code = |fault: Fault| Fault::KINDS.iter().position(|kind| kind.code() == fault.code());
            let mut kind = fault.and_then(of_code).map_or(0, |kind| kind + 1);
            archive.place(name, &mut kind, Fault::KINDS.len());
            if archive.is_loading() {
                *fault = kind.checked_sub(1).map(|kind| Fault::KINDS[kind]);
            }
        }
        archive.number("gain", &mut self.gain);
        archive.number("release_s", &mut self.release_s);
    }

    pub(super) fn state(&self) -> RigState {
        self.state
    }

    /// Why it is faulted, or stopped by its own button.
    pub(super) fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Whether force may flow.
    pub(super) fn is_live(&self) -> bool {
        self.state.is_live()
    }

    fn end_force(&mut self) {
        (self.gain, self.fault_after_release) = (0.0, None);
    }

    /// A person wants zero force, now.
    pub(super) fn stop(&mut self) {
        // A fault keeps its reason; either needs a reset.
        if self.state != RigState::Faulted {
            self.state = RigState::Stopped;
        }
        self.end_force();
    }

    /// A person has pressed the rig's own stop button.
    pub(super) fn press_stop(&mut self) {
        if self.state != RigState::Faulted && self.state != RigState::Stopped {
            self.fault = Some(Fault::StopButton);
        }
        self.stop();
    }

    /// A check wants zero force, now.
    pub(super) fn fail(&mut self, fault: Fault) {
        if self.state != RigState::Stopped && self.state != RigState::Faulted {
            self.state = RigState::Faulted;
            self.fault = Some(fault);
        }
        self.end_force();
    }

    /// A check has found what even a stop did not end: it faults in any state.
    pub(super) fn alarm(&mut self, fault: Fault) {
        if self.state != RigState::Faulted {
            self.state = RigState::Faulted;
            self.fault = Some(fault);
        }
        self.end_force();
    }

    /// Lets the force out along a ramp of at most `longest_s` seconds, where any flows.
    pub(super) fn release_within(&mut self, longest_s: f64) {
        if self.is_live() {
            self.release_s = if self.state == RigState::Releasing {
                self.release_s.min(longest_s)
            } else {
                self.ramp_s.min(longest_s)
            };
            self.state = RigState::Releasing;
        }
    }

    /// As [`release_within`](Self::release_within), into a fault: nobody engages meanwhile.
    pub(super) fn release_into(&mut self, fault: Fault, longest_s: f64) {
        if self.is_live() {
            self.release_within(longest_s);
            self.fault_after_release.get_or_insert(fault);
        }
    }

    /// The button that force needs is not held down: zero force, now.
    pub(super) fn open_enable_button(&mut self) {
        if self.is_live() {
            self.gain = 0.0;
            self.state = RigState::Idle;
            if let Some(fault) = self.fault_after_release.take() {
                self.fail(fault);
            }
        }
    }

    /// The device could, or could not, be read. It comes back without force.
    pub(super) fn device_present(&mut self, present: bool) {
        match (present, self.state) {
            (_, RigState::Stopped | RigState::Faulted) => {}
            (true, RigState::Disconnected) => self.state = RigState::Idle,
            (true, _) => {}
            (false, _) => {
                // Whatever was to come of a release that is cut off is not lost.
                self.gain = 0.0;
                match self.fault_after_release.take() {
                    Some(fault) => self.fail(fault),
                    None => self.state = RigState::Disconnected,
                }
            }
        }
    }

    /// Carries out a command.
    ///
    /// # Errors
    /// The command does not fit the state, which stays as it is.
    pub(super) fn command(&mut self, command: Command) -> Result<(), Refused> {
        use RigState::{Disconnected, Engaged, Engaging, Faulted, Idle, Releasing, Stopped};
        if self.state == Releasing && self.fault_after_release.is_some() && command == Command::Engage {
            return Err(Refused);
        }
        if command == Command::Release && matches!(self.state, Engaging | Engaged) {
            self.release_s = self.ramp_s;
        }
        self.state = match (command, self.state) {
            (Command::Engage, Idle | Releasing | Engaging) => Engaging,
            (Command::Engage, Engaged) => Engaged,
            (Command::Release, Engaging | Engaged | Releasing) => Releasing,
            (Command::Release, Idle) => Idle,
            (Command::Reset, Stopped | Faulted) => {
                self.fault = None;
                Idle
            }
            (Command::Reset, state) => state,
            (Command::Engage | Command::Release, Stopped | Faulted | Disconnected) => return Err(Refused),
        };
        Ok(())
    }

    /// What a time between two ticks counts for, s, where force may come with it: a stall is not made up for.
    pub(super) fn step_s(&self, elapsed_s: f64) -> f64 {
        elapsed_s.min(self.longest_step_s)
    }

    /// Moves the gain along its ramp by `elapsed_s` seconds and returns it.
    pub(super) fn advance(&mut self, elapsed_s: f64) -> f64 {
        let share_of = |ramp_s: f64| (self.step_s(elapsed_s) / ramp_s).min(1.0);
        match self.state {
            RigState::Engaging => {
                self.gain += share_of(self.ramp_s);
                if self.gain >= 1.0 {
                    self.gain = 1.0;
                    self.state = RigState::Engaged;
                }
            }
            RigState::Releasing => {
                self.gain -= share_of(self.release_s);
                if self.gain <= 0.0 {
                    self.gain = 0.0;
                    self.state = RigState::Idle;
                    if let Some(fault) = self.fault_after_release.take() {
                        self.fail(fault);
                    }
                }
            }
            RigState::Engaged => self.gain = 1.0,
            _ => self.gain = 0.0,
        }
        self.gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::string::ToString;
    use alloc::vec;
    use alloc::vec::Vec;

    #[derive(Clone, Copy, Debug, PartialEq)]
    enum Happening {
        Command(Command),
        Stop,
        Fail,
        Device(bool),
        Pass(f64),
        ReleaseWithin,
        LoseControl,
        OpenEnableButton,
        Alarm,
    }

    impl Happening {
        /// Does it to a rig; says whether a command was refused.
        fn happen(self, rig: &mut Rig) -> bool {
            match self {
                Self::Command(command) => return rig.command(command).is_err(),
                Self::Stop => rig.stop(),
                Self::Fail => rig.fail(Fault::TooFast),
                Self::Device(present) => rig.device_present(present),
                Self::Pass(elapsed) => drop(rig.advance(elapsed)),
                Self::ReleaseWithin => rig.release_within(0.1),
                Self::LoseControl => rig.release_into(Fault::ControlLost, 0.04),
                Self::OpenEnableButton => rig.open_enable_button(),
                Self::Alarm => rig.alarm(Fault::StillEnabled),
            }
            false
        }
    }

    // hazard: H2, H15
    #[test]
    fn hurried_release_ends_within_its_deadline() {
        let engage = |rig: &mut Rig| {
            rig.command(Command::Engage).expect("it is idle");
            // Somewhat longer than the ramp.
            for _ in 0..210 {
                rig.advance(0.05);
            }
            assert_eq!(rig.state(), RigState::Engaged);
        };
        let engaged = || {
            let mut rig = Rig::new(10.0, 0.05);
            engage(&mut rig);
            rig
        };
        let ticks = |rig: &mut Rig| {
            let mut ticks = 0;
            while rig.is_live() {
                rig.advance(1e-3);
                ticks += 1;
                assert!(ticks < 20_000, "it never ends");
            }
            ticks
        };
        let mut lapsed = engaged();
        lapsed.release_within(0.2);
        assert!((200..=201).contains(&ticks(&mut lapsed)));
        assert_eq!((lapsed.state(), lapsed.fault()), (RigState::Idle, None));
        let mut lost = engaged();
        lost.command(Command::Release).expect("it is engaged");
        lost.advance(1e-3);
        lost.release_into(Fault::ControlLost, 0.04);
        assert_eq!(lost.command(Command::Engage), Err(Refused), "nobody engages meanwhile");
        assert!((40..=41).contains(&ticks(&mut lost)), "a slow release is hurried");
        assert_eq!(
            (lost.state(), lost.fault()),
            (RigState::Faulted, Some(Fault::ControlLost))
        );
        let mut slow = engaged();
        slow.command(Command::Release).expect("it is engaged");
        assert!(ticks(&mut slow) > 9_990, "a person's release takes the whole ramp");
        // Neither a client nor a lapsed lease slows down a release that is in a hurry, and the next
        // one is not.
        let mut hurried = engaged();
        hurried.release_into(Fault::ControlLost, 0.04);
        hurried.release_within(0.2);
        hurried.command(Command::Release).expect("it is being released");
        assert!((40..=41).contains(&ticks(&mut hurried)));
        let mut again = engaged();
        again.release_within(0.2);
        assert!((200..=201).contains(&ticks(&mut again)));
        engage(&mut again);
        again.command(Command::Release).expect("it is engaged");
        assert!(ticks(&mut again) > 9_990);
        // Cut off by an unplugged device it is a fault all the same.
        let mut unplugged = engaged();
        unplugged.release_into(Fault::ControlLost, 0.04);
        unplugged.device_present(false);
        assert_eq!(unplugged.fault(), Some(Fault::ControlLost));
    }

    // hazard: H19
    #[test]
    fn rig_stop_button_stops_and_keeps_earlier_reason() {
        type Before = fn(&mut Rig);
        let rows: [(Before, _, _); 3] = [
            (|_| {}, RigState::Stopped, Some(Fault::StopButton)),
            (Rig::stop, RigState::Stopped, None),
            (|rig| rig.fail(Fault::TooFast), RigState::Faulted, Some(Fault::TooFast)),
        ];
        for (before, state, fault) in rows {
            let mut rig = Rig::new(0.2, 0.05);
            before(&mut rig);
            rig.press_stop();
            assert_eq!((rig.state(), rig.fault()), (state, fault));
        }
    }

    // hazard: H9
    #[test]
    fn an_alarm_is_reported_even_where_the_rig_is_stopped() {
        let mut rig = Rig::new(0.2, 0.05);
        rig.stop();
        rig.fail(Fault::TooFast);
        assert_eq!((rig.state(), rig.fault()), (RigState::Stopped, None));
        rig.alarm(Fault::StillEnabled);
        assert_eq!(
            (rig.state(), rig.fault()),
            (RigState::Faulted, Some(Fault::StillEnabled))
        );
    }

    /// Every sequence of five happenings, 248 832 of them.
    #[test]
    fn no_sequence_of_happenings_lets_force_flow_where_it_may_not() {
        const ELAPSED_S: f64 = 0.15;
        let engage = Happening::Command(Command::Engage);
        let reset = Happening::Command(Command::Reset);
        let all = [
            engage,
            Happening::Command(Command::Release),
            reset,
            Happening::Stop,
            Happening::Fail,
            Happening::Device(false),
            Happening::Device(true),
            Happening::Pass(ELAPSED_S),
            Happening::ReleaseWithin,
            Happening::LoseControl,
            Happening::OpenEnableButton,
            Happening::Alarm,
        ];
        let mut seen = alloc::collections::BTreeSet::new();
        let mut frontier = vec![Rig::new(0.2, 1.0)];
        for _ in 0..5 {
            let mut next = Vec::with_capacity(frontier.len() * all.len());
            for before in &frontier {
                for happening in all {
                    let mut after = *before;
                    let refused = happening.happen(&mut after);
                    let what = || std::format!("{before:?} {happening:?} {after:?}");
                    let (was, is) = (before.state(), after.state());
                    let is_hurried = was == RigState::Releasing && before.fault_after_release.is_some();
                    let may = !matches!(was, RigState::Stopped | RigState::Faulted | RigState::Disconnected);
                    let is_refused = match happening {
                        Happening::Command(Command::Engage) => !may || is_hurried,
                        Happening::Command(Command::Release) => !may,
                        _ => false,
                    };
                    assert_eq!(refused, is_refused, "{}", what());
                    assert!((0.0..=1.0).contains(&after.gain), "{}", what());
                    assert!(after.is_live() || after.gain == 0.0, "{}", what());
                    assert_eq!(is == RigState::Faulted, after.fault().is_some(), "{}", what());
                    let latched = matches!(was, RigState::Stopped | RigState::Faulted);
                    let alarmed = happening == Happening::Alarm && is == RigState::Faulted;
                    assert!(!latched || happening == reset || alarmed || is == was, "{}", what());
                    assert!(
                        after.fault_after_release.is_none() || is == RigState::Releasing,
                        "{}",
                        what()
                    );
                    let begins = after.is_live() && !before.is_live();
                    assert!(!begins || happening == engage && after.gain == 0.0, "{}", what());
                    match happening {
                        Happening::Stop | Happening::Fail | Happening::Alarm | Happening::Device(false) => {
                            assert_eq!(after.gain, 0.0, "{}", what());
                        }
                        Happening::Pass(_) => {
                            let is_release = was == RigState::Releasing;
                            let ramp_s = if is_release { before.release_s } else { 0.2 };
                            let moved = (after.gain - before.gain).abs();
                            assert!(moved <= ELAPSED_S / ramp_s + 1e-12, "no jump: {}", what());
                            assert!(!is_release || after.gain <= before.gain, "{}", what());
                        }
                        _ => {}
                    }
                    seen.insert(is.to_string());
                    next.push(after);
                }
            }
            frontier = next;
        }
        assert_eq!(frontier.len(), 248_832);
        assert_eq!(seen.len(), 7, "every state is reached: {seen:?}");
    }
}

//! Rounds of faults: each of them once, in a random order, until the time is over.

use super::Plan;
use super::faults::{ALL, Documented, Ending, Fault};
use super::rig::Rig;
use crate::{status, wait_for, wait_for_state};
use haptic_ipc::{JournalEntry, RigState};
use std::time::{Duration, Instant};

/// Faults by which the force is taken away where the machine is too busy for a loop or for a line, by docs/safety.md:
/// H7, H16, H3, H2, F8 and H9; and F9 and F10, as a hand that goes on while samples are lost has jumped when they are
/// back.
const OF_A_BUSY_MACHINE: [&str; 8] = [
    "stalled",
    "stale",
    "device_clock",
    "control_lost",
    "motor_off",
    "still_enabled",
    "jump",
    "too_fast",
];

/// How often a fault is tried while the machine gets in between.
const ATTEMPTS: u32 = 20;

/// Time after which what has happened is in the journal: an entry waits for those before it, and those for 1.5 s at
/// most.
const JOURNAL_WAITS: Duration = Duration::from_secs(10);

/// Ticks that a rig goes on for, where it is to.
const GOES_ON_TICKS: u64 = 300;

/// One fault, as it ended.
#[derive(Clone, Debug)]
pub(super) struct Occurrence {
    pub(super) fault: &'static str,
    /// Time of the soak, s.
    pub(super) time_s: f64,
    pub(super) end: End,
}

/// How a fault ended.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum End {
    /// As documented; where the force ends, with the time until the motor gave none.
    AsDocumented(Option<Duration>),
    /// The machine interfered with a fault of its own.
    BusyMachine(String),
    /// Otherwise.
    Wrong(String),
}

/// Brings faults about on a rig until the time is over, and each at least once.
pub(super) fn run(plan: &Plan, rig: &mut Rig, occurrences: &mut Vec<Occurrence>) {
    let mut random = plan.random(0);
    let mut faults: Vec<&Fault> = ALL.iter().collect();
    let mut is_first = true;
    while is_first || plan.began.elapsed() < plan.length {
        random.shuffle(&mut faults);
        for fault in &faults {
            if !is_first && plan.began.elapsed() >= plan.length {
                break;
            }
            for _ in 0..ATTEMPTS {
                let time_s = plan.time_s();
                let end = occur(fault, rig);
                let is_busy = matches!(end, End::BusyMachine(_));
                if let End::Wrong(why) = &end {
                    println!("{time_s:.1} s, {}: {why}", fault.name);
                }
                occurrences.push(Occurrence {
                    fault: fault.name,
                    time_s,
                    end,
                });
                rig.rest();
                if !is_busy {
                    break;
                }
            }
        }
        is_first = false;
    }
}

/// Brings a fault about once.
fn occur(fault: &Fault, rig: &mut Rig) -> End {
    // A busy machine may fault it before it pulls, or before the journal is looked at.
    let mut pulling = None;
    for _ in 0..ATTEMPTS {
        let before = rig.newest_entry();
        let pulls = rig.pull();
        let after = rig.newest_entry();
        if pulls && status(&mut rig.client).state == RigState::Engaged {
            pulling = Some(after);
            break;
        }
        let entries = rig.journal(Some(before), 10_000);
        let mut faults = entries.iter().filter_map(|entry| entry.fault.as_deref());
        if let Some(code) = faults.find(|code| !OF_A_BUSY_MACHINE.contains(code)) {
            return End::Wrong(format!("before it pulled, it faulted with {code}"));
        }
    }
    let Some(after) = pulling else {
        return End::BusyMachine("the machine faults it before it pulls".to_owned());
    };
    let held_up = rig.held_up();
    let began = Instant::now();
    let mut zero = Ok(None);
    let Documented {
        end, zero_within_ms, ..
    } = fault.documented;
    fault.act(rig, &mut |rig| {
        if zero_within_ms.is_some() {
            zero = rig.watch_until_zero(began).map(Some);
        } else {
            rig.motor_n();
            rig.wait_ticks(GOES_ON_TICKS);
            rig.motor_n();
        }
    });
    let zero = match zero {
        Ok(zero) => zero,
        // A clock that jumps while our loop stands still, or the line, may be believed: two of three times agree (H3).
        Err(why) if end == Ending::Faulted("device_clock") && rig.held_up() > held_up => {
            return End::BusyMachine(why);
        }
        Err(why) => return End::Wrong(why),
    };
    let ended = wait_for_the_end(end, rig);
    judge(end, ended, zero, || rig.journal(Some(after), 10_000))
}

/// Holds a state against the documented one. The journal distinguishes a fault from the machine's, and shows what
/// was only for a moment.
fn judge(
    ends_in: Ending,
    ended: RigState,
    zero: Option<Duration>,
    mut journal: impl FnMut() -> Vec<JournalEntry>,
) -> End {
    let began = Instant::now();
    loop {
        let entries = journal();
        let faults: Vec<&str> = entries.iter().filter_map(|entry| entry.fault.as_deref()).collect();
        let is_as_documented = match ends_in {
            Ending::GoesOn => ended == RigState::Engaged,
            Ending::Faulted(code) => ended == RigState::Faulted && faults.last() == Some(&code),
            Ending::Stopped => ended == RigState::Stopped,
            Ending::Released => ended == RigState::Idle && faults.is_empty(),
            Ending::Disconnected => ended == RigState::Idle && entries.iter().any(|entry| entry.op == "disconnected"),
        };
        if is_as_documented {
            return End::AsDocumented(zero);
        }
        if let Some(code) = faults.iter().find(|code| OF_A_BUSY_MACHINE.contains(code)) {
            return End::BusyMachine((*code).to_owned());
        }
        // A line that is held up for long counts as gone, and comes back by itself.
        if ended == RigState::Disconnected && ends_in != Ending::Disconnected {
            return End::BusyMachine("disconnected".to_owned());
        }
        if began.elapsed() > JOURNAL_WAITS {
            let own = entries
                .iter()
                .filter(|entry| entry.by.is_none())
                .map(ToString::to_string);
            return End::Wrong(format!(
                "it ended {ended}, not {ends_in}; the journal has: {}",
                own.collect::<Vec<String>>().join(", ")
            ));
        }
        crate::pause();
    }
}

/// Waits until the rig is in a state that lasts; returns it.
fn wait_for_the_end(ending: Ending, rig: &mut Rig) -> RigState {
    match ending {
        Ending::GoesOn => status(&mut rig.client).state,
        Ending::Disconnected => {
            let back = wait_for(&mut rig.client, "the device", |status| {
                !matches!(status.state, RigState::Disconnected)
            });
            back.state
        }
        Ending::Faulted(_) | Ending::Stopped | Ending::Released => {
            let began = Instant::now();
            let settled = wait_for(&mut rig.client, "its end", |status| {
                !matches!(
                    status.state,
                    RigState::Engaged | RigState::Engaging | RigState::Releasing
                ) || began.elapsed() > Duration::from_secs(20)
            });
            if settled.state == RigState::Disconnected {
                // A line that was held up for long counts as gone.
                wait_for_state(&mut rig.client, RigState::Idle);
            }
            settled.state
        }
    }
}

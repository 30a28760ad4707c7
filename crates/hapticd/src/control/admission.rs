//! Admission to engage: the checks of a device before its motor pulls a hand.
//!
//! The checks hold for one connection. Its number goes to the real-time thread with the command,
//! which engages no other: a device that takes the place of the checked one is refused, however
//! late the command arrives.

use crate::config::EngageRules;
use crate::control::RigHandle;
use crate::control::rig::commission_record::CommissionState;
use crate::control::rig::friction_record::KnownFriction;
use crate::control::rig_files::button_names;
use crate::rt::handoff::ANY_CONNECTION;
use device_io::link::{Delivery, DeviceInfo, Homing, LinkCounters};
use haptic_core::sample_clock::ClockError;
use haptic_ipc::{ErrorCode, Problem, WireError};
use std::sync::atomic::Ordering::Relaxed;

/// Longest watchdog of a device, ms: after the daemon dies its motor pulls a hand for this long.
pub(crate) const MAX_WATCHDOG_MS: u32 = 200;

/// The purpose of an engagement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    Scene,
    /// A pulse by which the rig is commissioned.
    Commissioning,
    /// A course from which the rig is identified.
    Identification,
}

/// A permission to engage.
#[derive(Clone, Copy, Debug)]
pub(super) struct Admission {
    pub(super) purpose: Purpose,
    /// The connection that it is valid for.
    pub(super) connection: u64,
}

impl Admission {
    /// For a command that needs no admission.
    pub(super) const NONE: Self = Self {
        purpose: Purpose::Scene,
        connection: ANY_CONNECTION,
    };
}

/// Checks whether the connected device may be engaged.
///
/// # Errors
/// A check fails; the error says which, and the remedy.
pub(super) async fn admit(rig: &RigHandle, purpose: Purpose) -> Result<Admission, WireError> {
    let Some(device) = rig.facts.connected_device() else {
        // The loop refuses by its state; a device that comes in the meantime has number 1 or more.
        return Ok(Admission { purpose, connection: 0 });
    };
    let connection = device.connection;
    match blockers(rig, &device, purpose, false).await.into_iter().next() {
        None => Ok(Admission { purpose, connection }),
        Some(Blocker { mut error, remedy }) => {
            error.message = format!("cannot engage: {}: {remedy}", error.message);
            Err(error)
        }
    }
}

/// Why an engagement of the connected device would be refused, for people.
pub(super) async fn problems(rig: &RigHandle) -> Vec<Problem> {
    let Some(device) = rig.facts.connected_device() else {
        return Vec::new();
    };
    let blockers = blockers(rig, &device, Purpose::Scene, true).await;
    let problem = |Blocker { error, remedy }| Problem {
        what: error.message,
        remedy,
    };
    blockers.into_iter().map(problem).collect()
}

/// A reason not to engage.
#[derive(Debug)]
struct Blocker {
    error: WireError,
    remedy: String,
}

async fn blockers(rig: &RigHandle, device: &DeviceInfo, purpose: Purpose, may_be_cached: bool) -> Vec<Blocker> {
    let friction = rig.known.frictions.of(device).await;
    let compensates = purpose == Purpose::Scene && rig.facts.friction.compensate.is_some();
    let mut found: Vec<Blocker> = compensates
        .then(|| not_identified(device, &friction))
        .flatten()
        .into_iter()
        .collect();
    let Some(link) = &rig.facts.link else {
        return found;
    };
    let rules = rig.facts.rules;
    found.extend(no_force(device).into_iter().chain(no_watchdog(device, rules)));
    found.extend(not_delivered(link.counters()));
    found.extend(rig.facts.homing().and_then(not_homed));
    // What is wrong with the clock, in the newest record.
    let clock_error = rig.channel.newest().and_then(|record| record.clock_error);
    found.extend(clock_error.map(wrong_clock));
    let settings = rig.facts.servo.get();
    let pressed = link.counters().buttons.load(Relaxed);
    found.extend(button_in_the_way(
        device.buttons,
        pressed,
        settings.stop_button,
        settings.enable_button,
    ));
    if purpose != Purpose::Commissioning && !rules.uncommissioned {
        let known = rig.known.records.known(device, may_be_cached).await;
        found.extend(not_the_commissioned_rig(device, known));
    }
    found
}

fn not_homed(homing: &Homing) -> Option<Blocker> {
    (!homing.is_homed()).then(|| Blocker {
        error: WireError::new(ErrorCode::WrongState, "the home pose of the rig is not known").about("homed"),
        remedy: "bring the hand to its home pose, as the kinematics name it, and run `haptic-ctl home`".to_owned(),
    })
}

fn no_force(device: &DeviceInfo) -> Option<Blocker> {
    let limit_n = device.force_limit_n;
    if limit_n > 0.0 {
        return None;
    }
    let what = format!("force_limit = {limit_n} N in the device's hello: its motor gives no force");
    Some(Blocker {
        error: WireError::new(ErrorCode::NoForce, what)
            .about("force_limit")
            .given(limit_n),
        remedy: "have its firmware report the largest force that its motor can give (force_limit_mn, \
             docs/device-protocol.md)"
            .to_owned(),
    })
}

/// What is wrong with the buttons on which the rig relies, by their bits.
fn button_in_the_way(there: u8, pressed: u64, stop: Option<u8>, enable: Option<u8>) -> Option<Blocker> {
    for (option, button) in [("stop-button", stop), ("enable-button", enable)] {
        let Some(bit) = button.filter(|bit| u32::from(there) >> bit & 1 == 0) else {
            continue;
        };
        let number = u32::from(bit) + 1;
        let has = button_names(there);
        return Some(Blocker {
            error: WireError::new(
                ErrorCode::NoButton,
                format!("{option} = {number}: the device has no such button; its hello names {has}"),
            )
            .about(option)
            .given(f64::from(number)),
            remedy: format!("name a button that it has with {option}, or have its firmware report that one"),
        });
    }
    let is_pressed = |button: Option<u8>| button.is_some_and(|bit| pressed >> bit & 1 == 1);
    let (what, remedy) = if is_pressed(stop) {
        ("the rig's own stop button is pressed", "release it")
    } else if enable.is_some() && !is_pressed(enable) {
        (
            "the rig's enable button is not held down",
            "hold it, as long as force is to flow",
        )
    } else {
        return None;
    };
    Some(Blocker {
        error: WireError::new(ErrorCode::WrongState, what).about("state"),
        remedy: remedy.to_owned(),
    })
}

/// What is wrong with the delivery of commands to the device.
fn not_delivered(counters: &LinkCounters) -> Option<Blocker> {
    let (code, what, remedy) = match counters.delivery() {
        Delivery::InTime => return None,
        Delivery::Late => {
            #[expect(clippy::cast_precision_loss, reason = "durations far below 2^53 ns")]
            let ms = counters.late_round_trip_ns.load(Relaxed) as f64 * 1e-6;
            (
                ErrorCode::CommandsLate,
                format!(
                    "commands take too long to the device and back, one of the last {ms:.1} ms, which is more than \
                     stale-ms and a sample period: the line or the device carries less than the loop sends"
                ),
                "lower `rate`, or give the line and the device a higher baud rate (docs/device-protocol.md); `stale-ms` \
                 allows more delay",
            )
        }
        Delivery::Ignored => (
            ErrorCode::CommandsIgnored,
            "the device sends samples and confirms no command".to_owned(),
            "see that the line carries bytes to the device, and that its samples name the newest command taken \
             (docs/device-protocol.md)",
        ),
    };
    Some(Blocker {
        error: WireError::new(code, what),
        remedy: remedy.to_owned(),
    })
}

fn wrong_clock(error: ClockError) -> Blocker {
    Blocker {
        error: WireError::new(
            ErrorCode::DeviceClock,
            format!("the device's time cannot be right: {error}"),
        ),
        remedy: "have its samples tell when they were taken in us, by a clock that counts to 32 bits and keeps to 5 % \
                 (docs/device-protocol.md); where it has done so before, this computer stood still: `haptic-ctl doctor`"
            .to_owned(),
    }
}

fn no_watchdog(device: &DeviceInfo, rules: EngageRules) -> Option<Blocker> {
    if rules.allow_no_watchdog {
        return None;
    }
    let max = MAX_WATCHDOG_MS;
    let what = match device.watchdog_ms {
        Some(ms) if ms <= max => return None,
        Some(ms) => format!(
            "watchdog_ms = {ms} ms is out of range: it must be from 1 to {max} ms, since the motor pulls a hand for \
             this long after hapticd dies"
        ),
        None => format!(
            "watchdog_ms = 0 ms is out of range: it must be from 1 to {max} ms; this device does not switch its motor \
             off by itself when hapticd dies"
        ),
    };
    let value = f64::from(device.watchdog_ms.unwrap_or(0));
    Some(Blocker {
        error: WireError::new(ErrorCode::NoWatchdog, what)
            .about("watchdog_ms")
            .within(value, 1.0, max.into(), "ms"),
        remedy:
            "give its firmware a watchdog of 50 ms (docs/device-protocol.md); or, if something else cuts the motor's \
                 power, start hapticd with --allow-no-watchdog"
                .to_owned(),
    })
}

fn not_the_commissioned_rig(device: &DeviceInfo, known: CommissionState) -> Option<Blocker> {
    let rig = format!("the rig {} ({})", device.rig.key, device.firmware);
    let blocker = |code, what: String, remedy: &str| Blocker {
        error: WireError::new(code, what).about("rig"),
        remedy: remedy.to_owned(),
    };
    match known {
        CommissionState::Commissioned { doubt: None, .. } => None,
        CommissionState::Commissioned { doubt: Some(why), .. } => Some(blocker(
            ErrorCode::MaybeAnotherRig,
            format!("{rig} may be another than the one that was commissioned: {why}"),
            "run `haptic-ctl commission --check`, which pushes its handle each way by at most 1 N; or, if you see that it \
             is the same rig, `haptic-ctl engage --same-rig`",
        )),
        CommissionState::Not { why, is_reversed } => Some(blocker(
            ErrorCode::NotCommissioned,
            format!("{rig} is not commissioned: {why}"),
            if is_reversed {
                "then run `haptic-ctl commission`, which checks by small pulses that its motor pulls the right way"
            } else {
                "run `haptic-ctl commission`, which checks by small pulses that its motor pulls the right way; or \
                 start hapticd with --uncommissioned"
            },
        )),
    }
}

/// Why the friction of a rig cannot be compensated.
fn not_identified(device: &DeviceInfo, friction: &KnownFriction) -> Option<Blocker> {
    let why = match friction {
        KnownFriction::Identified(_) => return None,
        KnownFriction::Never => "it was never identified",
        KnownFriction::Unusable(why) | KnownFriction::Unread(why) => why,
    };
    let what = format!(
        "`--compensate` needs the own friction of the rig {} ({}): {why}",
        device.rig.key, device.firmware
    );
    Some(Blocker {
        error: WireError::new(ErrorCode::NotIdentified, what).about("compensate"),
        remedy:
            "run `haptic-ctl identify --rig`, which measures it with the rig's own motor; or start hapticd without \
                 --compensate"
                .to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig::commission_record::Findings;
    use crate::control::rig_files;

    fn device(force_limit_n: f64, watchdog_ms: Option<u32>) -> DeviceInfo {
        DeviceInfo {
            force_limit_n,
            watchdog_ms,
            buttons: 0b11,
            ..rig_files::tests::device()
        }
    }

    // hazard: H8
    #[test]
    fn a_force_limit_of_zero_or_less_or_none_at_all_is_in_the_way() {
        for limit_n in [0.0, -1.0, f64::NAN] {
            let found = no_force(&device(limit_n, Some(50))).expect("in the way");
            assert_eq!(found.error.code, ErrorCode::NoForce);
            assert!(found.error.message.contains("force_limit"), "{}", found.error);
        }
        assert!(no_force(&device(0.001, Some(50))).is_none());
    }

    // hazard: H9
    #[test]
    fn missing_or_long_watchdog_blocks_engaging_unless_allowed() {
        let strict = EngageRules::default();
        let lenient = EngageRules {
            allow_no_watchdog: true,
            ..strict
        };
        for (watchdog_ms, expected) in [(None, "= 0 ms"), (Some(201), "= 201 ms"), (Some(65535), "= 65535 ms")] {
            let found = no_watchdog(&device(1.0, watchdog_ms), strict).expect("in the way");
            assert_eq!(found.error.code, ErrorCode::NoWatchdog);
            assert_eq!(found.error.max, Some(200.0));
            for part in [expected, "from 1 to 200 ms"] {
                assert!(found.error.message.contains(part), "{} lacks {part}", found.error);
            }
            assert!(found.remedy.contains("--allow-no-watchdog"), "{}", found.remedy);
            assert!(no_watchdog(&device(1.0, watchdog_ms), lenient).is_none());
        }
        for watchdog_ms in [1, 50, 200] {
            assert!(no_watchdog(&device(1.0, Some(watchdog_ms)), strict).is_none());
        }
    }

    #[test]
    fn a_refusal_for_late_commands_names_a_late_one() {
        let counters = LinkCounters::default();
        for _ in 0..20 {
            for (round_trip_ns, is_late) in [(24_600_000, true), (2_000_000, false)] {
                counters.note_round_trip(round_trip_ns);
                counters.note_lateness(round_trip_ns, is_late);
            }
        }
        let found = not_delivered(&counters).expect("in the way");
        assert!(found.error.message.contains("24.6 ms"), "{}", found.error);
    }

    // hazard: H19
    #[test]
    fn missing_or_wrongly_pressed_button_blocks_engaging() {
        let found = |there, pressed, stop, enable| button_in_the_way(there, pressed, stop, enable);
        for (there, stop, enable, expected) in [
            (
                0b1,
                Some(4),
                None,
                "stop-button = 5: the device has no such button; its hello names button 1",
            ),
            (
                0b101,
                None,
                Some(1),
                "enable-button = 2: the device has no such button; its hello names button 1, button 3",
            ),
            (0, Some(0), None, "its hello names no button"),
        ] {
            let found = found(there, 0, stop, enable).expect("in the way");
            assert_eq!(found.error.code, ErrorCode::NoButton);
            assert!(found.error.message.contains(expected), "{}", found.error);
        }
        let message = |pressed, stop, enable| found(0b11, pressed, stop, enable).map(|found| found.error.message);
        assert_eq!(message(0b10, Some(0), Some(1)), None);
        assert_eq!(
            message(0b11, Some(0), Some(1)).as_deref(),
            Some("the rig's own stop button is pressed")
        );
        assert_eq!(
            message(0, Some(0), Some(1)).as_deref(),
            Some("the rig's enable button is not held down")
        );
        assert_eq!(message(0, Some(0), None), None);
    }

    // hazard: F21
    #[test]
    fn friction_that_is_not_known_is_not_compensated() {
        for (friction, expected) in [
            (KnownFriction::Never, "never identified"),
            (
                KnownFriction::Unusable("its direction has changed".to_owned()),
                "direction",
            ),
        ] {
            let found = not_identified(&device(1.0, Some(50)), &friction).expect("in the way");
            assert_eq!(found.error.code, ErrorCode::NotIdentified);
            assert!(found.error.message.contains(expected), "{}", found.error);
            assert!(found.remedy.contains("identify --rig"), "{}", found.remedy);
        }
    }

    // hazard: H13
    #[test]
    fn a_refusal_of_an_uncommissioned_rig_names_both_remedies() {
        let found = |known| not_the_commissioned_rig(&device(1.0, Some(50)), known);
        let never = |is_reversed| {
            let why = "it was never commissioned".to_owned();
            found(CommissionState::Not { why, is_reversed }).expect("in the way")
        };
        assert_eq!(never(false).error.code, ErrorCode::NotCommissioned);
        assert!(
            !never(true).remedy.contains("--uncommissioned"),
            "it would push the hand on"
        );
        let doubt = found(CommissionState::Commissioned {
            findings: Findings::default(),
            coupling: None,
            doubt: Some("it has no serial number".to_owned()),
        })
        .expect("in the way");
        assert_eq!(doubt.error.code, ErrorCode::MaybeAnotherRig);
        for (found, parts) in [
            (never(false), ["haptic-ctl commission", "--uncommissioned"]),
            (doubt, ["commission --check", "engage --same-rig"]),
        ] {
            for part in parts {
                assert!(found.remedy.contains(part), "{} lacks {part}", found.remedy);
            }
        }
    }
}

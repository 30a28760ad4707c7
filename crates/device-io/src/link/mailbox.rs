//! The way of commands to a device whose writes block: one slot for the newest command and one for
//! the newest enable, between the real-time thread, which posts, and a writer, which takes. Neither
//! ever waits for the other.
//!
//! A message is one word: its sequence, whether it enables, and a force. So none is ever seen half,
//! and there is nothing to lock. Only the order of two words can still be wrong, since a device refuses
//! a message with an older sequence than the newest it has taken. An enable that comes after a
//! newer command is refused, and the motor stays off for a client that was told the contrary.
//!
//! The poster stores the enable and then the command, which has the next sequence; the store of the
//! command releases. The taker loads the command, which acquires, and then the enable. So:
//!
//! - A taker that sees a command sees every enable that is older, or a newer one: the enable is
//!   loaded after the command. It is sent before that command, and later commands are newer still.
//!   Therefore no enable is ever sent with an older sequence than a command already sent. With the
//!   loads the other way round, a pair posted between them would give a command without its enable,
//!   and the enable would come too late, next time.
//! - An enable may be newer than the command, when it was posted between the two loads. It is sent
//!   alone: what the command asked for is overtaken, and the enable itself begins at zero force.
//!   Its own command has been posted by the time the poster wakes the taker, which then looks
//!   again. Should it look earlier, it may still find a command before the enable, which is not
//!   sent either.
//! - A command that switches off and is newer than the enable makes the enable needless: it is not
//!   sent.
//! - Of several commands posted between two looks only the newest is seen, whole. Of several
//!   enables too; each of the older ones had a command that switched off between it and the next,
//!   which the next enable implies, since the device sets its motor to zero force at every enable.
//! - The message seen last is compared by its word and not by its age, since the sequence wraps
//!   around: an enable of 2^31 messages ago would look new.
//! - The taker is woken after both stores, and looks after it was woken. A post during a look wakes
//!   it again. So nothing stays in the slots unseen.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::{FromHost, is_newer};
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::{Acquire, Release};

/// The slots. They begin with zero, which is not a message of a new conversation.
#[derive(Debug, Default)]
pub(super) struct Mailbox {
    command: AtomicU64,
    enable: AtomicU64,
}

const ENABLED: u64 = 1 << 31;
const FORCE: u64 = ENABLED - 1;
/// Largest force that a word holds, mN: a thousand tonnes' weight.
const MAX_MN: i32 = (1 << 30) - 1;

/// Sequence in the upper half, then a bit for `enabled`, then 31 bits of force, mN, in two's
/// complement.
fn word(sequence: u32, enabled: bool, force_mn: i32) -> u64 {
    #[expect(clippy::cast_sign_loss, reason = "two's complement, cut to its 31 bits")]
    let force = force_mn.clamp(-MAX_MN, MAX_MN) as u64 & FORCE;
    u64::from(sequence) << 32 | if enabled { ENABLED } else { 0 } | force
}

fn sequence(word: u64) -> u32 {
    u32::try_from(word >> 32).unwrap_or(0)
}

fn force_mn(word: u64) -> i32 {
    // The lower 31 bits: their sign goes up by one, and is drawn down again.
    let force = ((word & FORCE) as u32) << 1;
    force.cast_signed() >> 1
}

/// Where the other thread may come between, a test lets it.
#[inline]
fn between() {
    #[cfg(test)]
    if fastrand::u8(..4) == 0 {
        std::thread::yield_now();
    }
}

impl Mailbox {
    /// Puts the newest messages in. For one thread only.
    pub(super) fn post(&self, enable: Option<FromHost>, command: FromHost) {
        // This order matters: see above.
        if let Some(FromHost::Enable { sequence, enabled }) = enable {
            self.enable.store(word(sequence, enabled, 0), Release);
        }
        between();
        if let FromHost::Command {
            sequence,
            force_mn,
            enabled,
        } = command
        {
            self.command.store(word(sequence, enabled, force_mn), Release);
        }
    }
}

/// The frames to send, in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Messages {
    pub(super) enable: Option<FromHost>,
    pub(super) command: Option<FromHost>,
    /// Messages that were posted since the last look and are not sent: newer ones make them
    /// needless.
    pub(super) skipped: u32,
}

/// The taking end: what it has seen.
#[derive(Debug, Default)]
pub(super) struct Taker {
    command: u64,
    enable: u64,
    /// Sequence of the newest message seen.
    newest: u32,
}

impl Taker {
    /// Takes what was not seen yet. For one thread only.
    pub(super) fn take(&mut self, mailbox: &Mailbox) -> Messages {
        // This order matters: see above.
        let command = mailbox.command.load(Acquire);
        between();
        let enable = mailbox.enable.load(Acquire);
        let fresh_command = (std::mem::replace(&mut self.command, command) != command).then_some(command);
        let fresh_enable = (std::mem::replace(&mut self.enable, enable) != enable).then_some(enable);
        let (enable, command) = match (fresh_enable, fresh_command) {
            (Some(enable), Some(command)) if is_newer(sequence(enable), sequence(command)) => (Some(enable), None),
            (Some(_), Some(command)) if command & ENABLED == 0 => (None, Some(command)),
            // The enable that overtook it was sent at the last look.
            (None, Some(command)) if !is_newer(sequence(command), self.newest) => (None, None),
            both => both,
        };
        let newest =
            [fresh_enable, fresh_command]
                .into_iter()
                .flatten()
                .map(sequence)
                .fold(
                    self.newest,
                    |newest, sequence| {
                        if is_newer(sequence, newest) { sequence } else { newest }
                    },
                );
        let posted = newest.wrapping_sub(std::mem::replace(&mut self.newest, newest));
        let sent = u32::from(enable.is_some()) + u32::from(command.is_some());
        Messages {
            enable: enable.map(|word| FromHost::Enable {
                sequence: sequence(word),
                enabled: word & ENABLED != 0,
            }),
            command: command.map(|word| FromHost::Command {
                sequence: sequence(word),
                force_mn: force_mn(word),
                enabled: word & ENABLED != 0,
            }),
            skipped: posted.saturating_sub(sent),
        }
    }

    /// Sequence of the newest message seen.
    pub(super) fn newest(&self) -> u32 {
        self.newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Firmware, FirmwareProperties, Hand, RigProperties};
    use crate::protocol::message::FromDevice;
    use std::sync::atomic::AtomicBool;

    fn command(sequence: u32, force_mn: i32, enabled: bool) -> FromHost {
        FromHost::Command {
            sequence,
            force_mn,
            enabled,
        }
    }

    fn enable(sequence: u32) -> FromHost {
        FromHost::Enable {
            sequence,
            enabled: true,
        }
    }

    #[test]
    fn a_word_holds_a_message() {
        for sequence in [0, 1, 0x8000_0000, u32::MAX] {
            for force_mn in [0, 1, -1, 20_000, -20_000, MAX_MN, -MAX_MN] {
                for enabled in [false, true] {
                    let word = word(sequence, enabled, force_mn);
                    assert_eq!(
                        (super::sequence(word), super::force_mn(word), word & ENABLED != 0),
                        (sequence, force_mn, enabled)
                    );
                }
            }
        }
        assert_eq!(force_mn(word(1, true, i32::MAX)), MAX_MN);
        assert_eq!(force_mn(word(1, true, i32::MIN)), -MAX_MN);
    }

    #[test]
    fn newest_message_is_taken_once_and_skipped_are_counted() {
        let (mailbox, mut taker) = (Mailbox::default(), Taker::default());
        let taken = |enable, command, skipped| Messages {
            enable,
            command,
            skipped,
        };
        assert_eq!(taker.take(&mailbox), Messages::default());
        mailbox.post(None, command(1, 0, false));
        mailbox.post(Some(enable(2)), command(3, 10, true));
        assert_eq!(
            taker.take(&mailbox),
            taken(Some(enable(2)), Some(command(3, 10, true)), 1)
        );
        assert_eq!(taker.take(&mailbox), Messages::default());
        for k in 4..=9 {
            mailbox.post(None, command(k, 11, true));
        }
        assert_eq!(taker.take(&mailbox), taken(None, Some(command(9, 11, true)), 5));
        // On and off again before anybody looked: it stays off.
        mailbox.post(None, command(10, 0, false));
        mailbox.post(Some(enable(11)), command(12, 5, true));
        mailbox.post(None, command(13, 0, false));
        assert_eq!(taker.take(&mailbox), taken(None, Some(command(13, 0, false)), 3));
        // An enable whose command is not there yet goes alone.
        mailbox.enable.store(word(14, true, 0), Release);
        assert_eq!(taker.take(&mailbox), taken(Some(enable(14)), None, 0));
        mailbox.post(None, command(15, 1, true));
        assert_eq!(taker.take(&mailbox), taken(None, Some(command(15, 1, true)), 0));
        assert_eq!(taker.newest(), 15);
    }

    #[test]
    fn old_enable_does_not_return_at_sequence_wraparound() {
        let (mailbox, mut taker) = (Mailbox::default(), Taker::default());
        mailbox.post(Some(enable(1)), command(2, 1, true));
        taker.take(&mailbox);
        for sequence in [1 << 30, (1 << 31) + 5, (1 << 31) + 6, 3 << 30, u32::MAX, 0, 1] {
            mailbox.post(None, command(sequence, 2, true));
            let taken = taker.take(&mailbox);
            assert_eq!((taken.enable, taken.command), (None, Some(command(sequence, 2, true))));
        }
    }

    /// The device refuses nothing that is sent, and its motor is never off for a command that is to
    /// drive it.
    #[test]
    fn two_threads_never_disagree_on_whether_the_motor_is_on() {
        const POSTS: u32 = if cfg!(miri) { 300 } else { 500_000 };
        let mailbox = Mailbox::default();
        let ended = AtomicBool::new(false);
        let mut firmware = Firmware::new(RigProperties::default(), Hand::Free, FirmwareProperties::default());
        firmware.receive(FromHost::Hello { nonce: 1 }, 0);
        let enabled = |firmware: &mut Firmware| match firmware.sample(0) {
            Some(FromDevice::Sample(sample)) => (sample.enabled, sample.command),
            other => panic!("{other:?}"),
        };
        let last = std::thread::scope(|scope| {
            let poster = scope.spawn(|| {
                let mut random = fastrand::Rng::with_seed(3);
                let (mut sequence, mut on) = (0, false);
                let mut next = || {
                    sequence += 1;
                    sequence
                };
                let mut last = command(0, 0, false);
                for _ in 0..POSTS {
                    let was_on = on;
                    // Switched often, so that many looks fall between an enable and its command.
                    on = random.u8(..4) != 0;
                    let enable = (on && !was_on).then(|| enable(next()));
                    let sequence = next();
                    #[expect(clippy::cast_possible_wrap, reason = "a force that tells which command it came with")]
                    let force_mn = (sequence % 16_384) as i32;
                    last = command(sequence, if on { force_mn } else { 0 }, on);
                    mailbox.post(enable, last);
                }
                ended.store(true, Release);
                last
            });
            let mut taker = Taker::default();
            let mut seen = None;
            loop {
                let last_look = ended.load(Acquire);
                let taken = taker.take(&mailbox);
                if let Some(message) = taken.enable {
                    let acknowledged = firmware.receive(message, 0);
                    assert!(
                        matches!(acknowledged, Some(FromDevice::Acknowledge { done: true, .. })),
                        "{message:?} was refused"
                    );
                }
                if let Some(
                    message @ FromHost::Command {
                        sequence,
                        force_mn,
                        enabled: on,
                    },
                ) = taken.command
                {
                    firmware.receive(message, 0);
                    assert_eq!(enabled(&mut firmware), (on, sequence), "{message:?}");
                    assert_eq!(firmware.force_n(), f64::from(force_mn) * 1e-3, "{message:?}");
                    seen = Some(message);
                }
                if last_look {
                    break;
                }
            }
            assert_eq!(seen, Some(poster.join().expect("it posts")), "the last one is seen");
            taker.newest()
        });
        assert!(last > POSTS);
    }
}

//! The messages for a device whose writes block: a ring between the real-time thread, which posts, and a writer, which
//! takes the newest. Neither ever waits for the other.
//!
//! A post is a command, behind its enable where it has one, so the writer never sees the one without the other. Of all
//! that waits the newest command is sent, and before it the newest enable, unless a command switched the motor off
//! after that. The enables and commands before them are needless: a device sets its motor to zero force at every
//! enable. What is sent has the sequence in which it was posted, so the device refuses nothing.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use crate::protocol::message::FromHost;
use rtrb::{Consumer, Producer, RingBuffer};

/// Posts that may wait. A device that takes nothing is given up after a tenth of a second; a session posts some thirty
/// meanwhile.
const ROOM: usize = 256;

/// A command, and the enable before it.
pub(super) type Post = (Option<FromHost>, FromHost);

/// Both ends of a mailbox.
pub(super) fn mailbox() -> (Producer<Post>, Consumer<Post>) {
    RingBuffer::new(ROOM)
}

/// What to send, in this order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Newest {
    pub(super) enable: Option<FromHost>,
    pub(super) command: Option<FromHost>,
    /// Messages that were posted since the last look and are not sent: newer ones make them needless.
    pub(super) skipped: u64,
}

impl Newest {
    /// Takes all that waits.
    pub(super) fn take(posts: &mut Consumer<Post>) -> Self {
        let mut newest = Self::default();
        let mut posted = 0;
        while let Ok((enable, command)) = posts.pop() {
            posted += 1 + u64::from(enable.is_some());
            let is_off = matches!(command, FromHost::Command { enabled: false, .. });
            newest.enable = enable.or(newest.enable).filter(|_| !is_off);
            newest.command = Some(command);
        }
        let sent = u64::from(newest.enable.is_some()) + u64::from(newest.command.is_some());
        newest.skipped = posted - sent;
        newest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Firmware, FirmwareProperties, Hand, RigProperties};
    use crate::protocol::message::FromDevice;

    fn command(sequence: u32, force_mn: i32, enabled: bool) -> FromHost {
        FromHost::Command {
            sequence,
            force_mn,
            second_mn: None,
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
    fn newest_message_is_taken_once_and_skipped_are_counted() {
        let (mut posts, mut taker) = mailbox();
        let mut taken = |posted: &[Post]| {
            for post in posted {
                posts.push(*post).expect("there is room");
            }
            let Newest {
                enable,
                command,
                skipped,
            } = Newest::take(&mut taker);
            (enable, command, skipped)
        };
        assert_eq!(taken(&[]), (None, None, 0));
        let on = (Some(enable(2)), command(3, 10, true));
        assert_eq!(taken(&[(None, command(1, 0, false)), on]), (on.0, Some(on.1), 1));
        assert_eq!(taken(&[]), (None, None, 0));
        let six: Vec<Post> = (4..=9).map(|k| (None, command(k, 11, true))).collect();
        assert_eq!(taken(&six), (None, Some(command(9, 11, true)), 5));
        // On and off again before anybody looked: it stays off.
        let off = |sequence| (None, command(sequence, 0, false));
        let again = (Some(enable(11)), command(12, 5, true));
        assert_eq!(taken(&[off(10), again, off(13)]), (None, Some(off(13).1), 3));
        // Off and on again, and other forces after that.
        let last = (Some(enable(15)), command(16, 5, true));
        let more = (None, command(17, 6, true));
        assert_eq!(taken(&[off(14), last, more]), (last.0, Some(more.1), 2));
    }

    /// The device refuses nothing that is sent, and its motor is never off for a command that is to
    /// drive it.
    #[test]
    fn two_threads_never_disagree_on_whether_the_motor_is_on() {
        const POSTS: u32 = if cfg!(miri) { 300 } else { 500_000 };
        let (mut posts, mut taker) = mailbox();
        let mut firmware = Firmware::new(RigProperties::default(), Hand::Free, FirmwareProperties::default());
        firmware.receive(FromHost::Hello { nonce: 1 }, 0);
        let enabled = |firmware: &mut Firmware| match firmware.sample(0) {
            Some(FromDevice::Sample(sample)) => (sample.enabled, sample.command),
            other => panic!("{other:?}"),
        };
        // The taker's end goes with its panic, so that the poster ends, too.
        std::thread::scope(move |scope| {
            let poster = scope.spawn(move || {
                let mut random = fastrand::Rng::with_seed(3);
                let (mut sequence, mut on, mut last) = (0, false, command(0, 0, false));
                for _ in 0..POSTS {
                    let was_on = on;
                    // Switched often, so that many looks fall between an enable and what follows it.
                    on = random.u8(..4) != 0;
                    let enable = (on && !was_on).then(|| enable(sequence + 1));
                    sequence += 1 + u32::from(enable.is_some());
                    #[expect(clippy::cast_possible_wrap, reason = "a force that tells which command it came with")]
                    let force_mn = (sequence % 16_384) as i32;
                    last = command(sequence, if on { force_mn } else { 0 }, on);
                    while posts.push((enable, last)).is_err() && !posts.is_abandoned() {
                        std::thread::yield_now();
                    }
                }
                last
            });
            let mut seen = None;
            loop {
                // The poster's end goes last.
                let last_look = taker.is_abandoned();
                // As rtrb says of `is_abandoned`: without it the last posts may not be seen yet.
                std::sync::atomic::fence(std::sync::atomic::Ordering::Acquire);
                let taken = Newest::take(&mut taker);
                if let Some(message) = taken.enable {
                    let acknowledged = firmware.receive(message, 0);
                    assert!(
                        matches!(acknowledged, Some(FromDevice::Acknowledge { done: true, .. })),
                        "{message:?} was refused"
                    );
                }
                if let Some(message) = taken.command
                    && let FromHost::Command {
                        sequence,
                        force_mn,
                        enabled: on,
                        ..
                    } = message
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
        });
    }
}

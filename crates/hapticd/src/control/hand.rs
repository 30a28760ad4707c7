//! `hand`: where the hand on the fake rig reaches to, as one client at a time points.

use crate::control::facts::Facts;
use crate::control::peer::Requester;
use crate::rt::clock::now_ns;
use device_boards::Address;
use device_io::fake::{LETS_GO_AFTER_MS, Pointer};
use haptic_ipc::{ErrorCode, HandReply, Peer, WireError};
use std::cell::RefCell;

/// Farthest target, m: beyond the travel of any handle on a table.
const MAX_TARGET_M: f64 = 1.0;

/// The hand on the fake rig, and the client that moves it.
#[derive(Debug)]
pub(crate) struct PointerHand {
    pointer: Pointer,
    holder: RefCell<Option<Holder>>,
}

/// The client that pointed last.
#[derive(Debug)]
struct Holder {
    session: u64,
    by: Peer,
    /// Until then the hand is its own, ns.
    until_ns: u64,
}

impl PointerHand {
    /// The hand that reaches for a pointer.
    pub(crate) fn new(pointer: Pointer) -> Self {
        Self {
            pointer,
            holder: RefCell::default(),
        }
    }

    /// Points for a client, unless the arm has yet to let go of another's target.
    fn point(&self, by: Requester<'_>, target_m: f64, now_ns: u64) -> Result<(), WireError> {
        let mut holder = self.holder.borrow_mut();
        let until_ns = now_ns + u64::from(LETS_GO_AFTER_MS) * 1_000_000;
        match &mut *holder {
            Some(holder) if holder.session == by.session => holder.until_ns = until_ns,
            Some(Holder { by, until_ns, .. }) if now_ns < *until_ns => {
                let message =
                    format!("{by} moves the hand: it is free {LETS_GO_AFTER_MS} ms after the last `hand` from there");
                return Err(WireError::new(ErrorCode::HandHeld, message));
            }
            _ => {
                *holder = Some(Holder {
                    session: by.session,
                    by: by.peer.clone(),
                    until_ns,
                });
            }
        }
        self.pointer.point_at(target_m);
        Ok(())
    }
}

/// Points the hand on the rig at `target_m`, m.
pub(super) fn point(facts: &Facts, by: Requester<'_>, target_m: f64) -> Result<HandReply, WireError> {
    let Some(hand) = &facts.hand else {
        let why = if facts.address == Address::FAKE {
            "the fake rig has another hand: start hapticd with `--hand mouse`".to_owned()
        } else {
            let address = &facts.address;
            format!("{address} is moved by who holds it: only `--device fake --hand mouse` has a hand for clients")
        };
        return Err(WireError::new(ErrorCode::NoHand, why));
    };
    if target_m.abs() > MAX_TARGET_M {
        let message =
            format!("target_m = {target_m} m is out of range: it must be from -{MAX_TARGET_M} to {MAX_TARGET_M} m");
        let error = WireError::new(ErrorCode::OutOfRange, message).about("target_m");
        return Err(error.within(target_m, -MAX_TARGET_M, MAX_TARGET_M, "m"));
    }
    hand.point(by, target_m, now_ns())?;
    Ok(HandReply {
        lets_go_after_ms: LETS_GO_AFTER_MS,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_client_has_the_hand_once_the_arm_has_let_go() {
        let hand = PointerHand::new(Pointer::default());
        let peer = Peer {
            program: Some("haptic-gui".to_owned()),
            ..Peer::default()
        };
        let point = |session, ms: u64| {
            let by = Requester { session, peer: &peer };
            hand.point(by, 0.01, ms * 1_000_000).map_err(|refused| refused.code)
        };
        assert_eq!(point(1, 1000), Ok(()));
        assert_eq!(point(2, 1100), Err(ErrorCode::HandHeld));
        assert_eq!(point(1, 1150), Ok(()), "it has it on");
        assert_eq!(point(2, 1349), Err(ErrorCode::HandHeld));
        assert_eq!(point(2, 1350), Ok(()));
        assert_eq!(point(1, 1351), Err(ErrorCode::HandHeld));
    }
}

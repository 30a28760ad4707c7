//! `home`: a person says that the hand of a rig of two axes is in its home pose.

use crate::control::RigHandle;
use crate::control::exclusive_use;
use crate::control::facts::no_device;
use crate::control::peer::Requester;
use crate::control::rig::refused_in;
use device_io::link::Homing;
use haptic_ipc::{ErrorCode, StateReply, WireError};

/// Takes the counts of the next sample for those of the home pose. Relative encoders lose them with each connection.
///
/// # Errors
/// The rig has no home pose, no device is connected, force flows, another client has the rig to itself, or no sample
/// comes.
pub(super) async fn home(rig: &RigHandle, by: Requester<'_>) -> Result<StateReply, WireError> {
    let Some(homing) = rig.facts.homing() else {
        let message = "this rig has no home pose: only kinematics with `home_deg` have one";
        return Err(WireError::new(ErrorCode::NotApplicable, message));
    };
    let (_turn, state) = rig.quiet_state().await;
    if state.is_live() {
        let hint = "release it first";
        return Err(refused_in(state, ErrorCode::WrongState, "take the home pose", hint));
    }
    if !rig.facts.is_device_known() {
        return Err(no_device("take the home pose"));
    }
    exclusive_use::refuse_others(rig, "take the home pose")?;
    let _announcement = Announcement::now(homing);
    let mut looks = rig.channel.looks(rig.facts.period_ns);
    while !homing.is_taken() {
        looks.next().await?;
    }
    rig.enter_done("home", Some(by.peer), None);
    Ok(rig.state_reply())
}

/// What a person says now. It is withdrawn when nobody waits for it any more: a later sample may be of any other pose.
struct Announcement(Homing);

impl Announcement {
    fn now(homing: &Homing) -> Self {
        homing.tell();
        Self(homing.clone())
    }
}

impl Drop for Announcement {
    fn drop(&mut self) {
        self.0.withdraw();
    }
}

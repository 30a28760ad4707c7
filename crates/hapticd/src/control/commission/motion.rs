//! One motion of a client that has the rig to itself, from its request to its report: a pulse or an excitation.

use crate::control::RigHandle;
use crate::control::admission::{self, Purpose};
use crate::control::peer::Requester;
use crate::control::rig::exclusive_use::begin_motion;
use crate::control::rig::exclusive_use::motion::{ExclusiveMotion, lend};
use crate::control::rig::exclusive_use::state::Work;
use crate::log::{Level, say_at};
use crate::telemetry::feed::Feed;
use haptic_core::OwnMotion;
use haptic_core::planar::Plane;
use haptic_ipc::WireError;
use std::rc::Rc;
use std::time::Duration;

/// A motion that a client asks for, and what is made of its records.
pub(in crate::control) struct ClientMotion<R, O> {
    pub(in crate::control) motion: OwnMotion,
    pub(in crate::control) purpose: Purpose,
    /// Time that it may take, until the handle rests again.
    pub(in crate::control) longest: Duration,
    /// Whether it may begin, once the rig is engaged.
    pub(in crate::control) is_ready: R,
    /// Begins to observe it, right before it begins; returns its direction on a rig of two axes.
    pub(in crate::control) observe: O,
    /// Whether it has ended and the handle rests again.
    pub(in crate::control) is_over: fn(&Feed) -> bool,
    /// Takes the report into the work, also of a motion that was interrupted. Returns why the work ends with it, if it
    /// does: the handle moved the wrong way.
    pub(in crate::control) report: fn(&RigHandle, &mut Work, bool) -> Option<&'static str>,
}

/// Admits the rig while the client waits for the answer, and begins the motion, which goes on beside the requests.
///
/// # Errors
/// The rig may not be moved, or another motion is under way.
pub(in crate::control) async fn begin<R, O>(
    rig: &Rc<RigHandle>,
    by: Requester<'_>,
    asked: ClientMotion<R, O>,
) -> Result<(), WireError>
where
    R: FnMut(&Feed) -> Result<bool, String> + 'static,
    O: FnOnce(&RigHandle) -> Result<Plane, WireError> + 'static,
{
    let admission = admission::admit(rig, asked.purpose).await?;
    let stops = begin_motion(rig, by.session)?;
    let (rig, peer) = (Rc::clone(rig), by.peer.clone());
    tokio::task::spawn_local(async move {
        let exclusive = ExclusiveMotion {
            motion: asked.motion,
            longest: asked.longest,
            admission,
            stops,
            by: &peer,
        };
        let given = lend(&rig, exclusive, asked.is_ready, asked.observe, asked.is_over).await;
        let mut refuted = None;
        if let Some(current) = rig.exclusive_use().borrow_mut().as_mut() {
            current.moving = false;
            if let Some(why) = (asked.report)(&rig, &mut current.work, given.is_err()) {
                // Before anybody hears of it, and may engage.
                rig.records().refute(&current.device);
                refuted = Some(current.device.clone());
                current.end(why);
            }
            if let Err(why) = given {
                current.end(&why);
            }
        }
        if let Some(device) = refuted
            && let Err(why) = rig.records().withdraw(&rig.facts.state_dir, &device).await
        {
            let left = "the record of a rig whose motor moves it the wrong way is left: remove it by hand";
            say_at(Level::Error, &format!("{left}: {why}"));
        }
    });
    Ok(())
}

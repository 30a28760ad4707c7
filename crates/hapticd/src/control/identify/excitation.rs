//! One excitation, and what is made of its report.

use crate::control::RigHandle;
use crate::control::admission::Admission;
use crate::control::rig::exclusive_use::motion::{self, ExclusiveMotion};
use crate::control::rig::exclusive_use::state::Work;
use crate::telemetry::excitation::ObservedExcitation;
use haptic_core::{Excitation, Renderer};
use haptic_ipc::{ExcitationEnd, Peer};
use std::time::Duration;

/// Time that an excitation may take beyond its course: a device whose clock is slow, and the handle
/// that comes to rest.
const GRACE: Duration = Duration::from_secs(5);

/// Has the loop render an excitation.
pub(super) async fn run(rig: &RigHandle, excitation: Excitation, admission: Admission, stops: u64, by: &Peer) {
    let given = match Renderer::excitation(excitation, rig.facts.period_s()) {
        Err(error) => Err(error.to_string()),
        Ok(motion) => {
            let exclusive = ExclusiveMotion {
                motion,
                longest: Duration::from_secs_f64(1.1 * excitation.duration_s()) + GRACE,
                admission,
                stops,
                by,
            };
            motion::lend(
                rig,
                exclusive,
                |feed| {
                    let last = feed.newest().copied();
                    feed.excitation = Some(ObservedExcitation::new(excitation, last));
                },
                |feed| feed.excitation.as_ref().is_some_and(ObservedExcitation::is_over),
            )
            .await
        }
    };
    let was_interrupted = given.is_err();
    let observed = rig.feed().excitation.take();
    let report = observed.and_then(|observed| observed.report(was_interrupted));
    let mut exclusive_use = rig.exclusive_use().borrow_mut();
    let Some(current) = exclusive_use.as_mut() else { return };
    current.moving = false;
    if report
        .as_ref()
        .is_some_and(|report| report.end == ExcitationEnd::WrongWay)
    {
        current.end(
            "the handle moved against the force: the motor or the encoder is wired the other way (or somebody moved \
             the handle)",
        );
    }
    if let Work::Identification(done) = &mut current.work {
        done.excitations += 1;
        done.last = report;
    }
    if let Err(why) = given {
        current.end(&why);
    }
}

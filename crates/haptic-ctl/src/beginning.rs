//! The beginning of a recording: the subscription, and the circumstances in which it is made.

use crate::daemon::Daemon;
use crate::failure::Failure;
use haptic_ipc::{ClientError, Request, SceneReply, Status, SubscribeReply};
use haptic_recording::{Metadata, recorded_by};
use serde::Deserialize;
use std::time::{SystemTime, UNIX_EPOCH};

/// Subscribes, and asks for all that a recording's metadata hold.
pub(crate) async fn subscribe(
    daemon: &mut Daemon,
    subscription: Request,
    notes: Option<String>,
) -> Result<(Status, Metadata), Failure> {
    // Kept as it was said: a later daemon may say more than this program knows of.
    let configuration: serde_json::Value = daemon.ask(Request::Status {}).await?;
    let status = Status::deserialize(&configuration).map_err(ClientError::BadAnswer)?;
    let subscribed: SubscribeReply = daemon.ask(subscription).await?;
    // Asked after subscribing: a change in between is reported again, and not missed.
    let scene: SceneReply = daemon.ask(Request::get()).await?;
    let metadata = Metadata {
        server: daemon.hello().server.clone(),
        device: status.device.description.clone(),
        loop_rate_hz: status.rate_hz,
        rate_hz: subscribed.rate_hz,
        recorded_by: Some(recorded_by(concat!("haptic-ctl ", env!("CARGO_PKG_VERSION")))),
        started_unix_s: SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
            .as_secs_f64(),
        revision: scene.revision,
        scene: scene.scene,
        servo: subscribed.servo,
        notes,
        configuration: Some(configuration),
    };
    Ok((status, metadata))
}

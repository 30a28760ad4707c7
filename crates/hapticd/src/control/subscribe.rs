//! `subscribe`: begins, changes or ends a client's events.

use crate::control::RigHandle;
use crate::telemetry::subscribers::{ClientLine, Subscription};
use haptic_ipc::quantity::number;
use haptic_ipc::{ErrorCode, SubscribeReply, Topic, WireError};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{Semaphore, mpsc};

const DEFAULT_BATCH_MS: u32 = 10;
/// Slowest rate of samples; for fewer a client polls `status`.
const SLOWEST_HZ: f64 = 0.1;

pub(super) fn subscribe(
    rig: &RigHandle,
    session: u64,
    (lines, room): (&mpsc::Sender<ClientLine>, &Arc<Semaphore>),
    topics: &[Topic],
    rate_hz: Option<f64>,
    batch_ms: Option<u32>,
) -> Result<SubscribeReply, WireError> {
    let loop_rate_hz = 1.0 / rig.facts.period_s();
    let rate_hz = rate_hz.unwrap_or(loop_rate_hz);
    // The inverse of a period of whole nanoseconds has a rounding error.
    let fastest_hz = loop_rate_hz * (1.0 + 1e-9);
    if !(SLOWEST_HZ..=fastest_hz).contains(&rate_hz) {
        return Err(WireError::new(
            ErrorCode::OutOfRange,
            format!(
                "rate_hz = {} Hz is out of range: it must be from {SLOWEST_HZ} to {} Hz, the loop's rate",
                number(rate_hz),
                number((loop_rate_hz * 1e3).round() * 1e-3)
            ),
        )
        .about("rate_hz")
        .within(rate_hz, SLOWEST_HZ, loop_rate_hz, "Hz"));
    }
    let batch_ms = batch_ms.unwrap_or(DEFAULT_BATCH_MS);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 1 to 200 000"
    )]
    let every = (loop_rate_hz / rate_hz).round().max(1.0) as u64;
    let mut distinct: Vec<Topic> = Vec::with_capacity(3);
    for topic in topics {
        if !distinct.contains(topic) {
            distinct.push(*topic);
        }
    }
    // While force flows, the settings are those of the engagement; else those that one would have now.
    let channel = &rig.channel;
    let in_use = channel.servo_in_use(&rig.facts).filter(|_| channel.state().is_live());
    let servo = in_use.unwrap_or_else(|| rig.facts.servo_setup(rig.known.setup()));
    rig.feed().subscribers.subscribe(
        session,
        Subscription {
            topics: distinct.clone(),
            every,
            batch: Duration::from_millis(batch_ms.into()),
            lines: lines.clone(),
            room: Arc::clone(room),
        },
        servo.clone(),
    );
    #[expect(clippy::cast_precision_loss, reason = "at most 200 000")]
    let rate_hz = loop_rate_hz / every as f64;
    Ok(SubscribeReply {
        topics: distinct,
        rate_hz,
        batch_ms,
        columns: rig.facts.sample_columns(),
        servo: Some(servo),
    })
}

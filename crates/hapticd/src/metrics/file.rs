//! The metrics in a file, for the textfile collector of node_exporter: written anew every few seconds, whole or not at all.

use crate::control::RigHandle;
use crate::say;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{TrySendError, sync_channel};
use std::time::Duration;
use tokio::time::{MissedTickBehavior, interval};

/// Time between two writings.
const PERIOD: Duration = Duration::from_secs(5);

/// Keeps the file up to date for ever. A thread of its own writes: a disk that hangs holds nobody up.
///
/// # Errors
/// The system has no thread left.
pub(crate) async fn keep(path: Option<PathBuf>, rig: &RigHandle) -> std::io::Result<()> {
    let Some(path) = path else {
        return std::future::pending().await;
    };
    let (texts, to_write) = sync_channel::<String>(1);
    std::thread::Builder::new()
        .name("metrics".to_owned())
        .stack_size(128 * 1024)
        .spawn(move || {
            let mut worked = true;
            for text in to_write {
                let written = write(&path, &text);
                if let Err(error) = &written
                    && worked
                {
                    say(&format!("cannot write the metrics to {}: {error}", path.display()));
                }
                worked = written.is_ok();
            }
        })?;
    let mut period = interval(PERIOD);
    period.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        period.tick().await;
        match texts.try_send(super::prometheus_text(&super::openmetrics(rig))) {
            // The one before is still being written: the collector sees its age.
            Ok(()) | Err(TrySendError::Full(_)) => {}
            Err(TrySendError::Disconnected(_)) => return std::future::pending().await,
        }
    }
}

/// Replaces the file at once, readable for the collector.
fn write(path: &Path, text: &str) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let mut file = tempfile::NamedTempFile::new_in(folder.unwrap_or(Path::new(".")))?;
    file.write_all(text.as_bytes())?;
    file.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    file.persist(path)?;
    Ok(())
}

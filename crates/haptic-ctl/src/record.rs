//! `record`: every tick into a file.

use crate::condition::{Condition, Observations};
use crate::daemon::Daemon;
use crate::duration::duration;
use crate::failure::Failure;
use crate::{complete, output, progress};
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{Event, Request, SceneReply, Status, SubscribeReply, Topic};
use haptic_lab::recording::{self, CreateError, Metadata, Recorder, Totals};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::signal::unix::{SignalKind, signal};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording: CSV, with metadata in lines of `#`; `cargo doc -p haptic-lab` specifies it
    file: PathBuf,

    /// Duration, as in 10s [default: until interrupted]
    #[arg(long = "for", value_name = "TIME", value_parser = duration, allow_hyphen_values = true)]
    length: Option<Duration>,

    /// End when a condition holds, as in state=stopped; see `haptic-ctl wait --help`
    #[arg(long, value_name = "CONDITION", add = ArgValueCompleter::new(complete::conditions))]
    until: Option<Condition>,

    /// Rate of samples, Hz [default: every tick]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    rate: Option<f64>,

    /// Replace an existing file
    #[arg(long)]
    force: bool,
}

impl Arguments {
    pub(crate) fn request(&self) -> Request {
        Request::Subscribe {
            // What is told each second shows that the daemon is there, however slow the samples.
            topics: vec![Topic::State, Topic::Timing, Topic::Samples],
            rate_hz: self.rate,
            batch_ms: Some(20),
        }
    }
}

/// How a recording came to its end.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    /// The recording ended as the command line says.
    Reached,
    Interrupted,
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    // Caught from here on, so that the file is ended as it should be.
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    let status: Status = daemon.ask(Request::Status {}).await?;
    let subscribed: SubscribeReply = daemon.ask(arguments.request()).await?;
    // Asked after subscribing: a change in between is told of again, and not missed.
    let scene: SceneReply = daemon.ask(Request::get()).await?;
    let metadata = Metadata {
        server: daemon.hello().server.clone(),
        device: status.device.description,
        loop_rate_hz: status.rate_hz,
        rate_hz: subscribed.rate_hz,
        started_unix_s: SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default()
            .as_secs_f64(),
        revision: scene.revision,
        scene: scene.scene,
        servo: subscribed.servo,
        notes: None,
        configuration: None,
    };
    let failed = |error: std::io::Error| Failure::File(format!("{}: {error}", arguments.file.display()));
    let mut recorder = create(&arguments.file, &metadata, arguments.force)?;
    let bar = progress::bar(arguments.length);
    let mut known = Observations::default();
    let end = loop {
        let event = tokio::select! {
            event = daemon.regular_event() => event,
            _ = interrupt.recv() => break End::Interrupted,
            _ = terminate.recv() => break End::Interrupted,
        };
        let mut event = match event {
            Ok(event) => event,
            Err(failure) => {
                // What there is stays readable; without its end mark it shows that it was not ended
                // on purpose.
                recorder.flush().map_err(failed)?;
                return Err(failure);
            }
        };
        let full = arguments
            .length
            .is_some_and(|length| cut(&mut event, recorder.first_s(), length));
        recorder.event(&event).map_err(failed)?;
        if matches!(event, Event::Timing(_)) {
            recorder.flush().map_err(failed)?;
        }
        let totals = recorder.totals();
        bar.set_position(progress::position(totals.length_s));
        bar.set_message(summary(&totals));
        let fulfilled = arguments
            .until
            .as_ref()
            .is_some_and(|condition| known.take(event, condition));
        if full || fulfilled {
            break End::Reached;
        }
    };
    bar.finish_and_clear();
    let totals = recorder.finish().map_err(failed)?;
    show(&arguments.file, &totals, json)?;
    // Without a time or a condition, an interrupt is how a recording ends.
    let unlimited = arguments.length.is_none() && arguments.until.is_none();
    if end == End::Interrupted && !unlimited {
        return Err(Failure::Interrupted);
    }
    Ok(())
}

fn create(path: &Path, metadata: &Metadata, force: bool) -> Result<Recorder, Failure> {
    if path == Path::new("-") {
        return Err(Failure::Usage(
            "`-`: a recording goes to a file; for samples on standard output there is `haptic-ctl watch --rate all \
             --json`"
                .to_owned(),
        ));
    }
    recording::create(path, metadata, force).map_err(|error| {
        let advice = match &error {
            CreateError::File { source, .. } if source.kind() == std::io::ErrorKind::AlreadyExists => {
                "; --force writes over it"
            }
            _ => "",
        };
        Failure::Usage(format!("{error}{advice}"))
    })
}

/// Takes the samples beyond the length out of an event; says whether the length has been reached.
fn cut(event: &mut Event, first_s: Option<f64>, length: Duration) -> bool {
    let Event::Samples(samples) = event else { return false };
    let Some(first_s) = first_s.or(samples.rows.first().map(|row| row.t_s)) else {
        return false;
    };
    // Times of ticks are not exact to the last bit; a tenth of the shortest period is.
    let end_s = first_s + length.as_secs_f64() - 5e-6;
    let kept = samples.rows.partition_point(|row| row.t_s < end_s);
    let full = kept < samples.rows.len();
    samples.rows.truncate(kept);
    full
}

fn summary(totals: &Totals) -> String {
    #[expect(clippy::cast_precision_loss, reason = "a size in megabytes")]
    let megabytes = totals.bytes as f64 * 1e-6;
    format!(
        "{:.1} s, {} rows, {megabytes:.2} MB, {} lost",
        totals.length_s, totals.rows, totals.lost
    )
}

fn show(path: &Path, totals: &Totals, json: bool) -> Result<(), Failure> {
    if json {
        return output::json(&serde_json::json!({
            "file": path,
            "rows": totals.rows,
            "lost": totals.lost,
            "bytes": totals.bytes,
            "length_s": totals.length_s,
        }));
    }
    output::line(&format!("{}: {}", path.display(), summary(totals)))
}

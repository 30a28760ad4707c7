//! `watch`: samples as they come.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use clap::Args;
use haptic_ipc::{Event, Request, Sample, SubscribeReply, Topic};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Rate of samples, Hz, or `all` for every tick
    #[arg(long, value_name = "HZ", default_value = "10", allow_hyphen_values = true)]
    rate: Rate,

    /// Number of samples [default: until interrupted]
    #[arg(long, value_name = "N")]
    count: Option<u64>,
}

#[derive(Clone, Copy, Debug)]
enum Rate {
    All,
    Hz(f64),
}

impl std::str::FromStr for Rate {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            _ => match text.parse::<f64>() {
                Ok(rate) if rate.is_finite() => Ok(Self::Hz(rate)),
                _ => Err(format!("`{text}` is neither a number of hertz nor `all`")),
            },
        }
    }
}

impl Arguments {
    pub(crate) fn request(&self) -> Request {
        Request::Subscribe {
            topics: vec![Topic::Samples],
            rate_hz: match self.rate {
                Rate::All => None,
                Rate::Hz(rate) => Some(rate),
            },
            batch_ms: None,
        }
    }
}

pub(crate) async fn run(
    daemon: &mut Daemon,
    arguments: &Arguments,
    request: Request,
    json: bool,
) -> Result<(), Failure> {
    let _: SubscribeReply = daemon.ask(request).await?;
    let mut left = arguments.count.unwrap_or(u64::MAX);
    if !json {
        output::line(&header())?;
    }
    while left > 0 {
        let Event::Samples(batch) = daemon.next_event().await? else {
            continue;
        };
        let Some(first) = batch.rows.first() else {
            continue;
        };
        if batch.dropped > 0 {
            eprintln!(
                "haptic-ctl: {} samples were lost before tick {}",
                batch.dropped, first.tick
            );
        }
        let shown = usize::try_from(left).unwrap_or(usize::MAX).min(batch.rows.len());
        let lines: Vec<String> = batch.rows[..shown]
            .iter()
            .map(|sample| if json { object(sample) } else { row(sample) })
            .collect();
        // One write a batch keeps up with every tick of a fast loop.
        output::line(&lines.join("\n"))?;
        left -= shown as u64;
    }
    Ok(())
}

fn object(sample: &Sample) -> String {
    serde_json::Value::Object(sample.to_object()).to_string()
}

fn header() -> String {
    format!(
        "{:>10} {:>9}  {:<12} {:<8} {:>11} {:>11} {:>9} {:>9} {:>9}",
        "tick", "t s", "state", "contact", "device mm", "block mm", "device m/s", "block m/s", "force N"
    )
}

/// A contact in words.
pub(crate) const fn contact(direction: i8) -> &'static str {
    match direction {
        0 => "stuck",
        1.. => "slides +",
        _ => "slides -",
    }
}

fn row(sample: &Sample) -> String {
    format!(
        "{:>10} {:>9.3}  {:<12} {:<8} {:>11.3} {:>11.3} {:>10.4} {:>9.4} {:>9.3}",
        sample.tick,
        sample.t_s,
        sample.state,
        contact(sample.contact),
        sample.device_position_m * 1e3,
        sample.block_position_m * 1e3,
        sample.device_velocity_mps,
        sample.block_velocity_mps,
        sample.command_force_n
    )
}

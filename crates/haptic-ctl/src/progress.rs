//! A line that shows how far something is. Only on a terminal; where the output is piped nothing of
//! it is written.

use crate::output;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::borrow::Cow;
use std::time::Duration;

/// A line for something that takes this long, or until it is ended, and another below it for keys,
/// where there are some. Its position is set by [`position`].
pub(crate) fn bar(length: Option<Duration>, keys: Option<&'static str>) -> ProgressBar {
    let (bar, line) = match length {
        Some(length) => (
            ProgressBar::new(position(length.as_secs_f64())),
            "[{wide_bar}] {percent}%  {msg}",
        ),
        None => (ProgressBar::no_length(), "{spinner} {msg}"),
    };
    match keys {
        Some(keys) => styled(bar, &format!("{line}\n{{prefix}}")).with_prefix(keys),
        None => styled(bar, line),
    }
}

/// A line for `count` steps.
pub(crate) fn steps(count: usize) -> ProgressBar {
    styled(ProgressBar::new(count as u64), "[{wide_bar}] {pos}/{len}  {msg}")
}

/// A line for work of unknown duration.
pub(crate) fn busy(message: impl Into<Cow<'static, str>>) -> ProgressBar {
    let bar = styled(ProgressBar::no_length(), "{spinner} {msg}  {elapsed}");
    bar.set_message(message);
    bar.enable_steady_tick(Duration::from_millis(100));
    bar
}

/// Seconds as the position of a bar.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "the cast saturates, and a bar may"
)]
pub(crate) fn position(seconds: f64) -> u64 {
    (seconds * 1e3) as u64
}

/// No colours here, so that none need to be switched off.
fn styled(bar: ProgressBar, template: &str) -> ProgressBar {
    bar.set_draw_target(if output::is_quiet() {
        ProgressDrawTarget::hidden()
    } else {
        ProgressDrawTarget::stderr_with_hz(10)
    });
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    bar.set_style(style.progress_chars("=> "));
    bar
}

//! The outcome of an action, shown for a few seconds.

use crate::theme::Palette;
use crate::words::{in_two_lines, shortened};
use egui::{Align, Button, Layout, Rect, RichText, TextStyle, Ui, UiBuilder, vec2};
use std::time::{Duration, Instant};

/// How long a success is shown.
const SHOWN_FOR: Duration = Duration::from_secs(8);

/// The outcome of an action: done, or the reason of its failure.
#[derive(Debug)]
pub(crate) struct Notice {
    pub(crate) outcome: Result<String, String>,
    /// The time of its first frame.
    since: Option<Instant>,
}

impl Notice {
    pub(crate) fn new(outcome: Result<String, String>) -> Self {
        Self { outcome, since: None }
    }
}

/// Drops a success whose time is over, or returns the time that is left. A failure stays until it is
/// closed or replaced.
pub(crate) fn expire(slot: &mut Option<Notice>, now: Instant) -> Option<Duration> {
    let notice = slot.as_mut().filter(|notice| notice.outcome.is_ok())?;
    let since = *notice.since.get_or_insert(now);
    let left = (since + SHOWN_FOR).saturating_duration_since(now);
    if left.is_zero() {
        *slot = None;
        return None;
    }
    Some(left)
}

/// Shows it in the rest of a row.
pub(crate) fn show(ui: &mut Ui, slot: &mut Option<Notice>) {
    let Some(notice) = slot else {
        return;
    };
    match &notice.outcome {
        Ok(done) => shortened(ui, RichText::new(done).small(), done),
        Err(why) => {
            let close = Button::new(RichText::new("Close").small()).small();
            let is_closed = ui.add(close).accessible_name("close the message").clicked();
            show_failure(ui, why);
            if is_closed {
                *slot = None;
            }
        }
    }
}

/// Shows a reason. Its lines take no part in the layout: the row keeps its height.
fn show_failure(ui: &mut Ui, why: &str) {
    let place = ui.available_rect_before_wrap();
    let height = 2.0 * ui.text_style_height(&TextStyle::Small);
    let place = Rect::from_center_size(place.center(), vec2(place.width(), height));
    let layout = Layout::left_to_right(Align::Center);
    let mut child = ui.new_child(UiBuilder::new().max_rect(place).layout(layout));
    let color = Palette::of(ui).error_text;
    in_two_lines(&mut child, why, color);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn success_notice_expires_and_failure_notice_stays() {
        let begin = Instant::now();
        let mut done = Some(Notice::new(Ok("written".to_owned())));
        assert_eq!(expire(&mut done, begin), Some(SHOWN_FOR));
        let second = Duration::from_secs(1);
        assert_eq!(expire(&mut done, begin + second), Some(SHOWN_FOR - second));
        assert_eq!(expire(&mut done, begin + SHOWN_FOR), None);
        assert!(done.is_none());
        let mut failed = Some(Notice::new(Err("no such folder".to_owned())));
        assert_eq!(expire(&mut failed, begin), None);
        assert_eq!(expire(&mut failed, begin + 100 * SHOWN_FOR), None);
        assert!(failed.is_some());
    }
}

//! What was done, said for a while: it stands where there is better use for the room.

use crate::theme::Palette;
use egui::{Button, Label, RichText, Ui};
use std::time::{Duration, Instant};

/// How long it is said.
const SAID_FOR: Duration = Duration::from_secs(8);

/// What was done, or why it was not.
#[derive(Debug)]
pub(crate) struct Notice {
    pub(crate) told: Result<String, String>,
    /// When it was drawn first.
    since: Option<Instant>,
}

impl Notice {
    pub(crate) fn new(told: Result<String, String>) -> Self {
        Self { told, since: None }
    }
}

/// Drops what has been said for long enough, or gives how long it is still to be said. What failed stays until it is closed, or something else
/// takes its place.
pub(crate) fn let_go(slot: &mut Option<Notice>, now: Instant) -> Option<Duration> {
    let notice = slot.as_mut().filter(|notice| notice.told.is_ok())?;
    let since = *notice.since.get_or_insert(now);
    let left = (since + SAID_FOR).saturating_duration_since(now);
    if left.is_zero() {
        *slot = None;
        return None;
    }
    Some(left)
}

/// Says it in a line.
pub(crate) fn show(ui: &mut Ui, slot: &mut Option<Notice>) {
    let Some(notice) = slot else {
        return;
    };
    let is_closed = match &notice.told {
        Ok(done) => {
            ui.add(Label::new(RichText::new(done).small()).truncate())
                .on_hover_text(done);
            false
        }
        Err(why) => {
            let text = RichText::new(why).small().color(Palette::of(ui).error_text);
            let row = ui.horizontal(|ui| {
                let close = Button::new(RichText::new("Close").small()).small();
                let is_closed = ui.add(close).accessible_name("close the message").clicked();
                ui.add(Label::new(text).truncate()).on_hover_text(why);
                is_closed
            });
            row.inner
        }
    };
    if is_closed {
        *slot = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_done_is_said_for_a_while_and_what_failed_until_it_is_closed() {
        let begin = Instant::now();
        let mut done = Some(Notice::new(Ok("written".to_owned())));
        assert_eq!(let_go(&mut done, begin), Some(SAID_FOR));
        let second = Duration::from_secs(1);
        assert_eq!(let_go(&mut done, begin + second), Some(SAID_FOR - second));
        assert_eq!(let_go(&mut done, begin + SAID_FOR), None);
        assert!(done.is_none());
        let mut failed = Some(Notice::new(Err("no such folder".to_owned())));
        assert_eq!(let_go(&mut failed, begin), None);
        assert_eq!(let_go(&mut failed, begin + 100 * SAID_FOR), None);
        assert!(failed.is_some());
    }
}

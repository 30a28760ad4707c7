//! Typing: the field of a number, and whether Space is typed into a text field, a word that each frame writes for those
//! who take keys between two frames.

use egui::{DragValue, Key, Ui, Widget};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Time without a frame after which Space stops whatever has the keyboard: a window that hangs shows no text.
const FRAME_TIMEOUT: Duration = Duration::from_millis(300);

/// Longest time between two frames while a text field has the keyboard: two may be late.
pub(crate) const FRAME_PERIOD: Duration = Duration::from_millis(100);

/// The word.
#[derive(Debug)]
pub(crate) struct Typing {
    began: Instant,
    /// Until when Space is typed, ns since `began`; 0 where no text field has the keyboard.
    until_ns: AtomicU64,
}

impl Typing {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            began: now,
            until_ns: AtomicU64::new(0),
        }
    }

    pub(crate) fn note_frame(&self, has_field: bool, now: Instant) {
        let until_ns = if has_field { self.ns(now + FRAME_TIMEOUT) } else { 0 };
        self.until_ns.store(until_ns, Ordering::Release);
    }

    /// Whether Space is typed.
    pub(crate) fn takes_space(&self, now: Instant) -> bool {
        self.ns(now) < self.until_ns.load(Ordering::Acquire)
    }

    fn ns(&self, time: Instant) -> u64 {
        u64::try_from(time.saturating_duration_since(self.began).as_nanos()).unwrap_or(u64::MAX)
    }
}

/// The field of a value, as `design` makes it. What is typed counts by Enter or Tab alone: a half-typed number is
/// dropped when the field loses the keyboard otherwise.
pub(crate) fn number_field(value: &mut f64, design: impl FnOnce(DragValue<'_>) -> DragValue<'_>) -> impl Widget {
    move |ui: &mut Ui| {
        let mut typed = *value;
        let field = ui.add(design(DragValue::new(&mut typed)).update_while_editing(false));
        let is_left_by_key = ui.input(|input| input.key_pressed(Key::Enter) || input.key_pressed(Key::Tab));
        if !field.lost_focus() || is_left_by_key {
            *value = typed;
        }
        field
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H28
    #[test]
    fn space_is_typed_until_no_frame_came_for_300_ms() {
        let begin = Instant::now();
        let at = |ms| begin + Duration::from_millis(ms);
        let typing = Typing::new(begin);
        assert!(!typing.takes_space(at(0)), "no frame was drawn");
        typing.note_frame(true, at(1000));
        typing.note_frame(true, at(1100));
        assert!(typing.takes_space(at(1100)) && typing.takes_space(at(1399)));
        assert!(!typing.takes_space(at(1400)), "the window hangs");
        typing.note_frame(true, at(2000));
        assert!(typing.takes_space(at(2000)), "it is back");
        typing.note_frame(false, at(2010));
        assert!(!typing.takes_space(at(2011)), "the field has lost the keyboard");
    }
}

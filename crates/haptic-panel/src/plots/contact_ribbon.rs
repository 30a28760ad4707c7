//! The ribbon above the plots that shows when the block stuck and when it slid.

use super::scope::TimeRange;
use crate::tape::Tape;
use crate::theme::Palette;
use egui::{Rect, Ui};
use egui_plot::PlotTransform;

/// Paints the ribbon into `strip`, on the time axis of the plots below it.
pub(crate) fn paint(ui: &Ui, strip: Rect, transform: &PlotTransform, tape: &Tape, seen: &TimeRange) {
    let palette = Palette::of(ui);
    let frame = transform.frame();
    let painter = ui
        .painter()
        .with_clip_rect(strip.with_min_x(frame.left()).with_max_x(frame.right()));
    let columns = f64::from(frame.width() * ui.pixels_per_point());
    let contacts = tape.contacts((seen.from_s, seen.to_s), seen.column_s(columns));
    for run in runs(contacts, seen.zero_s) {
        let left = transform.position_from_point_x(run.from);
        let right = transform.position_from_point_x(run.to);
        let color = if run.slides { palette.sliding } else { palette.stuck };
        painter.rect_filled(strip.with_min_x(left).with_max_x(right), 0, color);
    }
}

/// A time of one kind of contact, s from the zero of the axis.
#[derive(Debug, PartialEq)]
pub(crate) struct Run {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) slides: bool,
}

/// Joins contacts of one kind. Each contact comes with its time, and lasts until the next one or until the
/// force ends. `zero_s` is the zero of the axis, s on the daemon's clock.
pub(crate) fn runs(contacts: impl IntoIterator<Item = (f64, Option<bool>)>, zero_s: f64) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    let mut before = None;
    for (t_s, now) in contacts {
        let t_s = t_s - zero_s;
        if let Some(last) = runs.last_mut().filter(|_| before.is_some()) {
            last.to = t_s;
        }
        if let Some(slides) = now.filter(|_| now != before) {
            runs.push(Run {
                from: t_s,
                to: t_s,
                slides,
            });
        }
        before = now;
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;
    use haptic_ipc::{RigState, Sample};

    /// The runs of samples that are drawn one by one.
    fn runs_of(samples: impl IntoIterator<Item = Sample>, zero_s: f64) -> Vec<Run> {
        runs(Tape::recorded(samples).contacts((-100.0, 100.0), 0.01), zero_s)
    }

    fn run(from: f64, to: f64, slides: bool) -> Run {
        Run { from, to, slides }
    }

    #[test]
    fn samples_of_the_same_contact_are_one_run() {
        let samples = [(7.0, 0), (8.0, 0), (9.0, -1), (10.0, 1)].map(|(t_s, contact)| Sample { contact, ..at(t_s) });
        assert_eq!(runs_of(samples, 10.0), [run(-3.0, -1.0, false), run(-1.0, 0.0, true)]);
    }

    #[test]
    fn nothing_sticks_while_no_force_is_on() {
        let samples = [
            (0.0, RigState::Idle),
            (1.0, RigState::Engaging),
            (2.0, RigState::Engaged),
            (3.0, RigState::Stopped),
            (4.0, RigState::Stopped),
            (5.0, RigState::Engaged),
            (6.0, RigState::Releasing),
        ];
        let samples = samples.map(|(t_s, state)| Sample { state, ..at(t_s) });
        assert_eq!(runs_of(samples, 0.0), [run(1.0, 3.0, false), run(5.0, 6.0, false)]);
        assert_eq!(runs_of(samples[3..5].to_vec(), 0.0), []);
    }
}

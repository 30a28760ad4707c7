//! A ribbon over the plots that shows when the block stuck and when it slid.

use crate::history::History;
use crate::theme::Palette;
use egui::{Rect, Ui};
use egui_plot::PlotTransform;

/// Paints the ribbon into `strip`, on the time axis of the plot below it.
pub(crate) fn paint(ui: &Ui, strip: Rect, transform: &PlotTransform, history: &History) {
    let palette = Palette::of(ui);
    let frame = transform.frame();
    let painter = ui.painter_at(strip.with_min_x(frame.left()).with_max_x(frame.right()));
    for run in runs(history.with_age().map(|(age, sample)| (age, sample.contact != 0))) {
        let left = transform.position_from_point_x(run.from);
        let right = transform.position_from_point_x(run.to);
        let color = if run.slides { palette.sliding } else { palette.stuck };
        painter.rect_filled(strip.with_min_x(left).with_max_x(right), 0, color);
    }
}

/// A while of one kind of contact, s relative to the newest sample.
#[derive(Debug, PartialEq)]
struct Run {
    from: f64,
    to: f64,
    slides: bool,
}

/// Joins samples of the same contact; each run lasts until the next one begins.
fn runs(samples: impl Iterator<Item = (f64, bool)>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (age, slides) in samples {
        if let Some(last) = runs.last_mut() {
            last.to = age;
            if last.slides == slides {
                continue;
            }
        }
        runs.push(Run {
            from: age,
            to: age,
            slides,
        });
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_of_the_same_contact_are_one_run() {
        let samples = [(-3.0, false), (-2.0, false), (-1.0, true), (0.0, true)];
        let stuck = Run {
            from: -3.0,
            to: -1.0,
            slides: false,
        };
        let sliding = Run {
            from: -1.0,
            to: 0.0,
            slides: true,
        };
        assert_eq!(runs(samples.into_iter()), [stuck, sliding]);
    }
}

//! A ribbon over the plots that shows when the block stuck and when it slid.

use crate::scope::Scope;
use crate::theme::Palette;
use egui::{Rect, Ui};
use egui_plot::PlotTransform;

/// Paints the ribbon into `strip`, on the time axis of the plot below it.
pub(crate) fn paint(ui: &Ui, strip: Rect, transform: &PlotTransform, scope: &Scope) {
    let palette = Palette::of(ui);
    let frame = transform.frame();
    let painter = ui.painter_at(strip.with_min_x(frame.left()).with_max_x(frame.right()));
    let seen = scope.seen();
    let samples = scope.tape().around(seen.from_s, seen.to_s);
    for run in runs(samples.map(|sample| (sample.t_s - seen.zero_s, sample.contact != 0))) {
        let left = transform.position_from_point_x(run.from);
        let right = transform.position_from_point_x(run.to);
        let color = if run.slides { palette.sliding } else { palette.stuck };
        painter.rect_filled(strip.with_min_x(left).with_max_x(right), 0, color);
    }
}

/// A while of one kind of contact, s from the zero of the axis.
#[derive(Debug, PartialEq)]
pub(crate) struct Run {
    pub(crate) from: f64,
    pub(crate) to: f64,
    pub(crate) slides: bool,
}

/// Joins samples of the same contact; each run lasts until the next one begins.
pub(crate) fn runs(samples: impl Iterator<Item = (f64, bool)>) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (t_s, slides) in samples {
        if let Some(last) = runs.last_mut() {
            last.to = t_s;
            if last.slides == slides {
                continue;
            }
        }
        runs.push(Run {
            from: t_s,
            to: t_s,
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

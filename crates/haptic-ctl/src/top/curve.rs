//! A curve over time, and the gauge of its newest value.

use super::model::{Model, WINDOW_S};
use haptic_ipc::{Sample, SampleY};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

/// A value over time, with its newest on a gauge.
pub(super) struct Curve {
    pub(super) title: &'static str,
    pub(super) unit: &'static str,
    pub(super) value: fn(&Sample, Option<&SampleY>) -> f64,
    /// The same along the second axis of two, where it is drawn beside the first.
    pub(super) beside: Option<fn(&SampleY) -> f64>,
    /// Where the gauge ends on either side; without one it ends where the curve does.
    pub(super) full_scale: Option<f64>,
    pub(super) style: Style,
}

impl Curve {
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect, model: &Model) {
        let points: Vec<(f64, f64)> = model
            .past
            .iter()
            .map(|(sample, y)| (sample.t_s, (self.value)(sample, y.as_ref())))
            .collect();
        let beside: Vec<(f64, f64)> = model
            .past
            .iter()
            .filter_map(|(sample, y)| Some((sample.t_s, self.beside?(y.as_ref()?))))
            .collect();
        let newest = points.last().copied();
        let second = beside
            .last()
            .map_or_else(String::new, |(_, value)| format!(", {value:+.2}"));
        let title = newest.map_or_else(
            || format!(" {} ", self.title),
            |(_, value)| format!(" {}  {value:+.2}{second} {} ", self.title, self.unit),
        );
        let block = Block::bordered().title(title);
        let inner = block.inner(area);
        frame.render_widget(block, area);
        let [plot, gauge] = Layout::vertical([Constraint::Fill(1), Constraint::Length(1)]).areas(inner);
        let Some((now_s, value)) = newest else { return };
        let both = points.iter().chain(&beside);
        let largest = both.map(|(_, value)| value.abs()).fold(0.0, f64::max);
        let limit = round_up(largest);
        let line = |points, style| {
            let dataset = Dataset::default().marker(Marker::Braille).graph_type(GraphType::Line);
            dataset.style(style).data(points)
        };
        let second = line(&beside, self.style.add_modifier(Modifier::DIM));
        let chart = Chart::new(vec![second, line(&points, self.style)])
            .x_axis(Axis::default().bounds([now_s - WINDOW_S, now_s]))
            .y_axis(Axis::default().bounds([-limit, limit]).labels([
                format!("{:+}", -limit),
                "0".to_owned(),
                format!("{limit:+}"),
            ]));
        frame.render_widget(chart, plot);
        let full_scale = self.full_scale.unwrap_or(limit);
        let text = signed_gauge(value / full_scale, usize::from(gauge.width));
        frame.render_widget(Paragraph::new(text).style(self.style), gauge);
    }
}

/// The next of 1, 2, 5, 10, 20... that is not smaller.
fn round_up(value: f64) -> f64 {
    let least = value.max(0.1);
    let decade = 10_f64.powf(least.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|step| step * decade >= least);
    step.unwrap_or(10.0) * decade
}

/// A bar to the right or the left of the middle for a share from -1 to 1 of its half.
fn signed_gauge(share: f64, width: usize) -> String {
    let half = width.saturating_sub(1) / 2;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a share of a line's width"
    )]
    let filled = (share.abs().min(1.0) * half as f64).round() as usize;
    let (left, right) = if share < 0.0 { (filled, 0) } else { (0, filled) };
    format!(
        "{}{}|{}{}",
        "\u{b7}".repeat(half - left),
        "\u{2588}".repeat(left),
        "\u{2588}".repeat(right),
        "\u{b7}".repeat(half - right)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gauge_fills_from_the_middle() {
        assert_eq!(signed_gauge(0.0, 9), "····|····");
        assert_eq!(signed_gauge(0.5, 9), "····|██··");
        assert_eq!(signed_gauge(-3.0, 9), "████|····");
        assert_eq!(signed_gauge(1.0, 0), "|");
    }

    #[test]
    fn an_axis_ends_at_a_round_number() {
        for (value, end) in [
            (0.0, 0.1),
            (0.9, 1.0),
            (1.0, 1.0),
            (3.4, 5.0),
            (5.1, 10.0),
            (12.0, 20.0),
        ] {
            assert!((round_up(value) - end).abs() < 1e-9, "{value}: {}", round_up(value));
        }
    }
}

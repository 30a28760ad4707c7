//! The panes of the loop: its latencies, its counts and the link.

use super::draw::Theme;
use super::model::Model;
use crate::{output, timing};
use haptic_ipc::{Percentiles, Status};
use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

pub(super) fn draw_histogram(frame: &mut Frame<'_>, area: Rect, model: &Model) {
    let timing = model.daemon.timing.as_ref();
    let buckets = timing.map_or(&[][..], |timing| &timing.last_10_s.histogram.wake_latency_ns);
    let used = buckets.iter().skip_while(|bucket| bucket.count == 0).count();
    let block = Block::bordered();
    let shown = used.min(usize::from(block.inner(area).height));
    // The slowest buckets matter most.
    let title = if shown < used {
        " wake-up latency, 10 s, the slowest "
    } else {
        " wake-up latency, last 10 s "
    };
    let block = block.title(title);
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let text = timing::histogram(&buckets[buckets.len() - shown..], 12.0);
    frame.render_widget(Paragraph::new(text), inner);
}

pub(super) fn draw_health(frame: &mut Frame<'_>, area: Rect, model: &Model, theme: Theme) {
    let block = Block::bordered().title(" loop and link ");
    let inner = block.inner(area);
    frame.render_widget(block, area);
    let doubtful = |count: u64| {
        if count > 0 {
            theme.colour(Color::Red).add_modifier(Modifier::BOLD)
        } else {
            Style::new()
        }
    };
    let mut lines: Vec<Line<'_>> = Vec::new();
    if let Some(timing) = &model.daemon.timing {
        let window = &timing.last_10_s;
        lines.push(Line::from("               p50      p99      max us"));
        lines.push(percentiles("wake-up", &window.wake_latency_ns));
        lines.push(percentiles("tick", &window.tick_ns));
        let counts = [
            ("overruns", timing.since_start.overruns),
            ("missed", timing.since_start.missed_periods),
            (
                "rows lost",
                timing.since_start.telemetry_dropped + model.daemon.lost_rows,
            ),
        ];
        lines.push(Line::from_iter(counts.into_iter().flat_map(|(name, count)| {
            [
                Span::raw(format!("{name} ")),
                Span::styled(format!("{count}  "), doubtful(count)),
            ]
        })));
    }
    if let Some(status) = &model.daemon.status {
        lines.extend(link_and_thread(status, doubtful));
    }
    frame.render_widget(Paragraph::new(lines), inner);
}

/// The lines of the link and the real-time thread; `doubtful` styles a count.
fn link_and_thread(status: &Status, doubtful: impl Fn(u64) -> Style) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    match &status.device.link {
        None => lines.push(Line::from("rig: in the daemon itself")),
        Some(link) => {
            // Without a device the times are of the one that is gone.
            lines.push(Line::from(match &link.waiting {
                Some(why) => format!("no rig: {why}"),
                None => format!(
                    "link: {:.0} us (max {:.0}), {:.0} us old",
                    link.round_trip_us, link.round_trip_max_us, link.age_us
                ),
            }));
            let counts = &link.counts;
            let bad = counts.lost + counts.bad_crc + counts.malformed;
            let text = format!(
                "samples lost {}, bad CRC {}, malformed {}",
                counts.lost, counts.bad_crc, counts.malformed
            );
            lines.push(Line::styled(text, doubtful(bad)));
        }
    }
    let thread = &status.real_time;
    lines.push(Line::from(format!("{}, {}", thread.scheduling(), thread.place())));
    lines.push(Line::from(format!(
        "{}, {} (two are this program's)",
        thread.memory(),
        output::count(status.clients as u64, "client")
    )));
    lines.push(Line::from(status.device.description.clone()));
    lines
}

#[expect(clippy::cast_precision_loss, reason = "durations below 2^53 ns")]
fn percentiles(name: &str, of: &Percentiles) -> Line<'static> {
    let shown = |ns: u64| {
        let us = ns as f64 * 1e-3;
        if us < 1e5 {
            format!("{us:.1}")
        } else {
            format!("{:.0} ms", us * 1e-3)
        }
    };
    Line::from(format!(
        "{name:9}{:>9}{:>9}{:>9}",
        shown(of.p50),
        shown(of.p99),
        shown(of.max)
    ))
}

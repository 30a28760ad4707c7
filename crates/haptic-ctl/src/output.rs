//! Writing to standard output. A reader that goes away is an error to pass on, not a panic.

use crate::failure::Failure;
use crate::hint;
use haptic_core::Directional;
use haptic_ipc::quantity;
use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};
use rustix::termios::tcgetwinsize;
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::sync::OnceLock;

/// Whether nothing is printed but what was asked for.
static IS_QUIET: OnceLock<bool> = OnceLock::new();

/// Takes what the command line says, once.
pub(crate) fn choose(quiet: bool) {
    IS_QUIET.get_or_init(|| quiet);
}

/// Whether nothing is printed but what was asked for.
pub(crate) fn is_quiet() -> bool {
    IS_QUIET.get().is_some_and(|quiet| *quiet)
}

/// Writes what nobody asked for, in a line: that an action was done, advice, a heading. Not with --quiet.
pub(crate) fn unless_quiet(text: &str) -> Result<(), Failure> {
    if is_quiet() { Ok(()) } else { line(text) }
}

/// Writes a text for people and a newline.
pub(crate) fn line(text: &str) -> Result<(), Failure> {
    exact(&hint::addressed(text))
}

/// Writes data and a newline.
pub(crate) fn exact(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{text}")?;
    Ok(out.flush()?)
}

/// The same; a terminal gets its lines broken at words.
pub(crate) fn text(text: &str) -> Result<(), Failure> {
    let text = hint::addressed(text);
    match terminal_columns() {
        Some(columns) => exact(&wrapped(&text, columns)),
        None => exact(&text),
    }
}

/// The width of the terminal that standard output is.
fn terminal_columns() -> Option<usize> {
    let out = std::io::stdout();
    let columns = out.is_terminal().then(|| tcgetwinsize(&out).ok()).flatten()?.ws_col;
    (columns > 0).then_some(columns.into())
}

/// Breaks lines at words. What follows a break stands below the last column of a table, or below the line's
/// beginning.
fn wrapped(text: &str, columns: usize) -> String {
    let lines = text.lines().map(|line| wrapped_line(line, columns));
    lines.collect::<Vec<_>>().join("\n")
}

fn wrapped_line(line: &str, columns: usize) -> String {
    let begin = line.len() - line.trim_start().len();
    let last_column = line.rfind("  ").map_or(begin, |gap| gap + 2);
    let width = |text: &str| text.chars().count();
    let indent = Some(width(&line[..last_column]))
        .filter(|indent| *indent <= columns / 2)
        .unwrap_or(begin);
    let mut wrapped = String::new();
    let mut room = columns;
    let mut rest = line;
    let mut words_from = last_column.max(begin);
    while width(rest) > room {
        let end = rest.char_indices().nth(room).map_or(rest.len(), |(end, _)| end);
        // A word that is too long stays whole.
        let found = rest[words_from..].find(' ').map(|first| words_from + first);
        let Some(first) = found else { break };
        let at = match rest[..end].rfind(' ') {
            _ if rest[end..].starts_with(' ') => end,
            Some(last) => last.max(first),
            None => first,
        };
        wrapped.push_str(rest[..at].trim_end());
        wrapped.push('\n');
        wrapped.push_str(&" ".repeat(indent));
        rest = rest[at..].trim_start();
        (room, words_from) = (columns.saturating_sub(indent).max(1), 0);
    }
    wrapped.push_str(rest);
    wrapped
}

/// So many of something, whose plural has an s.
pub(crate) fn count(number: u64, what: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {what}{plural}")
}

/// Writes a value as one line of JSON.
pub(crate) fn json<T: Serialize>(value: &T) -> Result<(), Failure> {
    exact(&json_text(value)?)
}

/// The same as a text.
pub(crate) fn json_text<T: Serialize>(value: &T) -> Result<String, Failure> {
    Ok(serde_json::to_string(value).map_err(std::io::Error::other)?)
}

/// A computed number with as many digits as people read: four, or all of a whole number.
pub(crate) fn figure(value: f64) -> String {
    quantity::number(if value.abs() < 1e4 {
        quantity::rounded(value, 4)
    } else {
        value.round()
    })
}

/// A value and the half width of its interval, with two digits of that, so that it never reads as zero: what is shown
/// holds all of the interval.
pub(crate) fn within(value: f64, half_width: f64, unit: &str) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "a small power of ten")]
    let places = (1.0 - half_width.log10().floor()).clamp(0.0, 12.0) as i32;
    // The value moves by up to half of its last digit.
    let half_width = (half_width * 10_f64.powi(places) + 0.5).ceil() / 10_f64.powi(places);
    let places = usize::try_from(places).unwrap_or(0);
    format!("{value:.places$} {unit}, within {half_width:.places$} {unit}")
}

/// A time of the system's clock in a time zone, to the millisecond; `None` beyond what a calendar has.
pub(crate) fn moment(unix_s: f64, zone: &TimeZone) -> Option<Zoned> {
    #[expect(clippy::cast_possible_truncation, reason = "whole milliseconds; the cast saturates")]
    let milliseconds = (unix_s * 1e3).round() as i64;
    let moment = Timestamp::from_millisecond(milliseconds).ok()?;
    Some(moment.to_zoned(zone.clone()))
}

/// Columns, each as wide as its widest cell that has another behind it: a note at the end of a row widens no column.
pub(crate) fn table(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter()
            .filter(|row| row.len() > column + 1)
            .map(|row| &row[column])
            .map(|cell| cell.chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let lines: Vec<String> = rows
        .iter()
        .map(|row| {
            let padded: Vec<String> = row
                .iter()
                .zip(&widths)
                .map(|(cell, &width)| format!("{cell:<width$}"))
                .collect();
            padded.join("  ").trim_end().to_owned()
        })
        .collect();
    lines.join("\n")
}

/// The row of a table with these cells.
pub(crate) fn row<const N: usize>(cells: [&str; N]) -> Vec<String> {
    cells.map(str::to_owned).to_vec()
}

/// A table of names, each with its value.
pub(crate) fn named<'a>(rows: impl IntoIterator<Item = (&'a str, String)>) -> String {
    let rows = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]);
    table(&rows.collect::<Vec<_>>())
}

/// A value that may differ by direction.
pub(crate) fn directional(value: Directional) -> String {
    haptic_ipc::Value::Number(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_broken_at_words_and_go_on_below_their_last_column() {
        assert_eq!(wrapped("one two three\nfour", 9), "one two\nthree\nfour");
        assert_eq!(wrapped("by  one two three", 12), "by  one two\n    three");
        assert_eq!(wrapped("  one two three", 9), "  one two\n  three");
        assert_eq!(wrapped("a-word-of-no-end and more", 9), "a-word-of-no-end\nand more");
        assert_eq!(wrapped("\u{b5}m \u{b5}m \u{b5}m", 5), "\u{b5}m \u{b5}m\n\u{b5}m");
        assert_eq!(wrapped("", 9), "");
    }

    #[test]
    fn a_figure_has_four_digits_and_no_more() {
        for (value, text) in [
            (0.1 + 0.2, "0.3"),
            (10.099_999_999_999_998, "10.1"),
            (199_999.999_999, "200000"),
            (1.234_567e-7, "1.235e-7"),
            (12.345_678, "12.35"),
            (0.0, "0"),
            (-3.0, "-3"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn what_is_shown_of_an_interval_holds_it() {
        for (value, half_width, text) in [
            (0.020_763, 0.000_31, "0.02076 kg, within 0.00032 kg"),
            (0.020_763, 0.001_24, "0.0208 kg, within 0.0013 kg"),
            (1.4, 0.099_9, "1.400 kg, within 0.101 kg"),
            (1400.0, 120.0, "1400 kg, within 121 kg"),
            (1.0, 0.0, "1.000000000000 kg, within 0.000000000001 kg"),
        ] {
            assert_eq!(within(value, half_width, "kg"), text);
        }
    }

    #[test]
    fn columns_line_up() {
        let rows = [vec!["a".into(), "bb".into()], vec!["ccc".into(), "d".into()]];
        assert_eq!(table(&rows), "a    bb\nccc  d");
        let noted = [
            vec!["left".into(), "no daemon answers".into()],
            vec!["b".into(), "idle".into(), "0 N".into()],
        ];
        assert_eq!(table(&noted), "left  no daemon answers\nb     idle  0 N");
    }
}

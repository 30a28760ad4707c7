//! Where a file of text has its heading, its units and its numbers, and what separates the cells.

use super::columns::is_unit;
use jiff::civil::Time;
use jiff::fmt::strtime::BrokenDownTime;
use jiff::tz::Offset;

/// Lines among which the numbers begin.
const MAX_HEAD_LINES: usize = 300;

/// Further lines over which a cell in quotes may go on.
const MAX_CELL_LINES: usize = 4;

/// Rows of numbers that are a table for certain.
const SURE_ROWS: usize = 3;

/// Wanted columns that a line names which is a heading, whatever stands below it.
const MIN_WANTED: usize = 2;

/// A day, s.
const DAY_S: f64 = 86_400.0;

/// A line of a file of text that is not empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TextLine<'a> {
    /// Its number in the file, from 1.
    pub(super) number: usize,
    /// Without the mark of a remark.
    pub(super) text: &'a str,
    /// Whether it is one: a heading may stand in it, as numpy writes it, and no numbers.
    pub(super) is_remark: bool,
}

/// The lines of a text; one with a cell in quotes that goes on in the next is one with it.
pub(super) fn lines(text: &str) -> Vec<TextLine<'_>> {
    let mut rest = text.trim_start_matches('\u{feff}');
    let (mut found, mut number) = (Vec::new(), 1);
    while !rest.is_empty() {
        let (line, after) = rest.split_at(line_length(rest));
        found.push(line_of(number, line.trim()));
        number += line.matches('\n').count();
        rest = after;
    }
    found.retain(|line| !line.text.is_empty());
    found
}

/// Bytes of the first line of a text. A quote opens a cell at its start alone, and is closed within few lines.
fn line_length(text: &str) -> usize {
    let mut ends = text
        .match_indices('\n')
        .map(|(at, _)| at + 1)
        .chain(std::iter::once(text.len()));
    let first = ends.next().unwrap_or(text.len());
    let is_open = |end: usize| text[..end].matches('"').count() % 2 == 1;
    let opening = text[..first].rfind('"').filter(|_| is_open(first));
    let begins = opening.is_some_and(|at| text[..at].trim_end_matches(' ').ends_with([';', ',', '\t']) || at == 0);
    let closing = ends.take(MAX_CELL_LINES).find(|end| !is_open(*end));
    closing.filter(|_| begins).unwrap_or(first)
}

fn line_of(number: usize, text: &str) -> TextLine<'_> {
    let marked = ["#", "%", "//"].into_iter().find_map(|mark| text.strip_prefix(mark));
    TextLine {
        number,
        text: marked.map_or(text, |text| text.trim_start_matches(['#', '%']).trim()),
        is_remark: marked.is_some(),
    }
}

/// How a file of text is laid out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// What separates the cells; a space stands for any white space.
    pub(super) separator: char,
    /// The titles of the columns, or their numbers from 1.
    pub(super) titles: Vec<String>,
    /// The units, where they have a line of their own.
    pub(super) units: Vec<String>,
    /// Place of the first line of numbers in the list of lines.
    pub(super) data: usize,
}

impl Layout {
    /// Finds the numbers, and above them the line whose cells name wanted columns, or else as many titles as there are
    /// numbers. A laboratory's program may write remarks of any form above, and lines of units and kinds between.
    pub(super) fn find(lines: &[TextLine<'_>], is_wanted: &dyn Fn(&str) -> bool) -> Option<Self> {
        let found = [';', '\t', ',', ' ']
            .into_iter()
            .filter_map(|separator| Self::with(lines, separator, is_wanted));
        let wanted = |layout: &Self| {
            layout
                .titles
                .iter()
                .filter(|title| is_wanted(title))
                .count()
                .min(MIN_WANTED)
        };
        found.min_by_key(|layout| (MIN_WANTED - wanted(layout), layout.data))
    }

    fn with(lines: &[TextLine<'_>], separator: char, is_wanted: &dyn Fn(&str) -> bool) -> Option<Self> {
        let rows: Vec<Vec<&str>> = lines
            .iter()
            .take(MAX_HEAD_LINES)
            .map(|line| cells(line.text, separator))
            .collect();
        let numbers = |row: &[&str]| row.iter().filter(|cell| number(cell, separator).is_some()).count();
        let missing = |row: &[&str]| row.iter().filter(|cell| is_missing(cell)).count();
        // The numbers begin with a row of them, of which some may be missing, and go on with rows of as many cells.
        let is_data = |at: usize| {
            let (row, count) = (&rows[at], numbers(&rows[at]));
            !lines[at].is_remark && count >= 1 && count + missing(row) >= 2 && 2 * (count + missing(row)) >= row.len()
        };
        let data = (0..rows.len()).find(|&at| {
            let next = (at + 1..rows.len())
                .filter(|&other| !lines[other].is_remark)
                .take(SURE_ROWS - 1);
            is_data(at)
                && next.clone().all(|other| is_data(other) || other + 1 == rows.len())
                && numbers(&rows[at]) + next.count() >= 2
        })?;
        // A row may end with a separator that the heading lacks.
        let filled = |at: usize| rows[at].iter().rposition(|cell| !cell.is_empty());
        let is_alike = |at: &usize| rows[*at].len() == rows[data].len() || filled(*at) == filled(data);
        let whole = |cell: &&str| cell.split_whitespace().collect::<Vec<_>>().join(" ");
        let owned = |at: usize| rows[at].iter().map(whole).collect::<Vec<String>>();
        let named = |at: usize| rows[at].iter().filter(|cell| is_wanted(cell)).count();
        let above = || (0..data).rev().filter(is_alike);
        let best = above()
            .max_by_key(|&at| (named(at), at))
            .filter(|&at| named(at) >= MIN_WANTED);
        let is_units = |at: usize| rows[at].iter().all(|cell| cell.is_empty() || is_unit(cell));
        let heading = best.or_else(|| {
            let mut plain = above().filter(|&at| !lines[at].is_remark);
            let nearest = plain.next()?;
            plain.next().filter(|_| is_units(nearest)).or(Some(nearest))
        });
        let Some(heading) = heading else {
            // Remarks alone, or nothing: what is there must be a table for certain.
            let rest: Vec<usize> = (data..rows.len())
                .filter(|&at| !lines[at].is_remark)
                .take(SURE_ROWS)
                .collect();
            let is_first = lines[..data].iter().all(|line| line.is_remark);
            return (is_first && rest.len() == SURE_ROWS && rest.into_iter().all(is_data)).then(|| Self {
                separator,
                titles: (1..=rows[data].len()).map(|number| number.to_string()).collect(),
                units: Vec::new(),
                data,
            });
        };
        // Units that nobody knows stand beside one that is known.
        let units = (heading + 1..data)
            .filter(is_alike)
            .find(|&at| numbers(&rows[at]) == 0 && rows[at].iter().any(|cell| is_unit(cell)));
        Some(Self {
            separator,
            titles: owned(heading),
            units: units.map_or_else(Vec::new, owned),
            data,
        })
    }
}

/// Whether a cell stands for a number that is missing.
fn is_missing(cell: &str) -> bool {
    const WORDS: [&str; 6] = ["nan", "na", "n/a", "null", "none", "-"];
    cell.is_empty() || WORDS.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

/// The cells of a line. Blanks may stand around quotes, which the crate csv takes for a part of the cell.
pub(super) fn cells(line: &str, separator: char) -> Vec<&str> {
    if separator == ' ' {
        return line.split_whitespace().map(|cell| cell.trim_matches('"')).collect();
    }
    let mut is_quoted = false;
    line.split(|letter: char| {
        is_quoted ^= letter == '"';
        letter == separator && !is_quoted
    })
    .map(|cell| cell.trim().trim_matches('"').trim())
    .collect()
}

/// A finite number, or a time of day in seconds. Where commas do not separate cells, and in quotes, a comma is a
/// decimal point.
pub(super) fn number(cell: &str, separator: char) -> Option<f64> {
    let parsed = match cell.parse::<f64>() {
        Ok(value) => Some(value),
        Err(_) if cell.contains(':') => time_of_day_s(cell),
        Err(_) if separator == ',' && !cell.contains(',') => None,
        Err(_) => cell.replacen(',', ".", 1).parse().ok(),
    };
    parsed.filter(|value| value.is_finite())
}

/// Seconds since midnight of a time of day, in Greenwich where it says how far it is from there; a date may stand
/// before it.
fn time_of_day_s(cell: &str) -> Option<f64> {
    const FORMATS: [&str; 6] = [
        "%H:%M:%S%.f",
        "%H:%M",
        "%I:%M:%S%.f %p",
        "%I:%M %p",
        "%H:%M:%S%.f%:z",
        "%H:%M:%S%.f%z",
    ];
    let hours = cell[..cell.find(':')?].trim_end_matches(|letter: char| letter.is_ascii_digit());
    let is_date = hours.is_empty() || hours.contains(|letter: char| letter.is_ascii_digit());
    let time = cell[hours.len()..].trim_end_matches('Z').replacen(',', ".", 1);
    let parse = |format: &&str| BrokenDownTime::parse(format, &time).ok();
    let parsed = FORMATS.iter().find_map(parse).filter(|_| is_date)?;
    let of_day = parsed.to_time().ok()?.duration_since(Time::midnight());
    let ahead_s = parsed.offset().map_or(0, Offset::seconds);
    Some(of_day.as_secs_f64() - f64::from(ahead_s))
}

/// A time of day after the one before, s: behind midnight a day is added.
pub(super) fn on_the_same_day(t_s: f64, before_s: f64) -> f64 {
    if t_s < before_s - 0.5 * DAY_S {
        t_s + DAY_S * ((before_s - t_s) / DAY_S).round()
    } else {
        t_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(text: &str) -> Option<(char, String, String, usize)> {
        let lines = lines(text);
        let is_wanted = |title: &str| ["t", "time", "x", "position", "f", "force", "f\r\n(N)"].contains(&title);
        let layout = Layout::find(&lines, &is_wanted)?;
        let (titles, units) = (layout.titles.join(" "), layout.units.join(" "));
        Some((layout.separator, titles, units, lines[layout.data].number))
    }

    #[test]
    fn remarks_units_and_separators_of_other_programs_are_seen() {
        let kinds = "time,position,force,temp\ns,mm,N,degC\nSmp,Smp,Avg,Avg\n0,1,2,3\n1,1,2,3\n";
        let date = "Sample A of lab C\nStarted at: 12:24:01.209 12 May 2022\n\nt,x,f\n0,1,2\n1,1,2\n2,1,2\n";
        let in_two_lines = "\"t\",\"x\",\"f\r\n(N)\"\r\n0,1,2\r\n1,1,2\r\n";
        for (text, separator, titles, units, data) in [
            ("t,x,f\n0,1,2", ',', "t x f", "", 2),
            ("Probe 7, rate 1000\nt;x;f\ns;mm;N\n0;1,5;2", ';', "t x f", "s mm N", 4),
            ("t x f\n0,1 0,2 0,3", ' ', "t x f", "", 2),
            ("t,x,f\n\"0,1\",\"0,2\",\"0,3\"", ',', "t x f", "", 2),
            ("t,x,f\n0,1,2,\n", ',', "t x f", "", 2),
            ("0,1,2\n1,1,2\n2,1,2", ',', "1 2 3", "", 1),
            // A heading in a remark, kinds below the units, a unit that nobody knows, and a date above.
            ("# t,x,f\n0,1,2\n1,1,2\n", ',', "t x f", "", 2),
            (kinds, ',', "time position force temp", "s mm N degC", 4),
            (date, ',', "t x f", "", 5),
            ("t,x,f\n0,NaN,NaN\n1,1,2\n2,1,2\n", ',', "t x f", "", 2),
            // A title over two lines, and a quote that opens none.
            (in_two_lines, ',', "t x f (N)", "", 3),
            ("disk of 5\"\nt,x,f\n0,1,2\n1,1,2\n", ',', "t x f", "", 3),
        ] {
            let seen = (separator, titles.to_owned(), units.to_owned(), data);
            assert_eq!(found(text), Some(seen), "{text}");
        }
        assert_eq!(found("0,1,2\n0,1,2"), None);
        assert_eq!(number("\u{2212}1", ','), None);
        assert_eq!(number("0,25", ';'), Some(0.25));
    }

    #[test]
    fn a_time_of_day_is_seconds_and_goes_on_behind_midnight() {
        assert_eq!(number("2024-05-01 23:59:59,5", ';'), Some(86_399.5));
        assert_eq!(number("2024-05-01T00:00:00.25Z", ','), Some(0.25));
        assert_eq!(number("12:61:00:1", ','), None);
        assert_eq!(number("11/27/2026 12:00:01.5 AM", ','), Some(1.5));
        assert_eq!(number("1:00:00 PM", ','), Some(46_800.0));
        assert_eq!(number("2026-11-27T01:00:00.5+01:00", ','), Some(0.5));
        assert_eq!(number("2026-11-27 01:00:00-0100", ','), Some(7200.0));
        assert_eq!(number("Started at: 12:24:01.209", ','), None);
        assert_eq!(cells("\"a; b\"; \"0,5\" ;", ';'), ["a; b", "0,5", ""]);
        assert_eq!(on_the_same_day(0.25, 86_399.5), 86_400.25);
        assert_eq!(on_the_same_day(5.0, 4.0), 5.0);
    }
}

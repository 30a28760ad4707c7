//! Where a file of text has its heading, its units and its numbers, and what separates the cells.

use super::columns::is_unit;

/// Lines among which the numbers begin.
const MOST_HEAD_LINES: usize = 300;

/// Rows of numbers that are a table without a heading.
const SURE_ROWS: usize = 3;

/// A day, s.
const DAY_S: f64 = 86_400.0;

/// How a file of text is laid out. Places are those in the list of lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    /// What separates the cells; a space stands for any white space.
    pub(super) separator: char,
    /// The line of the titles; without one the columns are named by their numbers, from 1.
    pub(super) heading: Option<usize>,
    /// The line of the units, where they have one of their own.
    pub(super) units: Option<usize>,
    /// The first line of numbers.
    pub(super) data: usize,
}

impl Layout {
    /// The first line of numbers below a line of as many titles. A laboratory's program may write remarks above.
    pub(super) fn find(lines: &[&str]) -> Option<Self> {
        [';', '\t', ',', ' ']
            .into_iter()
            .filter_map(|separator| Self::with(lines, separator))
            .min_by_key(|layout| layout.data)
    }

    fn with(lines: &[&str], separator: char) -> Option<Self> {
        let rows: Vec<Vec<&str>> = lines
            .iter()
            .take(MOST_HEAD_LINES)
            .map(|line| cells(line, separator))
            .collect();
        let is_data = |row: &Vec<&str>| {
            let numbers = row.iter().filter(|cell| number(cell, separator).is_some()).count();
            numbers >= 2 && 2 * numbers >= row.len()
        };
        let data = rows.iter().position(is_data)?;
        // A row may end with a separator that the heading lacks.
        let filled = |at: usize| rows[at].iter().rposition(|cell| !cell.is_empty());
        let is_alike = |at: usize| rows[at].len() == rows[data].len() || filled(at) == filled(data);
        let mut above = (0..data).rev().filter(|&at| is_alike(at));
        let Some(nearest) = above.next() else {
            // Remarks alone, or nothing: what is there must be a table for certain.
            let is_table = rows[data..].iter().take(SURE_ROWS).all(is_data);
            return (data == 0 && is_table && rows.len() >= SURE_ROWS).then_some(Self {
                separator,
                heading: None,
                units: None,
                data,
            });
        };
        let is_units = rows[nearest].iter().all(|cell| cell.is_empty() || is_unit(cell));
        match above.next().filter(|_| is_units) {
            Some(heading) => Some(Self {
                separator,
                heading: Some(heading),
                units: Some(nearest),
                data,
            }),
            None => Some(Self {
                separator,
                heading: Some(nearest),
                units: None,
                data,
            }),
        }
    }
}

/// The cells of a line.
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

/// Seconds since midnight of `12:34:56.789`, with a date before it or without one.
fn time_of_day_s(cell: &str) -> Option<f64> {
    let time = cell.rsplit(['T', ' ']).next()?.trim_end_matches('Z');
    let mut parts = time
        .split(':')
        .map(|part| part.replacen(',', ".", 1).parse::<f64>().ok());
    let (hours, minutes) = (parts.next()??, parts.next()??);
    let seconds = parts.next().map_or(Some(0.0), |part| part)?;
    let time_s = 3600.0 * hours + 60.0 * minutes + seconds;
    (parts.next().is_none() && (0.0..=DAY_S).contains(&time_s)).then_some(time_s)
}

/// A time of day after the one before, s: behind midnight a day is added.
pub(super) fn on_the_same_day(t_s: f64, before_s: f64) -> f64 {
    if t_s < before_s - 0.5 * DAY_S {
        t_s + DAY_S * ((before_s - t_s) / DAY_S).round()
    } else {
        t_s
    }
}

/// Rounded times as even ones, with the step that they were rounded to; `None` where they are not rounded, or not even.
///
/// A clock that is written with few digits repeats times, or steps by two different ones. Positions at wrong times are
/// positions with noise.
pub(super) fn evened(t_s: &[f64]) -> Option<(Vec<f64>, f64)> {
    /// Fewest times that show a pattern.
    const FEWEST: usize = 64;
    /// Steps are alike to this share of the rounding.
    const ALIKE: f64 = 0.01;
    if t_s.len() < FEWEST {
        return None;
    }
    let (first, last) = (t_s[0], t_s[t_s.len() - 1]);
    let period_s = (last - first) / (t_s.len() - 1) as f64;
    let steps = || t_s.windows(2).map(|pair| pair[1] - pair[0]);
    let (least, most) = steps().fold((f64::MAX, f64::MIN), |(least, most), step| {
        (least.min(step), most.max(step))
    });
    let rounding = most - least;
    // Rounded to less than the period, times step by two neighbouring multiples; to more, some repeat. Else rows are
    // missing.
    let is_rounding = rounding <= (1.0 + ALIKE) * period_s || least <= ALIKE * period_s;
    let is_either = steps().all(|step| (step - least).min(most - step) <= ALIKE * rounding);
    let even: Vec<f64> = (0..t_s.len()).map(|at| first + at as f64 * period_s).collect();
    let is_near = t_s
        .iter()
        .zip(&even)
        .all(|(t, even)| (t - even).abs() <= (1.0 + ALIKE) * rounding);
    (is_rounding && is_either && is_near && rounding > 0.02 * period_s).then_some((even, rounding))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remarks_units_and_separators_of_other_programs_are_seen() {
        let found = |text: &str| {
            let lines: Vec<&str> = text.lines().collect();
            Layout::find(&lines).map(|layout| (layout.separator, layout.heading, layout.units, layout.data))
        };
        assert_eq!(found("t,x,f\n0,1,2"), Some((',', Some(0), None, 1)));
        assert_eq!(
            found("Probe 7, rate 1000\nt;x;f\ns;mm;N\n0;1,5;2"),
            Some((';', Some(1), Some(2), 3))
        );
        assert_eq!(found("t x f\n0,1 0,2 0,3"), Some((' ', Some(0), None, 1)));
        assert_eq!(found("t,x,f\n\"0,1\",\"0,2\",\"0,3\""), Some((',', Some(0), None, 1)));
        assert_eq!(found("t,x,f\n0,1,2,\n"), Some((',', Some(0), None, 1)));
        assert_eq!(found("0,1,2\n1,1,2\n2,1,2"), Some((',', None, None, 0)));
        assert_eq!(found("0,1,2\n0,1,2"), None);
        assert_eq!(number("\u{2212}1", ','), None);
        assert_eq!(number("0,25", ';'), Some(0.25));
    }

    #[test]
    fn a_time_of_day_is_seconds_and_goes_on_behind_midnight() {
        assert_eq!(number("2024-05-01 23:59:59,5", ';'), Some(86_399.5));
        assert_eq!(number("2024-05-01T00:00:00.25Z", ','), Some(0.25));
        assert_eq!(number("12:61:00:1", ','), None);
        assert_eq!(on_the_same_day(0.25, 86_399.5), 86_400.25);
        assert_eq!(on_the_same_day(5.0, 4.0), 5.0);
    }

    #[test]
    fn rounded_times_are_made_even_and_uneven_ones_are_not() {
        let rounded: Vec<f64> = (0..300).map(|k| (f64::from(k) / 3.0).round() * 1e-3).collect();
        let (even, rounding) = evened(&rounded).expect("they are rounded");
        assert!((rounding - 1e-3).abs() < 1e-9 && (even[150] - 0.05).abs() < 1e-3);
        let exact: Vec<f64> = (0..300).map(|k| f64::from(k) * 1e-3).collect();
        assert_eq!(evened(&exact), None);
        let mut gap = rounded;
        gap.iter_mut().skip(100).for_each(|t| *t += 0.05);
        assert_eq!(evened(&gap), None);
        // One long gap and some short ones: no step is far from either the least or the longest.
        let missing = |k: &u32| !k.is_multiple_of(37) && !(5000..5400).contains(k);
        let dropped: Vec<f64> = (0..21_000).filter(missing).map(|k| f64::from(k) * 1e-3).collect();
        assert_eq!(evened(&dropped), None);
    }
}

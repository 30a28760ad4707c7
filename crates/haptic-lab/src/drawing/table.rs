//! Tables as text of other programs: CSV, Markdown, LaTeX.

use std::collections::BTreeSet;
use std::fmt::Write as _;

/// A table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Its rows; the first one names the columns.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// The rows as CSV.
    #[must_use]
    pub fn csv(&self) -> Vec<u8> {
        let mut csv = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
        for row in &self.rows {
            // Memory takes whatever is written to it.
            csv.write_record(row).unwrap_or(());
        }
        csv.into_inner().unwrap_or_default()
    }

    /// The table as Markdown, below its caption. All columns but the first stand at the right.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut text = format!("{}\n\n", escaped(&self.caption, markdown_letter));
        for (index, row) in self.rows.iter().enumerate() {
            let cells: Vec<String> = row.iter().map(|cell| escaped(cell, markdown_letter)).collect();
            // A string takes whatever is written to it.
            writeln!(text, "| {} |", cells.join(" | ")).unwrap_or(());
            if index == 0 {
                writeln!(text, "|:--{}|", "|--:".repeat(row.len().saturating_sub(1))).unwrap_or(());
            }
        }
        text
    }

    /// The table as a float of LaTeX, which needs no package. `name` follows `tab:` in its label. It fits the text of
    /// an article of 10 pt: a wider one is in smaller letters, its columns below one another where that is not enough,
    /// and one that is longer than a page has more floats of the same number. A heading of a quantity and its unit has
    /// the unit in parentheses. The notes stand below.
    #[must_use]
    pub fn latex(&self, name: &str, notes: &[String]) -> String {
        let mut rows = self.rows.iter();
        let head = rows.next().into_iter().flatten();
        let head: Vec<String> = head.map(|cell| latex_text(&with_unit(cell))).collect();
        let body: Vec<Vec<String>> = rows
            .map(|row| row.iter().map(|cell| latex_text(cell)).collect())
            .collect();
        let size = self.latex_size();
        let blocks = self.latex_blocks(size);
        // A table of nothing but its heading is one too.
        let parts = if body.is_empty() {
            vec![&body[..]]
        } else {
            body.chunks(MAX_LATEX_ROWS.div_ceil(blocks.len())).collect()
        };
        let caption = latex_text(&self.caption);
        let notes: Vec<String> = notes
            .iter()
            .map(|note| match note.strip_prefix("-: ") {
                Some(of_dashes) => format!("--: {}", latex_text(of_dashes)),
                None => latex_text(note),
            })
            .collect();
        let notes = match notes.is_empty() {
            true => String::new(),
            false => format!(
                "\\begin{{flushleft}}\\footnotesize\n{}\n\\end{{flushleft}}\n",
                notes.join("\\\\\n")
            ),
        };
        let mut text = String::new();
        for (part, rows) in parts.into_iter().enumerate() {
            let heading = match part {
                0 => format!("\\caption{{{caption}}}\n\\label{{tab:{name}}}"),
                _ => format!("\\addtocounter{{table}}{{-1}}\n\\caption{{{caption} (continued)}}"),
            };
            let tabulars: Vec<String> = blocks.iter().map(|columns| tabular(&head, rows, columns)).collect();
            let (letters, tabulars) = (size.command, tabulars.join("\n\\medskip\n\n"));
            text.push_str(&format!(
                "\\begin{{table}}\n\\centering\n{CAPTION_ABOVE}{heading}\n{letters}{tabulars}{notes}\\end{{table}}\n"
            ));
        }
        text
    }

    /// Letters of the widest cell of each column.
    fn letters(&self) -> Vec<usize> {
        let columns = self.rows.first().map_or(1, Vec::len);
        let cells = |column: usize| self.rows.iter().filter_map(move |row| row.get(column));
        let of = |column| cells(column).map(|cell| cell.chars().count()).max().unwrap_or(0);
        (0..columns).map(of).collect()
    }

    /// The largest letters with which all columns stand beside one another; else the smallest.
    fn latex_size(&self) -> LatexSize {
        let letters = self.letters();
        let fits = |size: &LatexSize| letters.iter().map(|count| size.column_pt(*count)).sum::<f64>() <= LATEX_TEXT_PT;
        LATEX_SIZES.into_iter().find(fits).unwrap_or(LATEX_SIZES[2])
    }

    /// How many of the first columns tell the rows apart; one where all columns do not.
    fn keys(&self) -> usize {
        let body = || self.rows.iter().skip(1);
        let are_distinct = |count: &usize| {
            let mut seen = BTreeSet::new();
            body().all(|row| seen.insert(row.get(..*count)))
        };
        let columns = self.rows.first().map_or(1, Vec::len);
        (1..columns).find(are_distinct).unwrap_or(1)
    }

    /// The columns as they fit beside one another, in each block behind those that tell its rows apart.
    fn latex_blocks(&self, size: LatexSize) -> Vec<Vec<usize>> {
        let widths: Vec<f64> = self.letters().into_iter().map(|count| size.column_pt(count)).collect();
        let keys: Vec<usize> = (0..self.keys()).collect();
        let keys_pt: f64 = widths.iter().take(keys.len()).sum();
        let (mut blocks, mut used_pt) = (vec![keys.clone()], keys_pt);
        for (column, width_pt) in widths.iter().enumerate().skip(keys.len()) {
            if used_pt + width_pt > LATEX_TEXT_PT && used_pt > keys_pt {
                blocks.push(keys.clone());
                used_pt = keys_pt;
            }
            if let Some(block) = blocks.last_mut() {
                block.push(column);
            }
            used_pt += width_pt;
        }
        blocks
    }
}

/// An article has its room above a caption, for one that stands below.
const CAPTION_ABOVE: &str = "\\setlength{\\abovecaptionskip}{0pt}\\setlength{\\belowcaptionskip}{6pt}\n";

/// Units of the headings.
const UNITS: [&str; 6] = ["N", "s", "mm", "bit", "bit/s", "s/bit"];

/// A heading of a quantity and its unit, the unit in parentheses.
fn with_unit(heading: &str) -> String {
    match heading.split_once(' ') {
        Some((quantity, unit)) if UNITS.contains(&unit) => format!("{quantity} ({unit})"),
        _ => heading.to_owned(),
    }
}

/// Width of the text of an article of 10 pt, pt.
const LATEX_TEXT_PT: f64 = 345.0;
/// Most rows of a float: fewer than fill that page.
const MAX_LATEX_ROWS: usize = 40;

/// Letters of LaTeX.
#[derive(Clone, Copy)]
struct LatexSize {
    /// What chooses them.
    command: &'static str,
    /// Width of a digit of Computer Modern, pt; other letters have it on average.
    letter_pt: f64,
    /// Room to either side of a column, pt.
    beside_pt: f64,
}

impl LatexSize {
    fn column_pt(&self, letters: usize) -> f64 {
        letters as f64 * self.letter_pt + 2.0 * self.beside_pt
    }
}

const LATEX_SIZES: [LatexSize; 3] = [
    LatexSize {
        command: "",
        letter_pt: 5.0,
        beside_pt: 6.0,
    },
    LatexSize {
        command: "\\small\\setlength{\\tabcolsep}{4pt}\n",
        letter_pt: 4.63,
        beside_pt: 4.0,
    },
    LatexSize {
        command: "\\footnotesize\\setlength{\\tabcolsep}{3pt}\n",
        letter_pt: 4.25,
        beside_pt: 3.0,
    },
];

/// Some columns of a table, the first at the left.
fn tabular(head: &[String], rows: &[Vec<String>], columns: &[usize]) -> String {
    let line = |row: &[String]| {
        let cells = columns.iter().filter_map(|column| row.get(*column).map(String::as_str));
        format!("{} \\\\\n", cells.collect::<Vec<_>>().join(" & "))
    };
    let body: String = rows.iter().map(|row| line(row)).collect();
    format!(
        "\\begin{{tabular}}{{l{}}}\n\\hline\n{}\\hline\n{body}\\hline\n\\end{{tabular}}\n",
        "r".repeat(columns.len().saturating_sub(1)),
        line(head)
    )
}

/// A text for LaTeX: a hyphen before a number is a minus, and one alone a dash.
fn latex_text(text: &str) -> String {
    match text {
        "-" => return "--".to_owned(),
        "r2" => return "$r^2$".to_owned(),
        _ => {}
    }
    let mut shown = String::with_capacity(text.len());
    let mut before = None;
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        let is_minus = letter == '-'
            && letters.peek().is_some_and(char::is_ascii_digit)
            && !before.is_some_and(char::is_alphanumeric);
        match latex_letter(letter) {
            _ if is_minus => shown.push_str("$-$"),
            Some(escaped) => shown.push_str(escaped),
            None => shown.push(letter),
        }
        before = Some(letter);
    }
    shown
}

/// A text with each letter that has a meaning replaced by what shows it.
fn escaped(text: &str, shown: fn(char) -> Option<&'static str>) -> String {
    let mut escaped = String::with_capacity(text.len());
    for letter in text.chars() {
        match shown(letter) {
            Some(shown) => escaped.push_str(shown),
            None => escaped.push(letter),
        }
    }
    escaped
}

const fn markdown_letter(letter: char) -> Option<&'static str> {
    Some(match letter {
        '\\' => r"\\",
        '|' => r"\|",
        '*' => r"\*",
        '_' => r"\_",
        '`' => r"\`",
        '<' => r"\<",
        '[' => r"\[",
        '\n' => " ",
        _ => return None,
    })
}

const fn latex_letter(letter: char) -> Option<&'static str> {
    Some(match letter {
        '\\' => r"\textbackslash{}",
        '&' => r"\&",
        '%' => r"\%",
        '$' => r"\$",
        '#' => r"\#",
        '_' => r"\_",
        '{' => r"\{",
        '}' => r"\}",
        '~' => r"\textasciitilde{}",
        '^' => r"\textasciicircum{}",
        '<' => r"\textless{}",
        '>' => r"\textgreater{}",
        '|' => r"\textbar{}",
        // Not read as an option of the line break before it.
        '[' => "{[}",
        '*' => "{*}",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of these rows.
    fn of(rows: &[&[&str]]) -> Table {
        let row = |row: &&[&str]| row.iter().map(|cell| (*cell).to_owned()).collect();
        Table {
            caption: "c".to_owned(),
            rows: rows.iter().map(row).collect(),
        }
    }

    #[test]
    fn a_table_is_csv_whatever_its_cells_hold() {
        let table = of(&[&["name", "N"], &["a, \"b\"", "1.5"]]);
        assert_eq!(table.csv(), b"name,N\n\"a, \"\"b\"\"\",1.5\n");
    }

    #[test]
    fn latex_has_minus_signs_and_units_in_parentheses() {
        let numbers: &[&[&str]] = &[&["a-b", "x"], &["-", "-0.5 to -0.1"], &["P-1", "1e-5"]];
        let heads: &[&[&str]] = &[&["case", "JND N", "JND 95 %", "b s/bit", "r2", "drag 2 N"]];
        for (rows, line) in [
            (numbers, r"a-b & x \\"),
            (numbers, r"-- & $-$0.5 to $-$0.1 \\"),
            (numbers, r"P-1 & 1e-5 \\"),
            (heads, r"case & JND (N) & JND 95 \% & b (s/bit) & $r^2$ & drag 2 N \\"),
        ] {
            let latex = of(rows).latex("t", &[]);
            assert!(latex.contains(line), "{line} in {latex}");
        }
    }

    #[test]
    fn a_wide_latex_table_has_smaller_letters_and_then_blocks() {
        let columns = |count: usize| of(&[&["0123456789"; 30][..count]]).latex("t", &[]);
        assert!(!columns(5).contains("small"));
        assert!(columns(6).contains(r"\small"));
        assert!(columns(7).contains(r"\footnotesize"));
        // The first column stands in each of three blocks.
        let wide = columns(16);
        assert_eq!(wide.matches(r"\begin{tabular}{lrrrrrr}").count(), 2, "{wide}");
        assert_eq!(wide.matches(r"\begin{tabular}{lrrr}").count(), 1, "{wide}");
        assert_eq!(wide.matches(r"\caption").count(), 1);
    }

    #[test]
    fn each_block_of_a_latex_table_tells_its_rows_apart() {
        let wide = "012345678901234567890123456789";
        let rows: &[&[&str]] = &[
            &["measure", "one", "other", wide, wide, "p"],
            &["time", "real", "viscous", "1", "2", "0.5"],
            &["time", "real", "drag", "3", "0", "0.7"],
        ];
        let latex = of(rows).latex("pairs", &[]);
        let second = format!("\nmeasure & one & other & {wide} & p ");
        assert!(latex.contains(&second), "{latex}");
        assert!(latex.contains("time & real & drag & 0 & 0.7"), "{latex}");
    }

    #[test]
    fn a_long_latex_table_is_numbered_once() {
        let rows = [&["a", "b"][..]; 101];
        let latex = of(&rows).latex("t", &[]);
        assert_eq!(latex.matches(r"\begin{table}").count(), 3);
        assert_eq!(
            latex
                .matches("\\addtocounter{table}{-1}\n\\caption{c (continued)}")
                .count(),
            2
        );
        assert_eq!(latex.matches(r"\label{tab:t}").count(), 1);
        // Each float has its heading.
        assert_eq!(latex.matches("a & b").count(), 101 + 2);
    }

    #[test]
    fn markdown_and_latex_show_every_letter_as_it_is() {
        let table = Table {
            caption: "95 % of all".to_owned(),
            ..of(&[&["name", "p"], &["a|b_c & {d}", "<0.001*"]])
        };
        assert_eq!(
            table.markdown(),
            "95 % of all\n\n| name | p |\n|:--|--:|\n| a\\|b\\_c & {d} | \\<0.001\\* |\n"
        );
        let latex = table.latex("pairs", &["-: too few".to_owned(), "b".to_owned()]);
        assert_eq!(
            latex.lines().collect::<Vec<_>>(),
            [
                r"\begin{table}",
                r"\centering",
                r"\setlength{\abovecaptionskip}{0pt}\setlength{\belowcaptionskip}{6pt}",
                r"\caption{95 \% of all}",
                r"\label{tab:pairs}",
                r"\begin{tabular}{lr}",
                r"\hline",
                r"name & p \\",
                r"\hline",
                r"a\textbar{}b\_c \& \{d\} & \textless{}0.001{*} \\",
                r"\hline",
                r"\end{tabular}",
                r"\begin{flushleft}\footnotesize",
                r"--: too few\\",
                r"b",
                r"\end{flushleft}",
                r"\end{table}",
            ]
        );
    }
}

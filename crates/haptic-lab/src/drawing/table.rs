//! Tables as text of other programs: CSV, Markdown, LaTeX.

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

    /// The table as a float of LaTeX, which needs no package. `name` follows `tab:` in its label.
    #[must_use]
    pub fn latex(&self, name: &str) -> String {
        let mut rows = self.rows.iter().map(|row| {
            let cells: Vec<String> = row.iter().map(|cell| escaped(cell, latex_letter)).collect();
            format!("{} \\\\\n", cells.join(" & "))
        });
        let columns = self.rows.first().map_or(1, Vec::len);
        let head = rows.next().unwrap_or_default();
        format!(
            "\\begin{{table}}\n\\centering\n\\caption{{{}}}\n\\label{{tab:{name}}}\n\\begin{{tabular}}{{l{}}}\n\\hline\n{head}\\hline\n\
             {}\\hline\n\\end{{tabular}}\n\\end{{table}}\n",
            escaped(&self.caption, latex_letter),
            "r".repeat(columns.saturating_sub(1)),
            rows.collect::<String>()
        )
    }
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

    #[test]
    fn a_table_is_csv_whatever_its_cells_hold() {
        let table = Table {
            caption: "Levels".to_owned(),
            rows: [["name", "N"], ["a, \"b\"", "1.5"]]
                .map(|row| row.map(str::to_owned).to_vec())
                .to_vec(),
        };
        assert_eq!(table.csv(), b"name,N\n\"a, \"\"b\"\"\",1.5\n");
    }

    #[test]
    fn markdown_and_latex_show_every_letter_as_it_is() {
        let table = Table {
            caption: "95 % of all".to_owned(),
            rows: [["name", "p"], ["a|b_c & {d}", "<0.001*"]]
                .map(|row| row.map(str::to_owned).to_vec())
                .to_vec(),
        };
        assert_eq!(
            table.markdown(),
            "95 % of all\n\n| name | p |\n|:--|--:|\n| a\\|b\\_c & {d} | \\<0.001\\* |\n"
        );
        let latex = table.latex("pairs");
        assert_eq!(
            latex.lines().collect::<Vec<_>>(),
            [
                r"\begin{table}",
                r"\centering",
                r"\caption{95 \% of all}",
                r"\label{tab:pairs}",
                r"\begin{tabular}{lr}",
                r"\hline",
                r"name & p \\",
                r"\hline",
                r"a\textbar{}b\_c \& \{d\} & \textless{}0.001{*} \\",
                r"\hline",
                r"\end{tabular}",
                r"\end{table}",
            ]
        );
    }
}

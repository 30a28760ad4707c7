//! A page of HTML around charts and tables, and the file that a plot goes to.

use super::svg::{escaped, inline, style, svg};
use super::{Chart, Table};
use std::fmt::Write as _;
use std::io;
use std::path::Path;
use thiserror::Error;

const PAGE_STYLE: &str = "\
:root{color-scheme:light dark;--ground:#fff;--ink:#1b1b1b;--faint:#d5d5d5}\
@media (prefers-color-scheme:dark){:root{--ground:#16181b;--ink:#e6e6e6;--faint:#3a3d42}}\
body{background:var(--ground);color:var(--ink);font:15px system-ui,sans-serif;max-width:60rem;margin:2rem \
auto;padding:0 1rem}\
svg{width:100%;height:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin-bottom:1.5rem}\
caption{text-align:left;font-weight:bold;padding:.3rem 0}td,th{padding:.15rem .7rem;border-bottom:1px solid \
var(--faint);text-align:right}\
td:first-child,th:first-child{text-align:left}";

/// A page: words, charts and tables in this order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Title.
    pub title: String,
    /// Paragraphs.
    pub paragraphs: Vec<String>,
    /// Charts.
    pub charts: Vec<Chart>,
    /// Tables.
    pub tables: Vec<Table>,
}

impl Page {
    /// The page as HTML. It stands alone: it loads nothing and runs nothing.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
             content=\"width=device-width\">\
             <title>{title}</title><style>{PAGE_STYLE}{}</style></head><body>\n<h1>{title}</h1>\n",
            style(&self.charts, true)
        );
        for paragraph in &self.paragraphs {
            // A string takes whatever is written to it.
            writeln!(page, "<p>{}</p>", escaped(paragraph)).unwrap_or(());
        }
        for chart in &self.charts {
            page.push_str(&inline(chart));
        }
        for table in &self.tables {
            writeln!(page, "<table><caption>{}</caption>", escaped(&table.caption)).unwrap_or(());
            for (index, row) in table.rows.iter().enumerate() {
                let cell = if index == 0 { "th" } else { "td" };
                let cells: String = row
                    .iter()
                    .map(|text| format!("<{cell}>{}</{cell}>", escaped(text)))
                    .collect();
                writeln!(page, "<tr>{cells}</tr>").unwrap_or(());
            }
            page.push_str("</table>\n");
        }
        page.push_str("</body></html>\n");
        page
    }

    /// Writes the page, or its charts alone, into a file.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path, format: PlotFormat) -> io::Result<()> {
        let text = match format {
            PlotFormat::Svg => svg(&self.charts),
            PlotFormat::Html => self.html(),
        };
        std::fs::write(path, text)
    }
}

/// What a plot is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlotFormat {
    /// An image: the charts alone.
    Svg,
    /// A page with the charts and the tables.
    Html,
}

/// The file's ending says nothing of its format.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{name}: a plot is written to a file that ends in .svg or .html")]
pub struct UnknownEnding {
    name: String,
}

impl PlotFormat {
    /// The format of a file, by its ending.
    ///
    /// # Errors
    /// It has another one.
    pub fn of(path: &Path) -> Result<Self, UnknownEnding> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("html" | "htm") => Ok(Self::Html),
            _ => Err(UnknownEnding {
                name: path.display().to_string(),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::Trace;

    #[test]
    fn a_page_stands_alone_with_its_charts_and_tables() {
        let page = Page {
            title: "A & B".to_owned(),
            paragraphs: vec!["Fs > Fd".to_owned()],
            charts: vec![Chart::new("Force", "Time (s)", "Force (N)").with(Trace::line("a", vec![[0.0, 1.0]]))],
            tables: vec![Table {
                caption: "Levels".to_owned(),
                rows: vec![vec!["direction".to_owned()], vec!["positive".to_owned()]],
            }],
        };
        let html = page.html();
        for part in [
            "A &amp; B",
            "Fs &gt; Fd",
            "<svg viewBox",
            "<th>direction</th>",
            "<td>positive</td>",
        ] {
            assert!(html.contains(part), "{part}");
        }
        for foreign in ["<script", "http", "<link", "url("] {
            assert!(!html.contains(foreign), "{foreign}");
        }
    }

    #[test]
    fn plot_format_follows_the_file_extension() {
        assert_eq!(PlotFormat::of(Path::new("a/b.SVG")), Ok(PlotFormat::Svg));
        assert_eq!(PlotFormat::of(Path::new("b.html")), Ok(PlotFormat::Html));
        for other in ["b.png", "b", "svg"] {
            let refused = PlotFormat::of(Path::new(other)).expect_err(other).to_string();
            assert!(
                refused.starts_with(other) && refused.contains(".svg or .html"),
                "{refused}"
            );
        }
    }
}

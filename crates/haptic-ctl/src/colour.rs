//! Colour, where there is somebody to see it: on a terminal, unless NO_COLOR is set
//! (<https://no-color.org>).

use clap::builder::styling::{AnsiColor, Style};
use std::io::IsTerminal;

pub(crate) const GOOD: Style = AnsiColor::Green.on_default();
pub(crate) const DOUBTFUL: Style = AnsiColor::Yellow.on_default();
pub(crate) const BAD: Style = AnsiColor::Red.on_default().bold();

/// Whether colour was forbidden.
pub(crate) fn is_forbidden() -> bool {
    std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty())
}

/// The text in a style, where standard output shows it.
pub(crate) fn paint(text: &str, style: Style) -> String {
    if is_forbidden() || !std::io::stdout().is_terminal() {
        return text.to_owned();
    }
    format!("{style}{text}{style:#}")
}

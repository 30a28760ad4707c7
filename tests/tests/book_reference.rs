//! The reference pages are drawn from the programs: their help, what they serve, and what the core knows.
//! `HAPTICD_UPDATE_BOOK=1 cargo test -p system-tests --test system book_reference::` draws them again.

use haptic_core::friction::{Friction, LAWS};
use haptic_core::parameters::TABLE;
use haptic_core::servo::Fault;
use std::collections::HashMap;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use system_tests::fake_rig::FakeRig;
use system_tests::{Daemon, binary, drawn, plain, until_some};

fn add(page: &mut String, line: &str) {
    page.push_str(line);
    page.push('\n');
}

/// A table, with the names of its columns.
fn table<const N: usize>(head: [&str; N], rows: impl IntoIterator<Item = [String; N]>) -> String {
    let mut table = format!("| {} |\n{}|\n", head.join(" | "), "|---".repeat(N));
    for row in rows {
        add(
            &mut table,
            &format!("| {} |", row.map(|cell| cell.replace('|', "\\|")).join(" | ")),
        );
    }
    table
}

/// What a program of the workspace prints for `--help`, as wide as where there is no terminal.
fn help(program: &str, words: &[&str]) -> String {
    let output = Command::new(binary(program))
        .args(words)
        .arg("--help")
        .env_remove("COLUMNS")
        .output()
        .expect("it starts");
    assert!(output.status.success(), "{program} {words:?}");
    let help = String::from_utf8(output.stdout).expect("text");
    // A usage is one line however long.
    for line in help.lines().filter(|line| !line.starts_with("Usage: ")) {
        assert!(line.chars().count() <= 80, "{program} {words:?}: {line}");
    }
    help
}

/// The names that a help lists as its commands.
pub(crate) fn subcommands(help: &str) -> Vec<String> {
    let Some((_, rest)) = help.split_once("\nCommands:\n") else {
        return Vec::new();
    };
    let (list, _) = rest.split_once("\n\n").unwrap_or((rest, ""));
    let is_name = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    list.lines()
        .filter(is_name)
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .map(str::to_owned)
        .collect()
}

/// A help without the list of its subcommands, whose sections follow.
fn without_list(help: &str) -> String {
    match help.split_once("\nCommands:\n") {
        Some((before, rest)) => format!("{before}\n{}", rest.split_once("\n\n").map_or("", |(_, after)| after)),
        None => help.to_owned(),
    }
}

/// A help without what every subcommand's help says. Options that an earlier subcommand has in the same words are
/// named by its name; `seen` has them by their words.
fn own_help(subcommand: &str, help: &str, seen: &mut HashMap<String, String>) -> String {
    // The heading and the list of arguments say it, but for `--` and options that must be given.
    let usage = format!("haptic-ctl {subcommand}");
    let is_plain_usage = |line: &str| {
        let line = line.trim_start_matches("Usage:").trim_start();
        line.starts_with(&usage) && !line.contains("--")
    };
    let is_of_all = |line: &str| {
        let is_help = line.contains("Print help") || line.contains("-h, --help") || line.starts_with(COMMON);
        is_help || is_plain_usage(line)
    };
    let help = without_list(help);
    let kept: Vec<&str> = help.lines().filter(|line| !is_of_all(line)).collect();
    let kept = kept.join("\n").replace("Options:\n\n", "").replace("\n\n\n", "\n\n");
    let is_here = |paragraph: &&str| !ELSEWHERE.iter().any(|begin| paragraph.starts_with(begin));
    let kept: Vec<&str> = kept.split("\n\n").filter(is_here).collect();
    let kept = kept.join("\n\n");
    let kept = kept.trim_end().trim_end_matches("\nOptions:");
    // Each option with the lines of its text, and every other line by itself.
    let mut parts: Vec<String> = Vec::new();
    for line in kept.lines() {
        let goes_on = line.starts_with("          ") || line.trim().is_empty();
        match parts.last_mut() {
            Some(last) if goes_on && is_option(last) => *last = format!("{last}\n{line}"),
            _ => parts.push(line.to_owned()),
        }
    }
    let mut own: Vec<String> = Vec::new();
    for run in parts.chunk_by(|a, b| origin(a, seen).is_some() && origin(a, seen) == origin(b, seen)) {
        match origin(&run[0], seen) {
            Some(earlier) if run.len() > 1 || run[0].split_whitespace().count() > MAX_REPEATED => {
                let names: Vec<&str> = run.iter().filter_map(|part| part.split_whitespace().next()).collect();
                let blank = if run[run.len() - 1].ends_with('\n') { "\n" } else { "" };
                own.push(format!("      As in `{earlier}`: {}{blank}", names.join(", ")));
            }
            _ => own.extend_from_slice(run),
        }
    }
    for part in parts.iter().filter(|part| is_option(part)) {
        seen.entry(words(part)).or_insert_with(|| subcommand.to_owned());
    }
    own.join("\n")
}

const COMMON: &str = "Options of every subcommand:";

/// What every program has.
const HELP_AND_VERSION: &str = "  -h, --help
          Print help (see a summary with '-h')

  -V, --version
          Print version

";

/// What begins so has a page of its own: the parameters, and the how-to pages, whose commands a test runs.
const ELSEWHERE: [&str; 2] = ["Parameters, by name or symbol", "Example"];

/// Most words of a single option or argument that stands on the page again.
const MAX_REPEATED: usize = 12;

/// Whether a part of a help is an option or an argument.
fn is_option(part: &str) -> bool {
    ["      --", "  -", "  <", "  ["]
        .iter()
        .any(|begin| part.starts_with(begin))
}

fn words(part: &str) -> String {
    part.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The subcommand that has an option in the same words.
fn origin(part: &str, seen: &HashMap<String, String>) -> Option<String> {
    seen.get(&words(part)).cloned().filter(|_| is_option(part))
}

#[test]
fn every_subcommand_of_haptic_ctl() {
    let whole = help("haptic-ctl", &[]);
    // The codes have a page of their own.
    let (head, _) = whole.split_once("\nExit codes:").expect("the codes");
    assert!(head.contains(HELP_AND_VERSION), "{head}");
    let head = without_list(head).replace(HELP_AND_VERSION, "");
    let mut page = format!("```text\n{}\n```\n", head.trim_end());
    let mut waiting: Vec<Vec<String>> = subcommands(&whole).into_iter().rev().map(|name| vec![name]).collect();
    let mut seen = HashMap::new();
    while let Some(words) = waiting.pop() {
        let words_as_given: Vec<&str> = words.iter().map(String::as_str).collect();
        let help = help("haptic-ctl", &words_as_given);
        let name = words.join(" ");
        let own = own_help(&name, &help, &mut seen);
        write!(page, "\n## {name}\n\n```text\n{}\n```\n", own.trim_end()).expect("a string");
        waiting.extend(
            subcommands(&help)
                .into_iter()
                .rev()
                .map(|name| [&words[..], &[name]].concat()),
        );
    }
    assert!(page.matches("\n## ").count() > 40, "{page}");
    drawn::part("reference/haptic-ctl.md", "the help", &page);
}

#[test]
fn every_usb_board() {
    let rows = device_io::usb_boards::BOARDS.iter().map(|board| {
        let identity = format!("`{:04x}:{:04x}`", board.vendor, board.product);
        let is_shared = if board.is_shared { "yes" } else { "no" };
        [&*identity, board.name, is_shared, board.source].map(str::to_owned)
    });
    let page = table(["USB identity", "board", "shared with other devices", "source"], rows);
    drawn::part("reference/usb-boards.md", "USB boards", &page);
}

#[test]
fn every_exit_code() {
    let whole = help("haptic-ctl", &[]).replace('\n', " ");
    let (_, rest) = whole.split_once("Exit codes: ").expect("the codes");
    let (list, _) = rest.split_once(". ").expect("their end");
    let mut rows: Vec<[String; 2]> = Vec::new();
    for part in list.split(", ") {
        let (code, meaning) = part.split_once(' ').unwrap_or((part, ""));
        match rows.last_mut() {
            Some(last) if code.parse::<u8>().is_err() => last[1] = format!("{}, {part}", last[1]),
            _ => rows.push([code, meaning].map(str::to_owned)),
        }
    }
    assert_eq!(rows.len(), 8, "{rows:?}");
    let page = table(["exit code", "meaning"], rows);
    drawn::part("reference/exit-codes.md", "exit codes", &page);
}

/// An option of the help, as its line and its text.
struct Documented {
    name: String,
    value: String,
    text: String,
}

/// The daemon's options; those of a single letter, help and version, are none.
fn documented(help: &str) -> Vec<Documented> {
    let option = |text: &str| {
        let (line, text) = text.split("\n  -").next()?.split_once('\n')?;
        let (name, value) = line.split_once([' ', '[']).unwrap_or((line, ""));
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        let mut text = String::new();
        for paragraph in lines.join("\n").trim().split("\n\n") {
            // A help's first paragraph ends without a point.
            let ends = text.is_empty() || text.ends_with('.') || paragraph.starts_with('[');
            let point = if ends { "" } else { "." };
            text = format!("{text}{point} {}", paragraph.replace('\n', " "));
        }
        Some(Documented {
            name: name.to_owned(),
            value: value.trim_matches(['<', '>', '[', ']']).to_owned(),
            text: text.trim().to_owned(),
        })
    };
    help.split("\n      --").skip(1).filter_map(option).collect()
}

/// Whether an option may stand in the configuration file.
fn is_field(option: &Documented) -> bool {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hapticd.toml");
    // No option is a table, so the daemon refuses it either way.
    fs::write(&file, format!("[{}]\n", option.name)).expect("it can be written");
    let output = Command::new(binary("hapticd"))
        .arg("--config")
        .arg(&file)
        .output()
        .expect("it starts");
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{message}");
    !message.contains("unknown field")
}

/// Takes ` [NAME: ...]` out of a text and returns what stands in it.
fn bracketed(text: &mut String, name: &str) -> Option<String> {
    let (before, rest) = text.split_once(&format!(" [{name}: "))?;
    let (inner, after) = rest.split_once(']')?;
    let inner = inner.to_owned();
    *text = format!("{before}{after}");
    Some(inner)
}

#[test]
fn every_field_of_the_configuration() {
    let options = documented(&help("hapticd", &[]));
    let mut page = String::new();
    let (fields, others): (Vec<&Documented>, Vec<&Documented>) = options.iter().partition(|option| is_field(option));
    for option in fields {
        let mut text = option.text.clone();
        let default = bracketed(&mut text, "default");
        let default = default.map_or_else(|| "required".to_owned(), |default| format!("default {default}"));
        let value = match bracketed(&mut text, "possible values") {
            Some(_) if option.value == "BOOL" => "boolean".to_owned(),
            Some(values) => format!("\"{}\"", values.replace(", ", "\" or \"")),
            // Named by its unit, which the text has too.
            None if option.value.len() <= 2 || option.value.contains('/') || option.value == "SHARE" => {
                "number".to_owned()
            }
            None => option.value.to_lowercase(),
        };
        add(&mut page, &format!("- `{}` ({value}; {default}): {text}", option.name));
    }
    drawn::part("reference/configuration.md", "fields", &page);
    let mut page = String::new();
    for option in others {
        add(&mut page, &format!("- `--{}`: {}", option.name, option.text));
    }
    drawn::part("reference/configuration.md", "options", &page);
}

#[test]
fn every_law_and_every_parameter() {
    let rows = LAWS.into_iter().map(|law| {
        let usual = Friction::default_of(law).expect("a law of the list");
        let summary = Friction::summary(law).expect("it has one");
        let mut symbols: Vec<&str> = Vec::new();
        for coordinate in usual.vector(false) {
            let symbol = coordinate.key.parameter.info().symbol;
            if !symbols.contains(&symbol) {
                symbols.push(symbol);
            }
        }
        [format!("`{law}`"), summary.to_owned(), symbols.join(", ")]
    });
    let page = table(["law", "what it is", "its own parameters"], rows);
    drawn::part("reference/laws.md", "laws", &page);
    let rows = TABLE.iter().map(|info| {
        let directions = if info.directional {
            format!("; by direction {0}+ and {0}-", info.symbol)
        } else {
            String::new()
        };
        [
            format!("`{}`", info.name),
            format!("`{}`", info.symbol),
            info.unit.to_owned(),
            format!("{} to {}{directions}", info.min, info.max),
            info.feel.to_owned(),
        ]
    });
    let head = ["parameter", "symbol", "unit", "accepted", "a larger value feels like"];
    let page = table(head, rows);
    drawn::part("reference/laws.md", "parameters", &page);
}

#[test]
fn every_metric() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("hapticd.prom");
    // A rig behind a link, so that the metrics of the link are among them.
    let rig = FakeRig::start(&["--hand", "free"]);
    let _daemon = Daemon::start_on(&rig.address(), &["--metrics-file", plain(&file)]);
    let written = until_some("waited in vain for the link", || {
        let last = ["hapticd_link_round_trip_seconds ", "hapticd_position_meters "];
        let written = fs::read_to_string(&file).ok()?;
        last.iter().all(|name| written.contains(name)).then_some(written)
    });
    let mut page = String::new();
    for line in written.lines() {
        let Some((name, about)) = line.strip_prefix("# HELP ").and_then(|line| line.split_once(' ')) else {
            continue;
        };
        // The page's own words have it: it comes later than the others, or not.
        if name == "hapticd_link_clock_drift_ratio" {
            continue;
        }
        let kind = written
            .lines()
            .find_map(|line| line.strip_prefix(&format!("# TYPE {name} ")))
            .expect("its kind");
        add(&mut page, &format!("- `{name}` ({kind}): {about}"));
    }
    drawn::part("reference/metrics.md", "metrics", &page);
}

#[test]
fn every_fault() {
    let rows = Fault::KINDS.into_iter().map(|fault| {
        let code = fault.code();
        let id = Fault::message_id(code).expect("each has one");
        let message = fault.to_string();
        let because = message.strip_prefix(&format!("{code}: ")).unwrap_or(&message);
        // A code, and what is wrong with a clock, differ from time to time.
        let because = [" (code", ": its time"]
            .iter()
            .fold(because, |text, cut| text.split(cut).next().unwrap_or(text));
        [format!("`{code}`"), because.to_owned(), format!("`{id}`")]
    });
    drawn::part(
        "reference/faults.md",
        "faults",
        &table(["fault", "because", "message id"], rows),
    );
}

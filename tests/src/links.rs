//! The links of the documents: whether each leads to a file, and to a heading in it, that is there.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// A link in a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// Line of the document, from 1.
    pub line: usize,
    /// Path from the document, empty for the document itself.
    pub path: String,
    /// Name of a heading, empty for none.
    pub anchor: String,
}

/// The links and images of a document that lead into the repository. What stands in a block or a span of code is none.
pub fn links(text: &str) -> Vec<Link> {
    let mut found = Vec::new();
    for (line, number) in prose(text) {
        let plain: String = line.split('`').step_by(2).collect();
        for rest in plain.split("](").skip(1) {
            let target = rest.split([')', ' ']).next().unwrap_or_default();
            let is_elsewhere = target.contains("://") || target.starts_with("mailto:");
            if !is_elsewhere {
                let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
                found.push(Link {
                    line: number,
                    path: path.to_owned(),
                    anchor: anchor.to_owned(),
                });
            }
        }
    }
    found
}

/// The names under which a page in HTML has its headings; those of the same words are numbered.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    for (line, _) in prose(text) {
        let title = line.trim_start_matches('#');
        if title.len() < line.len() && title.starts_with(' ') {
            let name = anchor(title);
            let mut numbered = (1..).map(|number| format!("{name}-{number}"));
            let is_new = |name: &String| !anchors.contains(name);
            let name = if is_new(&name) {
                Some(name.clone())
            } else {
                numbered.find(is_new)
            };
            anchors.extend(name);
        }
    }
    anchors
}

fn anchor(title: &str) -> String {
    let mut name = title.trim().to_ascii_lowercase().replace(' ', "-");
    name.retain(|letter| letter.is_alphanumeric() || letter == '-' || letter == '_');
    name
}

/// The lines outside of blocks of code, with their numbers.
fn prose(text: &str) -> impl Iterator<Item = (&str, usize)> {
    let mut is_code = false;
    text.lines().zip(1..).filter(move |(line, _)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence
    })
}

/// The links of a document that lead nowhere, each as a sentence.
pub fn dead_ends(document: &Path, text: &str) -> Vec<String> {
    let folder = document.parent().unwrap_or(Path::new("."));
    links(text)
        .into_iter()
        .filter_map(|link| {
            let target = if link.path.is_empty() {
                document.to_path_buf()
            } else {
                folder.join(&link.path)
            };
            let why = if !target.exists() {
                format!("there is no {}", link.path)
            } else if link.anchor.is_empty() {
                return None;
            } else {
                let there = fs::read_to_string(&target).unwrap_or_default();
                if anchors(&there).contains(&link.anchor) {
                    return None;
                }
                format!("{} has no heading #{}", target.display(), link.anchor)
            };
            Some(format!("{}:{}: {why}", document.display(), link.line))
        })
        .collect()
}

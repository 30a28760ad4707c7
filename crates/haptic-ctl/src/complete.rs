//! Completions for the shell beyond the command line's own words: parameters, conditions, and the
//! scenes of a running daemon.

use crate::{condition, units};
use clap_complete::engine::CompletionCandidate;
use haptic_core::friction::Friction;
use haptic_core::parameters::TABLE;
use haptic_ipc::{Client, Request, SceneListReply, socket_path};
use std::ffi::OsStr;

/// Completes the name of a parameter, up to its `=`.
pub(crate) fn assignments(current: &OsStr) -> Vec<CompletionCandidate> {
    let begun = current.to_string_lossy();
    TABLE
        .iter()
        .flat_map(|row| {
            let directions: &[&str] = if row.directional { &["", "+", "-"] } else { &[""] };
            let names = [row.name, row.symbol];
            names
                .into_iter()
                .flat_map(move |name| directions.iter().map(move |direction| format!("{name}{direction}=")))
                .map(move |text| (text, row))
        })
        .filter(|(text, _)| text.starts_with(&*begun))
        .map(|(text, row)| {
            CompletionCandidate::new(text).help(Some(
                format!("{} .. {} {}", row.min, row.max, units::shown(row.unit)).into(),
            ))
        })
        .collect()
}

/// Completes the last comparison of a condition: its field or parameter, or the word after `=`.
pub(crate) fn conditions(current: &OsStr) -> Vec<CompletionCandidate> {
    let text = current.to_string_lossy();
    let begins = text.rfind(char::is_whitespace).map_or(0, |space| space + 1);
    let (before, begun) = text.split_at(begins);
    let fields = condition::fields();
    let words: Vec<(String, Option<&str>)> = match begun.split_once('=') {
        Some((field, _)) => condition::words(field.trim_end_matches('!'))
            .into_iter()
            .map(|word| (format!("{field}={word}"), Friction::summary(&word)))
            .collect(),
        None => fields
            .split(", ")
            .chain(TABLE.iter().flat_map(|row| [row.name, row.symbol]))
            .map(|name| (name.to_owned(), None))
            .collect(),
    };
    words
        .into_iter()
        .filter(|(word, _)| word.starts_with(begun))
        .map(|(word, help)| CompletionCandidate::new(format!("{before}{word}")).help(help.map(Into::into)))
        .collect()
}

/// Completes a scene: of the daemon's library, if a daemon runs, or a file.
pub(crate) fn scenes(current: &OsStr) -> Vec<CompletionCandidate> {
    let begun = current.to_string_lossy().into_owned();
    let listed: Option<SceneListReply> = Client::connect(&socket_path::for_client(None))
        .ok()
        .and_then(|mut client| client.request(Request::SceneList {}).ok());
    let mut candidates: Vec<CompletionCandidate> = listed
        .unwrap_or_default()
        .scenes
        .into_iter()
        .filter(|scene| scene.name.starts_with(&begun))
        .map(|scene| CompletionCandidate::new(scene.name).help(Some(scene.law.into())))
        .collect();
    let is_scene = |path: &std::path::Path| path.extension().is_some_and(|extension| extension == "toml");
    candidates.extend(clap_complete::engine::ValueCompleter::complete(
        &clap_complete::PathCompleter::file().filter(is_scene),
        current,
    ));
    candidates
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_condition_is_completed_by_fields_and_then_by_words() {
        let offered = |text: &str| -> Vec<String> {
            let candidates = conditions(OsStr::new(text));
            candidates
                .iter()
                .map(|one| one.get_value().to_string_lossy().into_owned())
                .collect()
        };
        assert_eq!(offered("sta"), ["state", "static_force"]);
        assert_eq!(offered("state=eng"), ["state=engaging", "state=engaged"]);
        assert_eq!(offered("mass>1 and state!=stop"), ["mass>1 and state!=stopped"]);
        assert_eq!(offered("contact=st"), ["contact=stuck"]);
        assert_eq!(offered("law!=kar"), ["law!=karnopp"]);
        assert!(offered("tick=").is_empty());
        let helped = conditions(OsStr::new("law=dahl"));
        let help = helped[0].get_help().map(ToString::to_string);
        assert_eq!(help.as_deref(), Friction::summary("dahl"));
    }
}

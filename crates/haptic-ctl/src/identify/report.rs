//! What was identified: a table for people, JSON for scripts, a scene to feel, and plots.

use crate::failure::Failure;
use crate::{output, table_file};
use haptic_lab::drawing::{Page, PlotFormat, Table, UnknownEnding};
use haptic_lab::identify::{FoundValue, Identification, Identified, Refusal};
use std::path::{Path, PathBuf};

/// Where the results go.
#[derive(Debug, clap::Args)]
#[group(id = "of_results")]
pub(super) struct Arguments {
    /// Output: the scene that feels like it
    #[arg(long, value_name = "SCENE.toml", conflicts_with = "rig")]
    out: Option<PathBuf>,

    /// Plot of force and residual, or a page with the values
    #[arg(long, value_name = "FILE.svg|.html", value_parser = plot_file, conflicts_with = "rig")]
    plot: Option<(PathBuf, PlotFormat)>,
}

/// A file for a plot, whose ending says its format.
fn plot_file(text: &str) -> Result<(PathBuf, PlotFormat), UnknownEnding> {
    let path = PathBuf::from(text);
    PlotFormat::of(&path).map(|format| (path, format))
}

impl Arguments {
    /// Refuses a scene's file that would take the place of an input, outputs in folders that are not there, and a scene's
    /// file that is, before the rig is moved for nothing. A scene may have been changed by hand since; a plot is drawn
    /// again.
    pub(super) fn check<'a>(&self, inputs: impl Iterator<Item = &'a Path>, replace: bool) -> Result<(), Failure> {
        if let Some(out) = &self.out {
            table_file::refuse_overwriting(out, inputs)?;
        }
        let files = self.out.iter().chain(self.plot.iter().map(|(path, _)| path));
        for file in files {
            let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
            if folder.is_some_and(|folder| !folder.is_dir()) {
                return Err(Failure::Usage(format!("{}: there is no such folder", file.display())));
            }
        }
        match &self.out {
            Some(out) if !replace && out.is_file() => Err(Failure::exists(out)),
            _ => Ok(()),
        }
    }

    /// Writes what was asked for. A scene is not written where the record does not determine one; that is
    /// reported, and ends with exit code 1.
    pub(super) fn write(&self, origin: &str, identification: &Identification, json: bool) -> Result<(), Failure> {
        let found = &identification.found;
        if let Some((path, format)) = &self.plot {
            let page = Page {
                title: format!("Identified from {origin}"),
                paragraphs: found.notes.clone(),
                charts: identification.plots(),
                tables: vec![Table {
                    caption: heading(found),
                    rows: rows(found),
                }],
            };
            page.write(path, *format)
                .map_err(|error| Failure::File(format!("{}: {error}", path.display())))?;
        }
        let Some(path) = &self.out else { return Ok(()) };
        let failed = |reason: String| Failure::File(format!("{}: {reason}", path.display()));
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let made = match found.scene(&name) {
            Ok(made) => made,
            Err(reason) => {
                eprintln!("haptic-ctl: {} is not written: {reason}", path.display());
                return Err(Failure::Silent(1));
            }
        };
        let mut text = format!(
            "# Identified from {origin} by haptic-ctl identify; {}.\n",
            found.residual()
        );
        for assumption in &made.assumptions {
            text.push_str(&format!("# {assumption}\n"));
        }
        text.push_str(&toml::to_string(&made.scene).map_err(|error| failed(error.to_string()))?);
        std::fs::write(path, text).map_err(|error| failed(error.to_string()))?;
        if json {
            return Ok(());
        }
        output::unless_quiet(&written(path, &made.assumptions))
    }
}

/// Prints the result. What the model's scene needs and the record does not determine ends with exit code 1.
pub(super) fn show(found: &Identified, json: bool) -> Result<(), Failure> {
    if json {
        output::json(found)?;
    } else {
        output::line(&text(heading(found), &rows(found), found, MovedBy::Hand))?;
    }
    if found.missing().is_empty() {
        Ok(())
    } else {
        Err(Failure::Silent(1))
    }
}

/// What was written, and what in it the record does not determine.
fn written(path: &Path, assumptions: &[String]) -> String {
    let lines = assumptions.iter().map(|assumption| format!("\n- {assumption}"));
    format!(
        "\n{}: the scene of these values, in which{}",
        path.display(),
        lines.collect::<String>()
    )
}

/// The values with their units and intervals, under the names of the columns.
pub(super) fn rows(found: &Identified) -> Vec<Vec<String>> {
    let heading = output::row(["", "value", "unit", "95 % interval"]);
    let row = |found: FoundValue| vec![found.what, found.value, found.unit.to_owned(), found.interval];
    [heading]
        .into_iter()
        .chain(found.values().into_iter().map(row))
        .collect()
}

/// The model, and what it leaves.
fn heading(found: &Identified) -> String {
    format!("{}, {}", found.model.word(), found.residual())
}

/// What moved the handle: what to do where a record does not tell enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MovedBy {
    Hand,
    OwnMotor,
}

/// The report for people: a heading, the values, and what the record does not determine.
pub(super) fn text(heading: String, rows: &[Vec<String>], found: &Identified, by: MovedBy) -> String {
    let mut text = heading;
    if let Some(why) = &found.chosen_because {
        text.push_str(&format!("\nchosen because {why}"));
    }
    if rows.len() > 1 {
        text.push_str(&format!("\n\n{}", output::table(rows)));
    }
    if !found.refused.is_empty() {
        text.push_str("\n\nThe record does not determine");
        for (parameters, reason, instead) in refusals(found) {
            text.push_str(&match by {
                MovedBy::Hand => format!("\n- {parameters}: {reason}.\n  Record instead: {instead}."),
                MovedBy::OwnMotor => format!("\n- {parameters}: {reason}."),
            });
        }
        if by == MovedBy::OwnMotor {
            text.push_str("\nRun it again, with a longer --chirp-s or more --max-force-n.");
        }
    }
    if !found.notes.is_empty() {
        text.push('\n');
    }
    for note in &found.notes {
        text.push_str(&format!("\n- {note}"));
    }
    text
}

/// What was refused, each reason once with all that it concerns: parameters, reason, and what to record instead.
fn refusals(found: &Identified) -> Vec<(String, &str, &str)> {
    let mut rows: Vec<(String, &str, &str)> = Vec::new();
    for Refusal {
        parameter,
        reason,
        instead,
    } in &found.refused
    {
        match rows.iter_mut().find(|row| (row.1, row.2) == (reason, instead)) {
            Some((parameters, ..)) => {
                parameters.push_str(", ");
                parameters.push_str(parameter);
            }
            None => rows.push((parameter.clone(), reason, instead)),
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Directional;
    use haptic_lab::identify::ModelKind;

    #[test]
    fn a_written_scene_says_where_it_is_and_what_it_assumes() {
        let found = Identified {
            mass_kg: Some(1.0),
            dynamic_force_n: Some(Directional::new(2.0, 1.9)),
            viscous_ns_per_m: Some(Directional::both(3.0)),
            ..Identified::empty(ModelKind::Karnopp)
        };
        let made = found.scene("s").expect("a scene");
        let text = written(Path::new("out/s.toml"), &made.assumptions);
        for part in [
            "out/s.toml: ",
            "\n- static friction was refused",
            "2.0000 N in the positive and 1.9000 N",
        ] {
            assert!(text.contains(part), "{part} in {text}");
        }
    }

    #[test]
    fn report_gives_units_intervals_and_recording_instructions() {
        let found = Identified {
            mass_kg: Some(0.50063),
            dynamic_force_n: Some(Directional::new(3.4998, 3.01)),
            residual_rms_n: 0.0000174,
            intervals: [
                ("mass_kg".to_owned(), [0.49889, 0.50238]),
                ("dynamic_force_N.positive".to_owned(), [3.4925, 3.5071]),
            ]
            .into(),
            refused: ["static_force_N", "offset_N"]
                .map(|parameter| Refusal {
                    parameter: parameter.to_owned(),
                    reason: "no slow load".to_owned(),
                    instead: "push slowly".to_owned(),
                })
                .to_vec(),
            ..Identified::empty(ModelKind::Karnopp)
        };
        let text = text(heading(&found), &rows(&found), &found, MovedBy::Hand);
        for part in [
            "karnopp, residual 0.000017 N rms",
            "mass                0.5006",
            "0.4989 to 0.5024",
            "dynamic friction +  3.4998",
            "- static_force_N, offset_N: no slow load.\n  Record instead: push slowly.",
        ] {
            assert!(text.contains(part), "{part} in\n{text}");
        }
    }
}

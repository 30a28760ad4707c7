//! The question of identification that the user's choices make.

use super::fit::Origin;
use super::question::{Data, Question, Samples};
use crate::daemon::Daemon;
use crate::tapes::Tapes;
use crate::view::View;
use haptic_ipc::quantity;
use haptic_lab::identify::Options;
use haptic_lab::identify::record_file::Source;
use haptic_motion::table::TableOptions;
use std::path::Path;

/// The question that the user's choices make.
///
/// # Errors
/// Why they make none, naming the field.
pub(crate) fn question(view: &View, tapes: &Tapes, daemon: &Daemon) -> Result<Question, String> {
    let choice = &view.fitting.choice;
    let number = |name: &str, text: &str, unit: &str| {
        let text = text.trim();
        if text.is_empty() {
            return Ok(None);
        }
        let number = quantity::parse(text, unit);
        number.map(Some).map_err(|error| format!("{name}: {error}"))
    };
    let options = Options {
        mass_kg: number("Mass", &choice.mass, "kg")?,
        offset_n: number("Offset", &choice.offset, "N")?,
        ..Options::new(choice.model)
    };
    let data = match choice.origin {
        Origin::File if choice.path.trim().is_empty() => return Err("Choose a file".to_owned()),
        Origin::File => Data::File(Source {
            table: TableOptions {
                columns: choice.columns.clone(),
                position_gain: number("Position gain", &choice.position_gain, "1")?,
                force_gain: number("Force gain", &choice.force_gain, "1")?,
                ..TableOptions::default()
            },
            moving: choice.moving,
            ..Source::new(Path::new(choice.path.trim()))
        }),
        Origin::Rig | Origin::Recording => Data::Seen(Box::new(samples(view, tapes, daemon)?)),
    };
    Ok(Question { options, data })
}

/// What is seen of the rig or of the opened recording, or of that what is between the cursors.
fn samples(view: &View, tapes: &Tapes, daemon: &Daemon) -> Result<Samples, String> {
    let is_of_rig = view.fitting.choice.origin == Origin::Rig;
    let (names, scope, metadata) = if is_of_rig {
        let metadata = daemon.metadata().ok_or("The daemon has not sent its scene yet")?;
        let names = ["what is seen of the rig", "what is between the cursors at the rig"];
        (names, &view.scope, metadata)
    } else {
        let opened = tapes.opened().ok_or("No recording is open")?;
        let names = [
            "what is seen of the recording",
            "what is between the cursors in the recording",
        ];
        (names, &view.recorded, opened.metadata.clone())
    };
    let name = names[usize::from(scope.cursors.shown)];
    let (from_s, to_s) = scope.measured(tapes);
    let tape = scope.tape(tapes).part(from_s, to_s);
    if tape.last().is_none() {
        let place = if scope.cursors.shown {
            "between the cursors"
        } else {
            "in sight"
        };
        return Err(format!("There is no sample {place}"));
    }
    let (oldest_s, newest_s) = (tape.oldest_s(), tape.newest_s());
    Ok(Samples {
        name,
        tape,
        zero_s: if is_of_rig { 0.0 } else { scope.seen(tapes).zero_s },
        from_s: oldest_s.map_or(from_s, |oldest_s| oldest_s.max(from_s)),
        to_s: newest_s.map_or(to_s, |newest_s| newest_s.min(to_s)),
        metadata,
        moving: view.fitting.choice.moving,
    })
}

//! A panel with samples to export.

use crate::model::Model;
use crate::tape::tests::at;
use crate::update::Update;
use haptic_ipc::{Event, SamplesEvent};

/// Two seconds, with a spike of 42 N.
pub(super) fn with_samples() -> Model {
    let rows = (0..2000).map(|i| {
        let mut row = at(f64::from(i) * 1e-3);
        row.command_force_n = if i == 1500 { 42.0 } else { 0.0 };
        row
    });
    let batch = SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: rows.collect(),
    };
    let mut model = Model::new();
    model.apply(Update::Event(Event::Samples(batch)));
    model
}

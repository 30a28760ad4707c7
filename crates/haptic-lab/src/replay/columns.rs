//! The columns that a step gives: two rows compared to the last bit.

use crate::row::RecordedRow;
use haptic_ipc::RigState;
use serde::Serialize;
use std::ops::Range;

/// A value of a column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number, in the column's unit.
    Number(f64),
    /// A contact: 0 stuck, +1 and -1 sliding; in the plane 1 sliding.
    Contact(i8),
    /// A state of the rig.
    State(RigState),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Contact(contact) => contact.fmt(f),
            Self::State(state) => state.fmt(f),
        }
    }
}

/// A column, with its recorded and its computed value.
pub(super) type ChangedColumn = (&'static str, Value, Value);

/// The numbers that a step gives, by column: the hand, the block, the forces. On a line those of the second axis are 0.
fn numbers(RecordedRow { sample, y }: &RecordedRow) -> [(&'static str, f64); 12] {
    let y = y.unwrap_or_default();
    [
        ("device_position_m", sample.device_position_m),
        ("device_position_y_m", y.device_position_m),
        ("device_velocity_mps", sample.device_velocity_mps),
        ("device_velocity_y_mps", y.device_velocity_mps),
        ("block_position_m", sample.block_position_m),
        ("block_position_y_m", y.block_position_m),
        ("block_velocity_mps", sample.block_velocity_mps),
        ("block_velocity_y_mps", y.block_velocity_mps),
        ("coupling_force_N", sample.coupling_force_n),
        ("coupling_force_y_N", y.coupling_force_n),
        ("command_force_N", sample.command_force_n),
        ("command_force_y_N", y.command_force_n),
    ]
}

const HAND: Range<usize> = 0..4;
const VELOCITY: Range<usize> = 2..4;
const BLOCK: Range<usize> = 4..8;
const FORCES: Range<usize> = 8..12;

/// The first of some numbers that differs.
fn first_number(recorded: &RecordedRow, computed: &RecordedRow, places: Range<usize>) -> Option<ChangedColumn> {
    let (recorded, computed) = (numbers(recorded), numbers(computed));
    let mut pairs = recorded[places.clone()].iter().zip(&computed[places]);
    pairs
        .find(|((_, recorded), (_, computed))| recorded.to_bits() != computed.to_bits())
        .map(|((column, recorded), (_, computed))| (*column, Value::Number(*recorded), Value::Number(*computed)))
}

/// The first column that differs: causes come before their effects.
pub(super) fn first_column(recorded: &RecordedRow, computed: &RecordedRow) -> Option<ChangedColumn> {
    let states = (recorded.sample.state, computed.sample.state);
    let contacts = (recorded.sample.contact, computed.sample.contact);
    let state = || (states.0 != states.1).then_some(("state", Value::State(states.0), Value::State(states.1)));
    let contact =
        || (contacts.0 != contacts.1).then_some(("contact", Value::Contact(contacts.0), Value::Contact(contacts.1)));
    first_number(recorded, computed, HAND)
        .or_else(state)
        .or_else(|| first_number(recorded, computed, BLOCK))
        .or_else(contact)
        .or_else(|| first_number(recorded, computed, FORCES))
}

/// Whether two rows hold the same outputs, to the last bit.
pub(super) fn is_same(one: &RecordedRow, other: &RecordedRow) -> bool {
    first_column(one, other).is_none()
}

/// Whether two rows hold the same velocity of the hand, to the last bit.
pub(super) fn is_same_velocity(one: &RecordedRow, other: &RecordedRow) -> bool {
    first_number(one, other, VELOCITY).is_none()
}

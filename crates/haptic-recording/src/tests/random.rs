//! Any recording, in every format.

use super::*;
use haptic_core::Directional;
use haptic_ipc::{JournalEntry, Peer};
use proptest::prelude::*;

fn any_number() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("NaN equals nothing", |number| !number.is_nan())
}

fn any_sample() -> impl Strategy<Value = Sample> {
    let state = prop::sample::select(RigState::ALL.to_vec());
    let numbers = prop::collection::vec(any_number(), 8);
    let counts = prop::array::uniform7(any::<u64>());
    let words = prop::array::uniform3(any::<u32>());
    (state, -1_i8..=1, numbers, counts, words).prop_map(|(state, contact, x, counts, words)| Sample {
        tick: counts[0],
        t_s: x[0],
        state,
        contact,
        device_position_m: x[1],
        device_velocity_mps: x[2],
        block_position_m: x[3],
        block_velocity_mps: x[4],
        coupling_force_n: x[5],
        command_force_n: x[6],
        revision: counts[1],
        wake_latency_ns: counts[2],
        tick_ns: counts[3],
        device_round_trip_ns: counts[4],
        elapsed_ns: counts[5],
        device_sequence: words[0],
        device_time_ns: counts[6],
        sample_position_m: x[7],
        input_flags: words[1],
        error_detail: words[2],
    })
}

fn any_mark() -> impl Strategy<Value = Mark> {
    let finite = || any::<f64>().prop_filter("JSON has finite numbers only", |number| number.is_finite());
    prop_oneof![
        (any::<u64>(), any::<u64>(), ".{0,20}", finite(), finite()).prop_map(|(tick, revision, name, one, other)| {
            let params = [
                ("mass".to_owned(), Directional::both(one)),
                (
                    "static_force".to_owned(),
                    Directional {
                        positive: one,
                        negative: other,
                    },
                ),
            ];
            Mark::Scene {
                tick,
                revision,
                name,
                law: "karnopp".into(),
                params: params.into(),
                arrival: None,
            }
        }),
        (any::<u64>(), prop::option::of(".{0,20}")).prop_map(|(tick, fault)| Mark::State {
            tick,
            state: RigState::Faulted,
            fault
        }),
        any::<u32>().prop_map(|rows| Mark::Lost { rows: rows.into() }),
        any::<u32>().prop_map(|changes| Mark::LostChanges {
            changes: changes.into()
        }),
        (any::<u64>(), any::<u32>()).prop_map(|(tick, periods)| Mark::Missed {
            tick,
            periods: periods.into()
        }),
        (any::<u64>(), ".{0,20}").prop_map(|(tick, text)| Mark::Marker { tick, text }),
        (any::<u64>(), ".{0,20}").prop_map(|(tick, text)| Mark::Link { tick, text }),
        (any::<u64>(), ".{0,20}", prop::option::of(".{0,20}")).prop_map(|(tick, session, message)| {
            let by = Peer {
                session,
                uid: 1000,
                user: None,
                pid: Some(1),
                program: None,
            };
            let entry = JournalEntry {
                tick: Some(tick),
                by: Some(by),
                message,
                ..JournalEntry::of("set")
            };
            Mark::Journal {
                tick,
                entry: Box::new(entry),
            }
        }),
    ]
}

fn any_y() -> impl Strategy<Value = SampleY> {
    prop::array::uniform7(any_number()).prop_map(SampleY::of_cells)
}

/// Rows of one axis or of two, and marks.
fn any_entries() -> impl Strategy<Value = (u8, Vec<Entry>)> {
    (1_u8..=2).prop_flat_map(|axes| {
        let row = (any_sample(), any_y()).prop_map(move |(row, y)| Entry::Row(row, (axes == 2).then_some(y)));
        let entry = prop_oneof![row, any_mark().prop_map(Entry::Mark)];
        (Just(axes), prop::collection::vec(entry, 0..40))
    })
}

/// Asserts that entries are others to the last bit.
fn check_bits(found: &[Entry], wanted: &[Entry]) -> Result<(), TestCaseError> {
    for entries in found.iter().zip(wanted) {
        if let (Entry::Row(row, y), Entry::Row(wanted, wanted_y)) = entries {
            // Zero is not equal to minus zero here.
            prop_assert_eq!(bits(row, y.as_ref()), bits(wanted, wanted_y.as_ref()));
        }
    }
    prop_assert_eq!(found, wanted);
    Ok(())
}

proptest! {
    #[test]
    fn what_is_written_is_what_is_read(
        (axes, entries) in any_entries(),
        started in 0.0..1e11_f64,
        mass in 1e-6..100.0_f64,
        notes in prop::option::of(".{0,20}"),
    ) {
        let mut about = metadata();
        about.axes = axes;
        about.started_unix_s = started;
        about.scene.block.as_mut().expect("the scene has a block").mass = mass;
        about.configuration = notes.as_ref().map(|notes| serde_json::json!({ "mass": mass, "notes": [notes] }));
        about.notes = notes;
        for format in Format::ALL {
            let (bytes, totals) = written(format, &about, &entries);
            prop_assert_eq!(totals.bytes, bytes.len() as u64);
            let mut reader = Reader::from_bytes(bytes).expect("reads");
            prop_assert_eq!(reader.format(), format);
            prop_assert_eq!(reader.metadata(), &about);
            let mut read: Vec<Entry> = reader.by_ref().collect::<Result<_, _>>().expect("reads");
            prop_assert_eq!(reader.ending(), Some(Ending::Complete));
            let (rows, lost, missed) = (totals.rows, totals.lost, totals.missed);
            prop_assert_eq!(read.pop(), Some(Entry::Mark(Mark::End { rows, lost, missed })));
            check_bits(&read, &entries)?;
        }
    }

    #[test]
    fn no_bytes_panic_the_reader(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        drop(read_bytes(&bytes));
        for magic in [::mcap::MAGIC, b"PAR1"] {
            drop(read_bytes(&[magic, &bytes, magic].concat()));
        }
    }

    #[test]
    fn no_damage_panics_the_reader(
        places in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8),
        end in prop::option::of(any::<prop::sample::Index>()),
        format in prop::sample::select(Format::ALL.to_vec()),
    ) {
        let (mut bytes, _) = written(format, &metadata(), &entries(&[sample(1), sample(2), sample(3)]));
        for (place, byte) in places {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        bytes.truncate(end.map_or(bytes.len(), |end| end.index(bytes.len() + 1)));
        drop(read_bytes(&bytes));
    }
}

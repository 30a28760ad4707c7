mod clocks;
mod comparison;
mod session;
mod what_if;

use super::Alternative;
use haptic_core::servo::Command;
use haptic_recording::Entry;
use proptest::prelude::*;
use session::{ReplayedSession, compared, drag};
use what_if::what_if_rows;

proptest! {
    /// No row, however damaged, panics a replay, and none makes it differ from itself.
    #[test]
    fn no_damage_panics_a_replay(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u64>(), 0..6_usize), 1..6),
    ) {
        let mut session = ReplayedSession::<f64>::new();
        session.run(100).command(Command::Engage).run(100).command(Command::Release).run(100);
        for (place, bits, field) in changes {
            let place = place.index(session.entries.len());
            if let Entry::Row(row, _) = &mut session.entries[place] {
                match field {
                    0 => row.tick = bits,
                    1 => row.sample_position_m = f64::from_bits(bits),
                    2 => row.input_flags = bits as u32,
                    3 => row.elapsed_ns = bits,
                    4 => row.device_time_ns = bits,
                    _ => row.revision = bits,
                }
            }
        }
        compared(&session.entries);
        let alternative = Alternative { scene: Some(drag().into()), ..Alternative::default() };
        let (_, summary) = what_if_rows(&session.entries, alternative);
        prop_assert!(summary.ticks == 302);
    }
}

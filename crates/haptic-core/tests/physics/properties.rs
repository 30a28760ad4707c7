//! Every law passes the properties of [`metamorphic`](crate::metamorphic), over its whole range.

use crate::metamorphic::{Property, attempt};
use crate::random::Random;
use haptic_core::friction::LAWS;

/// A run may end beyond its bound by so much, once in so many ticks: what the pieces of a block that swings a hundred
/// times in a tick leave out adds up.
const NEAR: f64 = 10.0;
const TICKS_PER_NEAR: u32 = 10_000;
/// Ticks in which a decision lies within the bound of its threshold, or whose work runs out, are rarer than one in
/// this.
const TICKS_PER_END: u32 = 1000;

/// What the cases of a law showed.
#[derive(Debug, Default)]
struct Sum {
    cases: u32,
    ticks: u32,
    /// Of the bound.
    worst: f64,
    near: u32,
    decided: u32,
    exhausted: u32,
    wrong: Vec<String>,
}

impl Sum {
    fn try_out(&mut self, property: Property, law: &str, has_block: bool) {
        let mut random = Random(88_172_645_463_325_252);
        for _ in 0..test_run::extent(60, 1000) {
            let Some(found) = attempt(property, law, has_block, &mut random) else {
                continue;
            };
            self.cases += 1;
            self.ticks += found.ticks;
            self.worst = self.worst.max(found.worst);
            self.decided += u32::from(found.decided);
            self.exhausted += u32::from(found.exhausted);
            match found.wrong {
                Some((ratio, _)) if ratio < NEAR => self.near += 1,
                Some((_, what)) => self.wrong.push(what),
                None => {}
            }
        }
    }

    fn is_kept(&self) -> bool {
        let rare = |count: u32, ticks: u32| count <= 1 + self.ticks / ticks;
        self.wrong.is_empty()
            && rare(self.near, TICKS_PER_NEAR)
            && rare(self.decided, TICKS_PER_END)
            && rare(self.exhausted, TICKS_PER_END)
    }
}

#[test]
fn no_property_is_broken_by_any_law() {
    let mut broken = Vec::new();
    for law in LAWS {
        for has_block in [true, false] {
            let place = if has_block { "behind a block" } else { "on the device" };
            let mut all = Sum::default();
            for property in Property::ALL {
                all.try_out(property, law, has_block);
                println!("{law} {place}, up to {property:?}: {all:?}");
            }
            if !all.is_kept() {
                broken.push((law, place));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:?}");
}

//! Every law passes the properties of [`metamorphic`](crate::metamorphic), over its whole range.

use crate::metamorphic::{Property, attempt};
use crate::random::Random;
use haptic_core::friction::LAWS;
use std::fmt;

/// A run may end beyond its bound by so much, once in so many ticks: what the pieces of a block that swings a hundred
/// times in a tick leave out adds up.
const NEAR: f64 = 10.0;
const TICKS_PER_NEAR: u32 = 10_000;
/// Ticks in which a decision lies within the bound of its threshold, or whose work runs out, are rarer than one in
/// this.
const TICKS_PER_END: u32 = 1000;

/// What the cases of a law and a property showed.
#[derive(Default)]
struct Sum {
    cases: u32,
    ticks: u32,
    worst: f64,
    near: u32,
    decided: u32,
    exhausted: u32,
    wrong: Vec<String>,
}

impl Sum {
    fn try_out(property: Property, law: &str, has_block: bool, cases: u32) -> Self {
        let mut random = Random(88_172_645_463_325_252);
        let mut sum = Self::default();
        for _ in 0..cases {
            let Some(found) = attempt(property, law, has_block, &mut random) else {
                continue;
            };
            sum.cases += 1;
            sum.ticks += found.ticks;
            sum.worst = sum.worst.max(found.worst);
            sum.decided += u32::from(found.decided);
            sum.exhausted += u32::from(found.exhausted);
            match found.wrong {
                Some((ratio, _)) if ratio < NEAR => sum.near += 1,
                Some((_, what)) => sum.wrong.push(what),
                None => {}
            }
        }
        sum
    }

    fn add(&mut self, other: Self) {
        self.cases += other.cases;
        self.ticks += other.ticks;
        self.worst = self.worst.max(other.worst);
        self.near += other.near;
        self.decided += other.decided;
        self.exhausted += other.exhausted;
        self.wrong.extend(other.wrong);
    }

    fn is_kept(&self) -> bool {
        let rare = |count: u32, ticks: u32| count <= 1 + self.ticks / ticks;
        self.wrong.is_empty()
            && rare(self.near, TICKS_PER_NEAR)
            && rare(self.decided, TICKS_PER_END)
            && rare(self.exhausted, TICKS_PER_END)
    }
}

impl fmt::Display for Sum {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:4} cases, {:6} ticks, {:.1e} of the bound; {} decided, {} exhausted, {} near, {} wrong",
            self.cases,
            self.ticks,
            self.worst,
            self.decided,
            self.exhausted,
            self.near,
            self.wrong.len()
        )
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
                let sum = Sum::try_out(property, law, has_block, test_run::extent(60, 1000));
                println!("{law:18} {place:14} {property:9?} {sum}");
                all.add(sum);
            }
            println!("{law:18} {place:14} in all    {all}");
            if !all.is_kept() {
                println!("    {}", all.wrong.join("\n    "));
                broken.push((law, place));
            }
        }
    }
    assert!(broken.is_empty(), "{broken:?}");
}

//! What must not matter to a force: the properties that the tests of the core try with seeds, here with
//! whatever is found to lead somewhere new.
#![no_main]

use haptic_core::friction::LAWS;
use libfuzzer_sys::fuzz_target;

#[path = "../../crates/haptic-core/tests/physics/metamorphic/mod.rs"]
mod metamorphic;

mod random {
    /// Numbers from the fuzzer's bytes; once these are used up, from a generator that they seed.
    pub(crate) struct Random<'a> {
        pub(crate) bytes: core::slice::ChunksExact<'a, u8>,
        pub(crate) state: u64,
    }
}

impl random::Random<'_> {
    /// From 0 to 1.
    pub(crate) fn share(&mut self) -> f64 {
        if let Some(pair) = self.bytes.next() {
            return f64::from(u16::from_le_bytes([pair[0], pair[1]])) / f64::from(u16::MAX);
        }
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 32) as f64 / f64::from(u32::MAX)
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    pub(crate) fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.share())
    }

    pub(crate) fn one_in(&mut self, count: u32) -> bool {
        self.share() * f64::from(count) < 1.0
    }

    pub(crate) fn one_of<X: Copy>(&mut self, choices: &[X]) -> X {
        choices[((self.share() * choices.len() as f64) as usize).min(choices.len() - 1)]
    }
}

fuzz_target!(|bytes: &[u8]| {
    let [law, property, rest @ ..] = bytes else { return };
    let seed = rest.iter().fold(88_172_645_463_325_252_u64, |seed, &byte| {
        (seed ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    let mut random = random::Random {
        bytes: rest.chunks_exact(2),
        state: seed | 1,
    };
    let all = metamorphic::Property::ALL;
    let property = all[usize::from(*property) % all.len()];
    let (law, has_block) = (LAWS[usize::from(law / 2) % LAWS.len()], law % 2 == 0);
    let found = metamorphic::attempt(property, law, has_block, &mut random);
    // A few times the bound is what adds up over a run: the tests count how rare that is.
    if let Some((ratio, wrong)) = found.and_then(|found| found.wrong)
        && ratio > 10.0
    {
        panic!("{law}: {wrong}");
    }
});

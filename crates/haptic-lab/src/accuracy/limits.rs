//! What every law is held to: the one table of the limits that the tests check.

/// A limit as it is held now, and as it is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limit {
    /// What the laws reach today, with a margin.
    pub today: f64,
    /// What they are to reach.
    pub target: f64,
}

impl Limit {
    /// The limit that the tests hold. Once the laws reach their targets, this is `self.target`.
    #[must_use]
    pub const fn held(&self) -> f64 {
        self.today
    }
}

const fn limit(today: f64, target: f64) -> Limit {
    Limit { today, target }
}

/// The limits of a law with the exact scheme.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawLimit {
    /// Name of the law, as in [`laws_under_hands`](super::hands::laws_under_hands).
    pub law: &'static str,
    /// Force error behind a block, N: all hands, masses and single ticks, except ticks at their
    /// bound of work and those after them.
    pub behind_block_n: Limit,
    /// Median of the force error there, N, of the worst run.
    pub median_n: Limit,
    /// Force error on the device itself, N.
    pub on_device_n: Limit,
    /// Ticks at their bound of work behind a block.
    pub at_bound: Limit,
    /// Runs whose stops and breakaways are not the truth's.
    pub other_lists: Limit,
    /// Instructions a tick on each of [`INSTRUCTIONS_ON`], in the profile of the tests, with a tenth
    /// on top.
    pub instructions: [f64; 2],
}

/// The hand and the mass, kg, for which instructions are counted.
pub const INSTRUCTIONS_ON: [(&str, f64); 2] = [("60 Hz", 0.5), ("437 Hz", 0.01)];

/// One row.
const fn law(
    law: &'static str,
    behind_block_n: Limit,
    median_n: Limit,
    on_device_n: Limit,
    at_bound: Limit,
    other_lists: Limit,
    instructions: [f64; 2],
) -> LawLimit {
    LawLimit {
        law,
        behind_block_n,
        median_n,
        on_device_n,
        at_bound,
        other_lists,
        instructions,
    }
}

/// Every law. Columns: error behind a block, its median, error on the device, ticks at their bound, runs with other
/// stops or breakaways, instructions.
#[rustfmt::skip]
pub const LIMITS: [LawLimit; 16] = [
    law("karnopp",                         limit(1e-11, 1e-11), limit(1e-12, 1e-12), limit(10.0, 1e-10),   limit(0.0, 0.0),   limit(0.0, 0.0), [928.0, 5_430.0]),
    law("viscous",                         limit(1e-11, 1e-11), limit(1e-12, 1e-12), limit(1e-12, 1e-12),  limit(0.0, 0.0),   limit(0.0, 0.0), [196.0, 199.0]),
    law("karnopp, Stribeck",               limit(3.0, 1e-9),    limit(0.2, 1e-11),  limit(20.0, 1e-10),   limit(20.0, 0.0),  limit(4.0, 0.0), [12_400.0, 114_000.0]),
    law("karnopp, Stribeck and rising Fs", limit(3.0, 1e-9),    limit(0.2, 1e-11),  limit(0.0, 0.0),      limit(20.0, 0.0),  limit(4.0, 0.0), [6_900.0, 49_200.0]),
    law("karnopp, rising Fs",              limit(1e-9, 1e-9),   limit(1e-11, 1e-11), limit(0.0, 0.0),      limit(0.0, 0.0),   limit(0.0, 0.0), [961.0, 5_520.0]),
    law("dahl",                            limit(2e-4, 1e-9),   limit(3e-5, 1e-11),  limit(15.0, 1e-10),   limit(2.0, 0.0),   limit(0.0, 0.0), [12_600.0, 150_000.0]),
    law("dahl, i = 0",                     limit(1e-9, 1e-9),   limit(1e-11, 1e-11), limit(15.0, 1e-10),   limit(0.0, 0.0),   limit(0.0, 0.0), [3_550.0, 32_300.0]),
    law("dahl, i = 0.5",                   limit(2e-4, 1e-9),   limit(1e-4, 1e-11),  limit(15.0, 1e-10),   limit(2.0, 0.0),   limit(0.0, 0.0), [13_200.0, 167_000.0]),
    law("dahl, i = 2, asymmetric",         limit(3e-4, 1e-9),   limit(1e-4, 1e-11),  limit(15.0, 1e-10),   limit(2.0, 0.0),   limit(0.0, 0.0), [19_300.0, 211_000.0]),
    law("hayward-armstrong",               limit(1e-3, 1e-9),   limit(5e-5, 1e-11),  limit(15.0, 1e-10),   limit(4.0, 0.0),   limit(0.0, 0.0), [35_300.0, 280_000.0]),
    law("reset-integrator",                limit(1e-9, 1e-9),   limit(1e-11, 1e-11), limit(250.0, 1e-10),  limit(0.0, 0.0),   limit(0.0, 0.0), [2_920.0, 14_300.0]),
    law("lugre",                           limit(0.1, 1e-9),    limit(0.05, 1e-11),  limit(3000.0, 1e-10), limit(400.0, 0.0), limit(0.0, 0.0), [44_500.0, 392_000.0]),
    law("lugre, Fs = Fd",                  limit(0.1, 1e-9),    limit(0.05, 1e-11),  limit(3000.0, 1e-10), limit(400.0, 0.0), limit(0.0, 0.0), [29_000.0, 286_000.0]),
    law("elasto-plastic",                  limit(0.1, 1e-9),    limit(0.05, 1e-11),  limit(3000.0, 1e-10), limit(400.0, 0.0), limit(0.0, 0.0), [87_600.0, 857_000.0]),
    law("elasto-plastic, Fs = Fd",         limit(0.1, 1e-9),    limit(0.05, 1e-11),  limit(3000.0, 1e-10), limit(400.0, 0.0), limit(0.0, 0.0), [77_500.0, 847_000.0]),
    law("salcudean-vlaar",                 limit(1e-9, 1e-9),   limit(1e-11, 1e-11), limit(60.0, 1e-10),   limit(0.0, 0.0),   limit(0.0, 0.0), [2_870.0, 13_800.0]),
];

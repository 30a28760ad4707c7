//! What the paper's authors have published.

use crate::trial::Case;

/// Better and worse in time than the baseline: sums over 20 subjects and nine indices of difficulty, from the slides of
/// Richard and Cutkosky (2000).
pub(super) const TIMES: [(&str, [u64; 2]); 4] = [
    ("real", [74, 50]),
    ("simulated", [75, 43]),
    ("high stiction", [48, 88]),
    ("viscous", [80, 44]),
];

/// Just noticeable difference that the paper gives for a case, N.
#[expect(clippy::approx_constant, reason = "3.14 N is a force")]
pub(super) const fn jnd_n(case: Case) -> f64 {
    match case {
        Case::A => 0.78,
        Case::B => 3.14,
        Case::C => 0.36,
    }
}

/// The place of a resistance in the paper's tables; the same for all that it does not have.
pub(super) fn place(resistance: &str) -> usize {
    TIMES
        .iter()
        .position(|(name, _)| *name == resistance)
        .unwrap_or(TIMES.len())
}

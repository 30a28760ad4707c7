//! The model that predicts best what it has not seen, and is not more complex than necessary.
//!
//! The record is cut at its turns into blocks of whole strokes. Each fifth of them is left out in turn, every law is
//! fitted to the rest, and judged by the force that it predicts in the blocks left out. It is judged where the position
//! changes in sight: at rest a rigid contact holds whatever there is, and predicts nothing. Of the laws within one
//! standard error of the best, the simplest is chosen (Breiman, Friedman, Olshen and Stone 1984).

use super::grid::Even;
use super::options::{IdentifyError, Options, Progress};
use super::presliding::{self, Fit, PathLaw, PreparedRecord};
use super::result::ModelKind;
use crate::stats::mean::{deviation, mean};

/// Shares of the record that are left out in turn.
const FOLDS: usize = 5;
/// Blocks of each share.
const BLOCKS_A_FOLD: usize = 4;
/// The models, the simplest first.
const MODELS: [(ModelKind, PathLaw); 3] = [
    (ModelKind::Karnopp, PathLaw::Coulomb),
    (ModelKind::Dahl, PathLaw::Dahl),
    (ModelKind::Lugre, PathLaw::Lugre),
];

/// A model, and why it was chosen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Choice {
    /// The model.
    pub(super) model: ModelKind,
    /// The figures, for people.
    pub(super) because: String,
}

/// How well a model predicts.
struct Score {
    model: ModelKind,
    /// Mean square of the force that it does not predict, block by block, N^2.
    squares: Vec<f64>,
}

impl Score {
    fn mean(&self) -> f64 {
        mean(&self.squares)
    }

    /// By how much this is worse than another, and the standard error of that, N^2.
    fn worse_than(&self, other: &Self) -> (f64, f64) {
        let pairs = self.squares.iter().zip(&other.squares);
        let differences: Vec<f64> = pairs.map(|(one, two)| one - two).collect();
        let count = differences.len() as f64;
        (mean(&differences), deviation(&differences) / count.sqrt())
    }
}

/// Chooses a model for a record.
///
/// # Errors
/// The caller cancels.
pub(super) fn choose(even: &Even, options: &Options, progress: &mut Progress<'_>) -> Result<Choice, IdentifyError> {
    let simplest = |why: &str| Choice {
        model: ModelKind::Karnopp,
        because: format!("{why}, so that the simplest model was taken"),
    };
    let prepared = match presliding::find(even, PathLaw::Dahl, options) {
        Ok(presliding::Found { prepared, .. }) => prepared,
        Err((why, _)) => {
            return Ok(simplest(&format!(
                "laws that deflect before they slide do not fit the record (dahl: {why})"
            )));
        }
    };
    let blocks = blocks(&prepared);
    if blocks.len() < FOLDS {
        return Ok(simplest("there are too few strokes to leave some out"));
    }
    let mut scores = Vec::new();
    for (place, &(model, law)) in MODELS.iter().enumerate() {
        progress.at((place + 1) as f64 / (MODELS.len() + 1) as f64)?;
        scores.extend(score(&prepared, model, law, &blocks, options));
    }
    Ok(pick(&scores).unwrap_or_else(|| simplest("no model could be fitted to a part of the record")))
}

/// The simplest within one standard error of the best.
fn pick(scores: &[Score]) -> Option<Choice> {
    let best = scores.iter().min_by(|one, two| one.mean().total_cmp(&two.mean()))?;
    let (chosen, (worse, error)) = scores
        .iter()
        .map(|score| (score, score.worse_than(best)))
        .find(|(score, (worse, error))| score.model == best.model || worse <= error)?;
    let figures: Vec<String> = scores
        .iter()
        .map(|score| format!("{} {:.4} N", score.model.word(), score.mean().sqrt()))
        .collect();
    let verdict = if chosen.model == best.model {
        String::from("is the best, and no simpler one is within one standard error of it")
    } else {
        format!(
            "is the simplest within one standard error of {}, the best: its mean square is worse by {worse:.2e} N^2, \
             with a standard error of {error:.2e} N^2",
            best.model.word()
        )
    };
    Some(Choice {
        model: chosen.model,
        because: format!(
            "strokes that were left out of the fit are predicted to, rms: {}; {} {verdict}",
            figures.join(", "),
            chosen.model.word()
        ),
    })
}

/// The rows of each block of whole strokes.
fn blocks(prepared: &PreparedRecord) -> Vec<Vec<usize>> {
    let turns = prepared.turns();
    let samples = prepared.path.smooth_m.len();
    let mut ends: Vec<usize> = (1..FOLDS * BLOCKS_A_FOLD)
        .map(|block| {
            let wanted = block * samples / (FOLDS * BLOCKS_A_FOLD);
            turns
                .iter()
                .copied()
                .min_by_key(|turn| turn.abs_diff(wanted))
                .unwrap_or(wanted)
        })
        .collect();
    ends.dedup();
    let mut blocks = vec![Vec::new(); ends.len() + 1];
    for row in prepared.rows.moving() {
        let middle = prepared.rows.middle(row);
        blocks[ends.partition_point(|end| *end <= middle)].push(row);
    }
    blocks.retain(|rows| !rows.is_empty());
    blocks
}

/// What a model predicts of each block when the share of the record that it belongs to is left out.
fn score(
    prepared: &PreparedRecord,
    model: ModelKind,
    law: PathLaw,
    blocks: &[Vec<usize>],
    options: &Options,
) -> Option<Score> {
    let seen: Vec<usize> = if law == PathLaw::Coulomb {
        prepared.rows.moving()
    } else {
        prepared.all()
    };
    let (whole, assumed) = prepared.find(law, &seen, options, None)?;
    let mut squares = vec![0.0; blocks.len()];
    for fold in 0..FOLDS {
        let mut is_left_out = vec![false; prepared.rows.len()];
        for block in blocks.iter().skip(fold).step_by(FOLDS) {
            // What lies between the rows that move belongs to the block as well.
            is_left_out[block[0]..=block[block.len() - 1]].fill(true);
        }
        let kept: Vec<usize> = seen.iter().copied().filter(|&row| !is_left_out[row]).collect();
        let Fit { residual, .. } = prepared.refine(&kept, &assumed, &whole.estimate, 1e-6)?;
        for (square, block) in squares.iter_mut().zip(blocks).skip(fold).step_by(FOLDS) {
            *square = block.iter().map(|&row| residual[row].powi(2)).sum::<f64>() / block.len() as f64;
        }
    }
    Some(Score { model, squares })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(squares: [[f64; 4]; 3]) -> Vec<Score> {
        MODELS
            .iter()
            .zip(squares)
            .map(|((model, _), squares)| Score {
                model: *model,
                squares: squares.to_vec(),
            })
            .collect()
    }

    #[test]
    fn the_simplest_within_one_standard_error_is_picked() {
        let alike = [[1.0, 2.0, 3.0, 4.0], [1.1, 1.8, 3.1, 3.9], [0.9, 2.1, 2.9, 3.9]];
        let choice = pick(&scores(alike)).expect("there are scores");
        assert_eq!(choice.model, ModelKind::Karnopp);
        assert!(choice.because.contains("standard error of lugre"), "{}", choice.because);
        let dahl = [[2.0, 3.0, 4.0, 5.0], [1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 3.99]];
        assert_eq!(pick(&scores(dahl)).expect("there are scores").model, ModelKind::Dahl);
        let lugre = [[2.0, 3.0, 4.0, 5.0], [1.5, 2.5, 3.5, 4.5], [1.0, 2.0, 3.0, 4.1]];
        assert_eq!(pick(&scores(lugre)).expect("there are scores").model, ModelKind::Lugre);
    }
}

//! What people will meet: each law's force error and its cost, hand by hand and block by block,
//! with the ticks in which something happens apart from the others.

use super::error::worse;
use super::hands::{self, HANDS, MASSES_KG};
use super::reference;
use crate::motion::DeviceSample;
use crate::simulate::{ContactChange, SimulatedRow, Simulation, Start, TickCost, simulate, tick_cost};
use haptic_core::block::Contact;
use haptic_core::friction::Friction;
use haptic_core::{Scene, SceneError, Scheme};
use haptic_motion::median::median;

/// A law under a hand, behind a block or on the device.
#[derive(Clone, Debug)]
pub struct LawCase {
    /// Name of the law.
    pub law: &'static str,
    /// The hand; none for ticks drawn at random.
    pub hand: &'static str,
    /// Mass of the block, kg; none on the device itself.
    pub mass_kg: Option<f64>,
    /// The scene.
    pub scene: Scene,
    /// The device's motion.
    pub motion: Vec<DeviceSample>,
}

/// Name of the hand of ticks drawn at random.
pub const SINGLE_TICKS: &str = "single ticks";

/// Every law under every hand: behind blocks, then on the device, where no reference has a limit
/// that rises with rest. `samples` are those of a motion.
#[must_use]
pub fn law_cases(samples: usize) -> Vec<LawCase> {
    let mut cases = Vec::new();
    let laws = hands::laws_under_hands();
    for &(law, friction) in &laws {
        for mass in MASSES_KG {
            for hand in HANDS {
                cases.push(LawCase {
                    law,
                    hand: hand.name,
                    mass_kg: Some(mass),
                    scene: hands::behind_block(friction, mass),
                    motion: hand.motion(samples),
                });
            }
        }
    }
    for (law, friction) in laws {
        if matches!(friction, Friction::Karnopp(law) if law.rising_rate > 0.0) {
            continue;
        }
        for hand in HANDS {
            cases.push(LawCase {
                law,
                hand: hand.name,
                mass_kg: None,
                scene: hands::on_device(friction),
                motion: hand.motion_on_device(samples),
            });
        }
    }
    cases
}

/// The schemes compared under hands.
#[must_use]
pub fn schemes_by_law() -> [Scheme; 3] {
    [Scheme::Exact, Scheme::LITERAL, Scheme::Implicit]
}

/// Force errors, N.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ForceErrors {
    /// Ticks that count: not at their bound of work, and none before them was.
    pub ticks: usize,
    /// The median.
    pub median_n: f64,
    /// The worst tick with a breakaway in it; 0 without one.
    pub breakaway_n: f64,
    /// The worst tick in which the block turned round or came to rest, or on the device the hand;
    /// 0 without one.
    pub reversal_n: f64,
    /// The worst tick of all.
    pub worst_n: f64,
    /// Ticks at their bound of work.
    pub at_bound: usize,
    /// The worst error of these, and of the ticks that inherit it.
    pub at_bound_worst_n: f64,
    /// Whether the stops and breakaways are the truth's; none for laws that have no stuck state.
    pub same_changes: Option<bool>,
    /// The reference's own error.
    pub uncertainty_n: f64,
}

/// One law with one scheme under one hand.
#[derive(Clone, Debug, PartialEq)]
pub struct LawMeasurement {
    /// Name of the law.
    pub law: &'static str,
    /// The scheme.
    pub scheme: Scheme,
    /// The hand.
    pub hand: &'static str,
    /// Mass of the block, kg; none on the device itself.
    pub mass_kg: Option<f64>,
    /// Errors of the force.
    pub errors: ForceErrors,
    /// Cost of a tick; none where it was not measured.
    pub cost: Option<TickCost>,
    /// Instructions a tick, over the motion; none where they were not counted.
    pub instructions: Option<f64>,
}

impl LawMeasurement {
    /// Whether the law is on the device itself.
    #[must_use]
    pub fn is_on_device(&self) -> bool {
        self.mass_kg.is_none() && self.hand != SINGLE_TICKS
    }
}

/// The worst of several measurements: their ticks together, and the greatest of each error, the
/// medians' included.
#[must_use]
pub fn worst_of<'a>(measurements: impl IntoIterator<Item = &'a LawMeasurement>) -> ForceErrors {
    measurements
        .into_iter()
        .fold(ForceErrors::default(), |worst, measurement| {
            let one = &measurement.errors;
            ForceErrors {
                ticks: worst.ticks + one.ticks,
                median_n: worse(worst.median_n, one.median_n),
                breakaway_n: worse(worst.breakaway_n, one.breakaway_n),
                reversal_n: worse(worst.reversal_n, one.reversal_n),
                worst_n: worse(worst.worst_n, one.worst_n),
                at_bound: worst.at_bound + one.at_bound,
                at_bound_worst_n: worse(worst.at_bound_worst_n, one.at_bound_worst_n),
                same_changes: match (worst.same_changes, one.same_changes) {
                    (Some(a), Some(b)) => Some(a && b),
                    (a, b) => a.or(b),
                },
                uncertainty_n: worse(worst.uncertainty_n, one.uncertainty_n),
            }
        })
}

/// How long the runs of [`measure_laws`] are.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Samples of a hand's motion.
    pub samples: usize,
    /// Single ticks of each law.
    pub single_ticks: usize,
    /// Whether costs are measured.
    pub timed: bool,
}

impl Extent {
    /// What the report takes.
    pub const REPORT: Self = Self {
        samples: 300,
        single_ticks: 600,
        timed: true,
    };
}

/// Runs every law under every hand, and its single ticks. `instructions` are the totals of
/// [`Probe::Hands`](crate::cost::Probe); `progress` hears of each case.
///
/// # Errors
/// A scene cannot be rendered.
pub fn measure_laws(
    extent: Extent,
    instructions: Option<&[u64]>,
    mut progress: impl FnMut(&str),
) -> Result<Vec<LawMeasurement>, SceneError> {
    let mut measurements = Vec::new();
    let schemes = schemes_by_law().len();
    for (index, case) in law_cases(extent.samples).iter().enumerate() {
        progress(case.law);
        let counted = instructions.and_then(|totals| totals.chunks(schemes).nth(index));
        measurements.extend(measure_law(case, extent.timed, counted)?);
    }
    for (law, friction) in hands::laws_under_hands() {
        progress(law);
        measurements.extend(measure_single_ticks(law, friction, extent.single_ticks)?);
    }
    Ok(measurements)
}

/// Runs a case with every scheme of [`schemes_by_law`]. `instructions` are the totals of a
/// [probe](crate::cost::Probe), scheme by scheme. Costs are measured where `timed`.
///
/// # Errors
/// The scene cannot be rendered at the rate of its motion.
pub fn measure_law(
    case: &LawCase,
    timed: bool,
    instructions: Option<&[u64]>,
) -> Result<Vec<LawMeasurement>, SceneError> {
    let truth = reference::solve(&case.scene, &case.motion, Start::default());
    let uncertainty_n = reference::uncertainty_n(&case.scene, &case.motion, Start::default(), &truth);
    schemes_by_law()
        .into_iter()
        .enumerate()
        .map(|(index, scheme)| {
            let run = simulate(&case.scene, scheme, &case.motion, Start::default())?;
            let cost = timed
                .then(|| tick_cost(&case.scene, scheme, &case.motion))
                .transpose()?;
            Ok(LawMeasurement {
                law: case.law,
                scheme,
                hand: case.hand,
                mass_kg: case.mass_kg,
                errors: ForceErrors {
                    uncertainty_n,
                    ..force_errors(&case.scene, &run, &truth)
                },
                cost,
                instructions: instructions
                    .and_then(|totals| totals.get(index))
                    .map(|total| crate::motion::per_tick(*total, &case.motion)),
            })
        })
        .collect()
}

/// The errors of a law over a number of [single ticks](hands::single_ticks) with each scheme, with an
/// error of the reference.
///
/// # Errors
/// Never in practice: the scenes are valid.
pub fn measure_single_ticks(
    law: &'static str,
    friction: Friction,
    count: usize,
) -> Result<Vec<LawMeasurement>, SceneError> {
    let ticks: Vec<_> = hands::single_ticks(friction).take(count).collect();
    let truths: Vec<Simulation> = ticks
        .iter()
        .map(|tick| reference::solve(&tick.scene, &tick.motion, tick.start))
        .collect();
    let uncertainty_n = ticks
        .iter()
        .zip(&truths)
        .map(|(tick, truth)| reference::uncertainty_n(&tick.scene, &tick.motion, tick.start, truth))
        .fold(0.0, worse);
    schemes_by_law()
        .into_iter()
        .map(|scheme| {
            let (mut errors, mut all) = (Tally::default(), ForceErrors::default());
            all.same_changes = reference::has_stuck_state(&friction).then_some(true);
            for (tick, truth) in ticks.iter().zip(&truths) {
                let run = simulate(&tick.scene, scheme, &tick.motion, tick.start)?;
                let one = force_errors(&tick.scene, &run, truth);
                // The first row is the start, and no tick.
                let error = difference(&run.rows[1], &truth.rows[1]);
                errors.take(error, run.exhausted_ticks > 0);
                all.breakaway_n = all.breakaway_n.max(one.breakaway_n);
                all.reversal_n = all.reversal_n.max(one.reversal_n);
                all.same_changes = all.same_changes.map(|same| same && one.same_changes == Some(true));
            }
            Ok(LawMeasurement {
                law,
                scheme,
                hand: SINGLE_TICKS,
                mass_kg: None,
                errors: ForceErrors {
                    uncertainty_n,
                    ..errors.into_errors(all)
                },
                cost: None,
                instructions: None,
            })
        })
        .collect()
}

/// Errors as they are measured.
#[derive(Default)]
struct Tally {
    counted: Vec<f64>,
    at_bound: usize,
    at_bound_worst_n: f64,
}

impl Tally {
    fn take(&mut self, error: f64, at_bound: bool) {
        if at_bound {
            self.at_bound += 1;
            self.at_bound_worst_n = self.at_bound_worst_n.max(error);
        } else {
            self.counted.push(error);
        }
    }

    fn into_errors(mut self, rest: ForceErrors) -> ForceErrors {
        ForceErrors {
            ticks: self.counted.len(),
            median_n: median(&mut self.counted).unwrap_or(0.0),
            worst_n: self.counted.iter().copied().fold(0.0, f64::max),
            at_bound: self.at_bound,
            at_bound_worst_n: self.at_bound_worst_n,
            ..rest
        }
    }
}

fn difference(run: &SimulatedRow, truth: &SimulatedRow) -> f64 {
    worse(0.0, (run.coupling_force_n - truth.coupling_force_n).abs())
}

fn force_errors(scene: &Scene, run: &Simulation, truth: &Simulation) -> ForceErrors {
    let mut tally = Tally::default();
    let (mut breakaway_n, mut reversal_n) = (0.0_f64, 0.0_f64);
    let mut inherited_n = 0.0_f64;
    let velocity = |row: &SimulatedRow| {
        if scene.block.is_some() {
            row.block_velocity_mps
        } else {
            row.device.velocity_mps
        }
    };
    let broke_away = |from_s: f64, to_s: f64| {
        let within = |event: &ContactChange| event.t_s > from_s && event.t_s <= to_s;
        truth
            .events
            .iter()
            .any(|event| within(event) && event.from == Contact::Stuck)
    };
    for (k, (row, true_row)) in run.rows.iter().zip(&truth.rows).enumerate().skip(1) {
        let error = difference(row, true_row);
        let before = &truth.rows[k - 1];
        if row.at_bound {
            tally.take(error, true);
            continue;
        }
        if tally.at_bound > 0 {
            inherited_n = inherited_n.max(error);
            continue;
        }
        tally.take(error, false);
        if broke_away(before.device.t_s, true_row.device.t_s)
            || (before.contact == Contact::Stuck && true_row.contact != Contact::Stuck)
        {
            breakaway_n = breakaway_n.max(error);
        }
        if velocity(before) * velocity(true_row) <= 0.0 && velocity(before) != 0.0 {
            reversal_n = reversal_n.max(error);
        }
    }
    let same_changes = (scene.block.is_some() && reference::has_stuck_state(&scene.friction)).then(|| {
        let kinds = |events: &[ContactChange]| events.iter().map(|event| (event.from, event.to)).collect::<Vec<_>>();
        kinds(&run.events) == kinds(&truth.events)
    });
    let mut errors = tally.into_errors(ForceErrors {
        breakaway_n,
        reversal_n,
        same_changes,
        ..ForceErrors::default()
    });
    errors.at_bound_worst_n = errors.at_bound_worst_n.max(inherited_n);
    errors
}

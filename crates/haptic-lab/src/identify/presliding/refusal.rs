//! What a record cannot determine: first by physics, then by how far the fits to drawn records scatter.

use super::super::result::{Interval, Refusal, unit};
use super::find::PreparedRecord;
use super::fit::{Assumptions, Estimate};
use super::laws::PathLaw;
use super::quantity::Quantity;

/// Fewest steps of the encoder by which a surface must give way, or the steps are taken for it.
pub(super) const MIN_STEPS: f64 = 3.0;
/// The same for the stiffness, which is off by up to 8 % with fewer, as the steps lie: with five it is within 3 %.
const MIN_STEPS_FOR_STIFFNESS: f64 = 5.0;
/// The same for the exponent, which bends the curve between rest and limit: with fewer it is off by up to 10 %.
const MIN_STEPS_FOR_EXPONENT: f64 = 9.0;
/// Over shorter strokes, in steps of the encoder, what smoothing leaves of the steps bends the whole law.
const MIN_STROKE_STEPS: f64 = 100.0;
/// Fewest turns that show how a surface gives way.
const MIN_TURNS: usize = 4;
/// Deflection at which a limit is reached, in multiples of `Fd/sigma`.
const DEFLECTIONS_TO_LIMIT: f64 = 4.0;
/// Fewest rows of slow, and of fast, sliding that show Stribeck's fall.
const MIN_ROWS: usize = 30;

/// Why the motion itself cannot determine some of the quantities, whatever a fit says.
pub(crate) fn by_physics(prepared: &PreparedRecord, estimate: &Estimate, assumed: &Assumptions) -> Vec<Refusal> {
    let path = &prepared.path;
    let step = path.resolution_m;
    let (farthest, turns) = (path.longest_stroke(step), prepared.turns().len());
    let limit = estimate.values[PathLaw::DYNAMIC].max(estimate.values[PathLaw::DYNAMIC + 1]);
    let deflection = limit / estimate.values[PathLaw::STIFFNESS];
    let mut refused = Refusals::default();
    if turns < MIN_TURNS {
        refused.add(
            &PRESLIDING,
            &format!("the motion turns {turns} times; how a surface gives way shows after a turn alone"),
            "move to and fro, with at least ten turns",
        );
    }
    if goes_one_way(prepared) {
        refused.add(
            &["dynamic_force_N", "viscous_Ns_per_m", "static_force_N", "offset_N"],
            "the motion goes one way; what rubs and what pushes steadily look alike there",
            "record motion in both directions",
        );
    } else if !assumed.alike && assumed.offset_n.is_some() && !prepared.knows_offset {
        refused.add(
            &["offset_N"],
            "a constant force looks like limits that differ by direction; zero was assumed",
            "give the constant force, or zero the sensor",
        );
    }
    short_strokes(&mut refused, farthest, deflection, step);
    for (parameters, fewest) in [
        (
            &["stiffness_N_per_m", "bristle_damping_Ns_per_m"][..],
            MIN_STEPS_FOR_STIFFNESS,
        ),
        (&["exponent"], MIN_STEPS_FOR_EXPONENT),
    ] {
        if let Some(reason) = hidden(fewest, prepared, estimate) {
            refused.add(
                parameters,
                &reason,
                "record with an encoder whose step is a tenth of that or finer; karnopp's model does without it",
            );
        }
    }
    if let Some(reason) = hidden_fall(prepared, estimate) {
        refused.add(
            &["static_force_N", "stribeck_velocity_mps"],
            &reason,
            "record ramps of 0.5 to 1 mm/s beside fast strokes",
        );
    }
    // Each reason names what any law may have.
    let unknown = Assumptions {
        mass_kg: None,
        offset_n: None,
        ..*assumed
    };
    let of_law = Quantity::of(estimate.law, &unknown);
    let has = |refusal: &Refusal| of_law.iter().any(|quantity| quantity.parameter() == refusal.parameter);
    refused.0.into_iter().filter(has).collect()
}

/// Refuses what strokes, m at the longest, do not show of a surface that gives way by a deflection, m, through an
/// encoder of a step, m.
fn short_strokes(refused: &mut Refusals, farthest: f64, deflection: f64, step: f64) {
    if farthest < DEFLECTIONS_TO_LIMIT * deflection {
        refused.add(
            &[
                "dynamic_force_N",
                "viscous_Ns_per_m",
                "static_force_N",
                "stribeck_velocity_mps",
                "exponent",
            ],
            &format!(
                "the longest stroke of {:.3} mm is less than {DEFLECTIONS_TO_LIMIT} times the deflection Fd/sigma = \
                 {:.3} mm, so no slide reaches its limit",
                farthest * 1e3,
                deflection * 1e3
            ),
            "record strokes of 10 mm and more",
        );
    }
    if farthest < MIN_STROKE_STEPS * step {
        let reason = format!(
            "the longest stroke of {:.3} mm is less than {MIN_STROKE_STEPS} steps of the encoder ({:.1} um)",
            farthest * 1e3,
            step * 1e6
        );
        refused.add(
            &[
                "dynamic_force_N",
                "viscous_Ns_per_m",
                "static_force_N",
                "stribeck_velocity_mps",
                "offset_N",
            ],
            &reason,
            "record strokes of 10 mm and more beside the short ones",
        );
        refused.add(
            &PRESLIDING,
            &reason,
            "record strokes of 10 mm and more beside the short ones, or with a finer encoder",
        );
    }
}

/// Why Stribeck's fall does not show, where the law has one.
fn hidden_fall(prepared: &PreparedRecord, estimate: &Estimate) -> Option<String> {
    if estimate.law != PathLaw::Lugre {
        return None;
    }
    let fall = estimate.values[PathLaw::STRIBECK];
    let rows = prepared.rows.moving();
    let speeds = rows.iter().map(|&row| prepared.speed(row).abs());
    let (slow, fast) = speeds.fold((0, 0), |(slow, fast), speed| {
        (slow + usize::from(speed < fall), fast + usize::from(speed > 2.0 * fall))
    });
    (slow < MIN_ROWS || fast < MIN_ROWS).then(|| {
        format!(
            "Stribeck's fall shows between sliding slower and faster than the Stribeck velocity, {:.2} mm/s by the \
             fit; there are {slow} moments of the one and {fast} of the other",
            fall * 1e3
        )
    })
}

/// Why the encoder hides how the surface gives way, which must be by so many of its steps; `None` where it does not. All
/// of the law leans on the fewest: a fit makes of the steps what it likes.
pub(crate) fn hidden(fewest_steps: f64, prepared: &PreparedRecord, estimate: &Estimate) -> Option<String> {
    let step = prepared.path.resolution_m;
    let limit = estimate.values[PathLaw::DYNAMIC].max(estimate.values[PathLaw::DYNAMIC + 1]);
    let deflection = limit / estimate.values[PathLaw::STIFFNESS];
    (deflection < fewest_steps * step).then(|| {
        format!(
            "the surface gives way by about Fd/sigma = {:.1} um, less than {fewest_steps} times the encoder's step of \
             {:.1} um",
            deflection * 1e6,
            step * 1e6
        )
    })
}

/// Whether there is too little motion in one of the directions.
pub(crate) fn goes_one_way(prepared: &PreparedRecord) -> bool {
    prepared.sides().into_iter().any(|rows| rows < MIN_ROWS)
}

/// What shows only about a turn.
const PRESLIDING: [&str; 3] = ["stiffness_N_per_m", "exponent", "bristle_damping_Ns_per_m"];

/// The refusal of a quantity whose interval is too wide to be of use; `None` where it is not.
pub(crate) fn by_interval(
    quantity: Quantity,
    [low, high]: Interval,
    prepared: &PreparedRecord,
    estimate: &Estimate,
) -> Option<Refusal> {
    let limit = estimate.values[PathLaw::DYNAMIC];
    let half = 0.5 * (high - low);
    let middle = 0.5 * (high + low).abs();
    let fastest = prepared.fastest_mps();
    let share = |most: f64| half > most * middle;
    let (is_too_wide, reason, instead) = match quantity {
        Quantity::Mass => {
            let inertia = middle * prepared.rows.acceleration_rms();
            (
                share(0.2),
                format!(
                    "its inertia is {inertia:.3} N rms, beside {:.3} N that the fit leaves",
                    prepared.coulomb.rms_n
                ),
                "record faster strokes of 10 mm and more, 2 to 3 Hz",
            )
        }
        Quantity::Dynamic(_) => (
            share(0.15),
            String::from("few slides reach their limit"),
            "record strokes of 10 mm and more in both directions",
        ),
        Quantity::Static(_) => (
            share(0.15),
            String::from("little of the record slides so slowly that it shows the fall to dynamic friction"),
            "record ramps of 0.5 to 1 mm/s beside fast strokes",
        ),
        Quantity::Offset => (
            half > 0.3 * limit,
            String::from("few slides reach their limit"),
            "record motion in both directions",
        ),
        Quantity::Viscous(_) => (
            half > 0.25 * middle && half * fastest.max(0.3) > 0.1 * limit,
            format!("the fastest motion is {:.1} mm/s", fastest * 1e3),
            "record strokes of 10 mm and more, slow and fast",
        ),
        Quantity::Stiffness | Quantity::Exponent => (
            share(0.3),
            format!(
                "the surface gives way by {:.1} um, which the encoder's step of {:.1} um hides",
                limit / estimate.values[PathLaw::STIFFNESS] * 1e6,
                prepared.path.resolution_m * 1e6
            ),
            "record more turns, slow ones, with a finer encoder",
        ),
        Quantity::Stribeck => (
            share(0.5),
            String::from("too little of the fall from static to dynamic friction shows"),
            "record ramps at several speeds between 0.5 and 50 mm/s",
        ),
        Quantity::Damping => (
            share(0.5),
            String::from("it acts while the surface gives way quickly, which the motion hardly does"),
            "record vibration within presliding: tens of micrometres at 20 Hz and more, with a fine encoder",
        ),
    };
    let reason = format!(
        "{reason}; the 95 % interval is {low:.4} to {high:.4} {}",
        unit(quantity.parameter())
    );
    is_too_wide.then(|| Refusal::new(quantity.parameter(), &reason, instead))
}

#[derive(Default)]
struct Refusals(Vec<Refusal>);

impl Refusals {
    /// Each parameter is refused for the first reason that there is.
    fn add(&mut self, parameters: &[&str], reason: &str, instead: &str) {
        for &parameter in parameters {
            if self.0.iter().all(|refusal| refusal.parameter != parameter) {
                self.0.push(Refusal::new(parameter, reason, instead));
            }
        }
    }
}

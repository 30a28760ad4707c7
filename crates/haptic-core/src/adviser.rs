//! What a scene will do to a rig before anybody feels it: the known bounds on stability, passivity
//! and chatter, each with its margin and with the value that would fix it.
//!
//! | check | bound | source |
//! |---|---|---|
//! | limit cycle | `V = 2 Fd T / (4 M - K T^2 - 2 (B + b) T)`, literal scheme only; the exact scheme has none | derived from the scheme |
//! | least mass | `M >= K T^2/4 + (B + b) T/2`, literal scheme only | derived from the scheme |
//! | ripple | `V (K T/2 + B)` felt by the hand, literal scheme only | derived from the scheme |
//! | passivity | `b_rig >= K T/2 + B` | Colgate and Schenkel 1997 |
//! | linear stability | `K <= 2 (b_rig + B) / (T + 2 tau)`, block stuck | linear analysis of the sampled loop; with delay Gil, Sanchez, Hulin, Preusche and Hirzinger 2009 |
//! | friction | `K <= 2 f / (v (T + 2 tau))`: the rig's own Coulomb friction takes up what sampling creates at speed v | energy per period |
//! | encoder | `K <= 2 f / Delta`: the same for what counting creates | Abbott and Okamura 2005 |
//! | friction passivity | `b >= sigma1 (Fs/Fd - 1)`, LuGre only: else the law itself can give out energy | Barabanov and Ortega 2000 |
//!
//! `T` is the time between two forces that differ: the longer of the loop's period and of the
//! device's, since a force from an old sample is the old force again. `tau` is the time from a
//! sample to the motor that knows it. Behind a link it is measured: the round trip, from a
//! command's sending to the arrival of the first sample that knows it, is at most a period longer
//! than the way there and back, so it bounds `tau` from above; what the newest sample's age exceeds
//! a period of each side by comes on top, because then samples come late or are lost. A force that
//! holds for `T` acts `T/2` late in the mean, and so the two add up to `T/2 + tau`. In the first
//! three, `T` is the step of the scheme, which the device does not change.
//!
//! On the device itself, without a block, `K` is the stiffness of the contact and `B` its damping
//! and drag. The first three are about the scheme, the others about the hand in the loop. Those are
//! sufficient or necessary for worst cases: a rig whose hand damps well may do fine beyond them,
//! which is why this advises and does not refuse.

use crate::direction::Direction;
use crate::directional::Directional;
use crate::parameters::Parameter;
use crate::scene::Scene;
use crate::scheme::Scheme;
use alloc::vec::Vec;
use core::fmt;

/// Facts of a rig that the adviser needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigFacts {
    /// Time between ticks, s.
    pub period_s: f64,
    /// Time between two samples of the device, s; 0 where it measures whenever it is read.
    pub sample_period_s: f64,
    /// From a sample to the motor that gives the force for it, s.
    pub delay_s: f64,
    /// Viscous damping of the rig itself, N s/m.
    pub damping: f64,
    /// Coulomb friction of the rig itself, N.
    pub friction: f64,
    /// One count of the encoder, m; 0 for a perfect one.
    pub resolution: f64,
}

impl RigFacts {
    /// Time between two forces that differ, s.
    #[must_use]
    pub fn effective_period_s(&self) -> f64 {
        self.period_s.max(self.sample_period_s)
    }
}

/// Measured times of the link to a rig, s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkTimes {
    /// Time between two samples of the device.
    pub sample_period_s: f64,
    /// From the sending of a command to the arrival of the first sample that knows it.
    pub round_trip_s: f64,
    /// How old a sample gets before the next one is there.
    pub age_s: f64,
}

impl LinkTimes {
    /// From a sample to the motor that gives the force for it, s, for a loop with such a period.
    /// Before anything is measured it is a period of the slower side.
    #[must_use]
    pub fn delay_s(&self, period_s: f64) -> f64 {
        if self.round_trip_s <= 0.0 {
            return period_s.max(self.sample_period_s);
        }
        // Until the next sample comes a sample grows as old as a period of the device's, and is
        // read up to one of ours later: that is `T`, not delay.
        self.round_trip_s + (self.age_s - self.sample_period_s - period_s).max(0.0)
    }
}

/// Speed, m/s, at which the rig's own friction is held against what sampling creates: the fastest
/// that a hand usually goes when it explores.
pub const EXPLORING_SPEED_MPS: f64 = 0.1;

/// Ripple, N, that a hand does not feel in this band.
pub const UNFELT_RIPPLE_N: f64 = 0.05;

/// Limit cycle, m/s, below which a block counts as at rest.
pub const UNSEEN_LIMIT_CYCLE_MPS: f64 = 1e-4;

/// A check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// Velocity amplitude of the literal scheme's limit cycle.
    LimitCycle,
    /// Mass below which the literal scheme diverges.
    LeastMass,
    /// Force ripple of the limit cycle.
    Ripple,
    /// Passivity of the sampled coupling.
    Passivity,
    /// Linear stability against a stuck block, with delay.
    LinearStability,
    /// Energy of sampling against the rig's own friction.
    Friction,
    /// Energy of counting against the rig's own friction.
    Encoder,
    /// Energy that LuGre's law itself can give out.
    FrictionPassivity,
}

impl Check {
    /// A short name, the same on the wire and on paper.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::LimitCycle => "limit_cycle",
            Self::LeastMass => "least_mass",
            Self::Ripple => "ripple",
            Self::Passivity => "passivity",
            Self::LinearStability => "linear_stability",
            Self::Friction => "friction",
            Self::Encoder => "encoder",
            Self::FrictionPassivity => "friction_passivity",
        }
    }
}

/// A value that would fix a broken bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// The parameter to change.
    pub parameter: Parameter,
    /// To this, in its unit.
    pub value: f64,
}

/// Result of a check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// The check.
    pub check: Check,
    /// The parameter that it concerns most.
    pub parameter: Parameter,
    /// Whether the scene keeps the bound.
    pub passes: bool,
    /// The scene's value.
    pub value: f64,
    /// The bound on it.
    pub bound: f64,
    /// Unit of both.
    pub unit: &'static str,
    /// How far inside the bound the scene is, as a ratio: 2 is twice as far as needed, below 1 it
    /// is broken.
    pub margin: f64,
    /// The value that would fix a broken bound, where one parameter can.
    pub fix: Option<Fix>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.check {
            Check::LimitCycle => "the block at rest trembles",
            Check::LeastMass => "the scheme diverges below a least mass",
            Check::Ripple => "the trembling block is felt as a ripple",
            Check::Passivity => "the coupling can give out energy, more than the rig's own damping takes up",
            Check::LinearStability => "against a stuck block the loop oscillates by itself",
            Check::Friction => "in motion, sampling creates more energy than the rig's own friction takes up",
            Check::Encoder => "counting creates more energy than the rig's own friction takes up",
            Check::FrictionPassivity => "the friction law itself can give out energy, more than its drag takes up",
        };
        write!(
            f,
            "{what}: {} {} with a bound of {} {}",
            Rounded(self.value),
            self.unit,
            Rounded(self.bound),
            self.unit
        )?;
        if let Some(Fix { parameter, value }) = self.fix {
            let info = parameter.info();
            write!(f, "; {} = {} {} would fix it", info.name, Rounded(value), info.unit)?;
        }
        Ok(())
    }
}

/// Four significant digits, as people read them.
struct Rounded(f64);

impl fmt::Display for Rounded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.0;
        match value.abs() {
            0.0 => f.write_str("0"),
            size if !(1e-3..1e6).contains(&size) => write!(f, "{value:.3e}"),
            size if size >= 1000.0 => write!(f, "{value:.0}"),
            size if size >= 10.0 => write!(f, "{value:.2}"),
            _ => write!(f, "{value:.4}"),
        }
    }
}

/// Subject of a check, and the value that would fix it where one parameter can.
#[derive(Clone, Copy)]
struct About {
    check: Check,
    parameter: Parameter,
    unit: &'static str,
    fixed_by: Option<f64>,
}

/// A bound that a value must not exceed.
fn at_most(about: About, value: f64, bound: f64) -> Finding {
    finding(about, value, bound, value <= bound, bound / value)
}

/// A bound that a value must reach.
fn at_least(about: About, value: f64, bound: f64) -> Finding {
    finding(about, value, bound, value >= bound, value / bound)
}

fn finding(about: About, value: f64, bound: f64, passes: bool, margin: f64) -> Finding {
    let About {
        check,
        parameter,
        unit,
        fixed_by,
    } = about;
    Finding {
        check,
        parameter,
        passes,
        value,
        bound,
        unit,
        // Nothing against nothing is neither kept well nor badly.
        margin: if margin.is_nan() { 1.0 } else { margin },
        fix: fixed_by.filter(|_| !passes).map(|value| Fix { parameter, value }),
    }
}

/// Holds a valid scene against every bound that concerns it. Pure: the same scene on the same rig
/// gives the same advice.
#[must_use]
pub fn advise(scene: &Scene, scheme: Scheme, rig: &RigFacts) -> Vec<Finding> {
    let mut findings = Vec::with_capacity(8);
    if let Scheme::Literal { substeps } = scheme {
        literal_scheme(scene, rig.period_s / f64::from(substeps.get()), &mut findings);
    }
    hand_in_the_loop(scene, rig, &mut findings);
    friction_passivity(scene, &mut findings);
    findings
}

fn friction_passivity(scene: &Scene, findings: &mut Vec<Finding>) {
    let forces = [Parameter::StaticForce, Parameter::DynamicForce, Parameter::Viscous];
    let symmetric = forces
        .iter()
        .all(|force| scene.value(*force).is_none_or(Directional::is_symmetric));
    let drag = scene.value(Parameter::Viscous).unwrap_or_default();
    let directions = if symmetric {
        &Direction::BOTH[..1]
    } else {
        &Direction::BOTH
    };
    for &direction in directions {
        let Some(bound) = scene.friction.as_law().passive_from(direction) else {
            return;
        };
        let about = About {
            check: Check::FrictionPassivity,
            parameter: Parameter::Viscous,
            unit: "N s/m",
            fixed_by: bound.is_finite().then_some(bound),
        };
        findings.push(at_least(about, drag.get(direction), bound.max(0.0)));
    }
}

fn literal_scheme(scene: &Scene, t: f64, findings: &mut Vec<Finding>) {
    let (Some(block), Some(coupling)) = (&scene.block, &scene.coupling) else {
        return;
    };
    let greatest = |parameter| scene.value(parameter).map_or(0.0, Directional::greatest);
    let damping = coupling.damping + greatest(Parameter::Viscous) + greatest(Parameter::ContactDamping);
    let stiffness = coupling.stiffness + scene.friction.contact_stiffness(false);
    let least_mass = stiffness * t * t / 4.0 + damping * t / 2.0;
    let heavier = |check, unit, mass: f64| About {
        check,
        parameter: Parameter::Mass,
        unit,
        fixed_by: Some(mass),
    };
    findings.push(at_least(
        heavier(Check::LeastMass, "kg", least_mass),
        block.mass,
        least_mass,
    ));
    let Some(rigid) = scene.friction.as_law().rigid_friction() else {
        // A contact that gives way comes to rest.
        return;
    };
    let dynamic_force = rigid.greatest();
    let room = 4.0 * (block.mass - least_mass);
    let amplitude = if room > 0.0 {
        2.0 * dynamic_force * t / room
    } else {
        f64::INFINITY
    };
    // The mass at which the amplitude is what is wanted.
    let mass_for = |amplitude: f64| least_mass + dynamic_force * t / (2.0 * amplitude);
    findings.push(at_most(
        heavier(Check::LimitCycle, "m/s", mass_for(UNSEEN_LIMIT_CYCLE_MPS)),
        amplitude,
        UNSEEN_LIMIT_CYCLE_MPS,
    ));
    let per_speed = coupling.stiffness * t / 2.0 + coupling.damping;
    findings.push(at_most(
        heavier(Check::Ripple, "N", mass_for(UNFELT_RIPPLE_N / per_speed)),
        amplitude * per_speed,
        UNFELT_RIPPLE_N,
    ));
}

fn hand_in_the_loop(scene: &Scene, rig: &RigFacts, findings: &mut Vec<Finding>) {
    let t = rig.effective_period_s();
    let (parameter, stiffness, damping) = match &scene.coupling {
        Some(coupling) => (Parameter::Stiffness, coupling.stiffness, coupling.damping),
        None => {
            let greatest = |parameter| scene.value(parameter).map_or(0.0, Directional::greatest);
            let damping = greatest(Parameter::Viscous).max(greatest(Parameter::ContactDamping));
            (
                Parameter::ContactStiffness,
                scene.friction.contact_stiffness(true),
                damping,
            )
        }
    };
    let delayed = t + 2.0 * rig.delay_s;
    let softer = |check, unit, to: f64| About {
        check,
        parameter: if stiffness > 0.0 { parameter } else { Parameter::Viscous },
        unit,
        fixed_by: (to > 0.0 && stiffness > 0.0).then_some(to),
    };
    findings.push(at_least(
        softer(Check::Passivity, "N s/m", 2.0 * (rig.damping - damping) / t),
        rig.damping,
        stiffness * t / 2.0 + damping,
    ));
    if stiffness == 0.0 {
        return;
    }
    let mut stiffest = |check, bound: f64| findings.push(at_most(softer(check, "N/m", bound), stiffness, bound));
    stiffest(Check::LinearStability, 2.0 * (rig.damping + damping) / delayed);
    stiffest(Check::Friction, 2.0 * rig.friction / (EXPLORING_SPEED_MPS * delayed));
    if rig.resolution > 0.0 {
        stiffest(Check::Encoder, 2.0 * rig.friction / rig.resolution);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::ParameterKey;
    use alloc::string::ToString;
    use proptest::prelude::*;

    const RIG: RigFacts = RigFacts {
        period_s: 1e-3,
        sample_period_s: 0.0,
        delay_s: 0.0,
        damping: 0.0,
        friction: 0.8,
        resolution: 1e-5,
    };

    fn find(findings: &[Finding], check: Check) -> Finding {
        *findings
            .iter()
            .find(|finding| finding.check == check)
            .expect("it is checked")
    }

    #[test]
    fn the_papers_numbers_come_out() {
        let key: ParameterKey = "Fd".parse().expect("a parameter");
        let scene = Scene::paper().with(&[(key, 4.0)]).expect("a valid scene");
        let findings = advise(&scene, Scheme::LITERAL, &RIG);
        assert!((find(&findings, Check::LimitCycle).value - 4.0921e-3).abs() < 5e-8);
        assert!((find(&findings, Check::LeastMass).bound - 11.25e-3).abs() < 1e-15);
        assert!(find(&findings, Check::LeastMass).passes);
        // V (K T/2 + B) = 4.0921 mm/s x 22.5 N s/m.
        assert!((find(&findings, Check::Ripple).value - 0.092_07).abs() < 1e-5);
        // 2 (0 + 10) / 1 ms: the paper's stiffness is beyond it on a rig without damping, and
        // further with a tick of delay.
        let linear = find(&findings, Check::LinearStability);
        assert_eq!((linear.passes, linear.bound), (false, 20_000.0));
        let late = RigFacts { delay_s: 1e-3, ..RIG };
        let linear = find(&advise(&scene, Scheme::Exact, &late), Check::LinearStability);
        assert!((linear.bound - 20_000.0 / 3.0).abs() < 1e-9);
        assert!((find(&findings, Check::Friction).bound - 16_000.0).abs() < 1e-9);
        assert!((find(&findings, Check::Encoder).bound - 160_000.0).abs() < 1e-9);
    }

    // hazard: H10
    #[test]
    fn a_slow_rig_and_a_late_link_take_stiffness_away() {
        let bound = |times: LinkTimes| {
            let rig = RigFacts {
                sample_period_s: times.sample_period_s,
                delay_s: times.delay_s(RIG.period_s),
                ..RIG
            };
            find(&advise(&Scene::paper(), Scheme::Exact, &rig), Check::LinearStability).bound
        };
        let times = |rate_hz: f64, round_trip_s, age_s| LinkTimes {
            sample_period_s: 1.0 / rate_hz,
            round_trip_s,
            age_s,
        };
        // Nothing measured yet: a period of the slower side.
        assert!((bound(times(1000.0, 0.0, 0.0)) - 20.0 / 3e-3).abs() < 1e-6);
        assert!((bound(times(60.0, 0.0, 0.0)) - 20.0 * 60.0 / 3.0).abs() < 1e-6);
        // 2 B / (T + 2 tau) of what was measured.
        assert!((bound(times(1000.0, 2e-3, 0.5e-3)) - 20.0 / 5e-3).abs() < 1e-6);
        assert!((bound(times(60.0, 1e-3, 17e-3)) - 20.0 / (1.0 / 60.0 + 2e-3)).abs() < 1e-6);
        assert!((bound(times(60.0, 9e-3, 0.0)) - 20.0 / (1.0 / 60.0 + 18e-3)).abs() < 1e-6);
        // Samples that come 5 ms too late are a delay like any other.
        assert!((bound(times(1000.0, 1e-3, 7e-3)) - 20.0 / 13e-3).abs() < 1e-6);
        // A rig that is faster than the loop is read once a tick all the same.
        assert!((bound(times(4000.0, 1e-3, 0.0)) - 20.0 / 3e-3).abs() < 1e-6);
    }

    #[test]
    fn the_exact_scheme_has_no_bounds_of_its_own() {
        let findings = advise(&Scene::paper(), Scheme::Exact, &RIG);
        assert!(
            findings
                .iter()
                .all(|finding| !matches!(finding.check, Check::LimitCycle | Check::LeastMass | Check::Ripple))
        );
    }

    #[test]
    fn advice_names_the_values_and_the_fix() {
        let message = find(&advise(&Scene::paper(), Scheme::Exact, &RIG), Check::LinearStability).to_string();
        for part in ["25000 N/m", "20000 N/m", "stiffness = 20000 N/m would fix it"] {
            assert!(message.contains(part), "{message} lacks {part}");
        }
    }

    proptest! {
        #[test]
        fn the_fix_of_a_bound_fixes_it(
            mass in 1e-3..10.0f64, stiffness in 10.0..1e5f64, damping in 0.0..50.0f64, dynamic_force in 0.0..20.0f64,
            substeps in prop_oneof![Just(1), Just(10)], rig_damping in 0.0..50.0f64, delay_s in 0.0..3e-3f64, sample_period_s in 0.0..0.1f64,
        ) {
            let changes = [("M", mass), ("K", stiffness), ("B", damping), ("Fs", 20.0), ("Fd", dynamic_force)]
                .map(|(name, value)| (name.parse().expect("a parameter"), value));
            let scene = Scene::paper().with(&changes).expect("a valid scene");
            let rig = RigFacts { damping: rig_damping, delay_s, sample_period_s, ..RIG };
            let scheme = Scheme::Literal { substeps: core::num::NonZeroU32::new(substeps).expect("not zero") };
            for finding in advise(&scene, scheme, &rig) {
                prop_assert_eq!(finding.passes, finding.margin >= 1.0, "{:?}", finding);
                if let Some(Fix { parameter, value }) = finding.fix {
                    // A hair beyond, for rounding.
                    let value = if parameter == Parameter::Mass { value * (1.0 + 1e-9) } else { value * (1.0 - 1e-9) };
                    if let Ok(fixed) = scene.with(&[(parameter.into(), value)]) {
                        prop_assert!(find(&advise(&fixed, scheme, &rig), finding.check).passes, "{:?}", finding);
                    }
                }
            }
        }
    }
}

//! The result of a check.

use crate::parameters::Parameter;
use core::fmt;

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
    /// Energy that a law of bristles itself can give out.
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
    /// The value that would fix a broken bound, where one parameter can, and no other bound is broken by it.
    pub fix: Option<Fix>,
    /// Where no stiffness can: the damping below which one does, as what the rig takes up leaves nothing for a spring.
    /// With 0 no grip does.
    pub fixed_below: Option<Fix>,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.check {
            Check::LimitCycle => "the block at rest trembles",
            Check::LeastMass => "the scheme diverges below a least mass",
            Check::Ripple => "the trembling block is felt as a ripple",
            Check::Passivity => "the coupling can give out energy, more than the rig's own damping takes up",
            Check::LinearStability if self.unit == DAMPING_UNIT => {
                "against a stuck block damping alone makes the loop oscillate, whatever the stiffness"
            }
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
            return write!(f, "; {} = {} {} would fix it", info.name, Rounded(value), info.unit);
        }
        match self.fixed_below {
            None => Ok(()),
            Some(Fix { value, .. }) if value <= 0.0 => {
                let what = match self.check {
                    Check::Passivity => "damping",
                    Check::Encoder => "friction",
                    _ => "friction or damping",
                };
                write!(f, "; no grip keeps it without {what} of the rig's own")
            }
            Some(Fix { parameter, value }) => {
                let info = parameter.info();
                write!(
                    f,
                    "; no stiffness keeps it: {} must be below {} {} first",
                    info.name,
                    Rounded(value),
                    info.unit
                )
            }
        }
    }
}

/// Unit of a finding about damping.
pub(super) const DAMPING_UNIT: &str = "N s/m";

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
pub(super) struct About {
    pub(super) check: Check,
    pub(super) parameter: Parameter,
    pub(super) unit: &'static str,
    pub(super) fixed_by: Option<f64>,
}

/// A bound that a value must not exceed.
pub(super) fn at_most(about: About, value: f64, bound: f64) -> Finding {
    finding(about, value, bound, value <= bound, bound / value)
}

/// A bound that a value must reach.
pub(super) fn at_least(about: About, value: f64, bound: f64) -> Finding {
    finding(about, value, bound, value >= bound, value / bound)
}

fn finding(about: About, value: f64, bound: f64, passes: bool, margin: f64) -> Finding {
    let parameter = about.parameter;
    Finding {
        check: about.check,
        parameter,
        passes,
        value,
        bound,
        unit: about.unit,
        // Nothing against nothing is neither kept well nor badly.
        margin: if margin.is_nan() { 1.0 } else { margin },
        fix: about.fixed_by.filter(|_| !passes).map(|value| Fix { parameter, value }),
        fixed_below: None,
    }
}

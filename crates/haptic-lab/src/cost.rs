//! What a tick costs, scene by scene: instructions, bytes and nanoseconds. A scene compiles to its
//! own parts only, and this is where that shows.
//!
//! Instructions are counted by callgrind (valgrind), which is deterministic and deaf to whatever
//! else the machine does: the program that counts starts itself once more under it, as a probe that
//! runs [`measured_ticks`] for one thing after another, and reads one total for each.

mod callgrind;

pub use callgrind::{CountError, count};

use crate::accuracy::cases::{self, Case, OscillatingHand};
use crate::accuracy::{
    Extent, INSTRUCTIONS_ON, LawCase, PlaneBlock, PlaneScheme, law_cases, plane_cases, schemes_by_law,
};
use crate::motion::{DeviceSample, median_period_s};
use crate::simulate::{Start, renderer};
use haptic_core::planar::Plane;
use haptic_core::{BoundError, Course, Excitation, OwnMotion, Renderer, SceneError, Scheme};
use std::fmt;
use std::str::FromStr;

/// An excitation at the beginning of a motion.
fn begun(excitation: Excitation, motion: &[DeviceSample]) -> Result<OwnMotion, BoundError> {
    let first = motion.first().copied().unwrap_or_default();
    let mut own = OwnMotion::excitation(excitation, median_period_s(motion))?;
    own.place(first.position_m, first.velocity_mps);
    Ok(own)
}

/// The hand under which the excitations run: to and fro for two seconds.
#[must_use]
pub fn hand() -> Vec<DeviceSample> {
    OscillatingHand {
        samples: 2001,
        ..OscillatingHand::PLAIN
    }
    .samples()
}

/// What is measured.
#[derive(Debug)]
pub enum Measured<'a> {
    /// A scene along a motion.
    Scene(&'a mut Renderer, &'a [DeviceSample]),
    /// A motion of the rig's own, along that of the handle.
    MotionFile(&'a mut OwnMotion, &'a [DeviceSample]),
    /// A block in the plane along a motion.
    Plane(&'a mut PlaneBlock, &'a [DeviceSample<Plane>]),
}

/// Its ticks: one function for all of it, so that callgrind can separate them from the rest of the program. Of two such
/// functions it would count nothing.
#[inline(never)]
pub fn measured_ticks(what: Measured<'_>) {
    fn each(motion: &[DeviceSample], mut tick: impl FnMut(f64, f64, f64)) {
        for pair in motion.windows(2) {
            let (from, to) = (&pair[0], &pair[1]);
            tick(to.t_s - from.t_s, to.position_m, to.velocity_mps);
        }
    }
    match what {
        Measured::Scene(renderer, motion) => each(motion, |elapsed_s, position, velocity| {
            std::hint::black_box(renderer.tick(elapsed_s, position, velocity));
        }),
        Measured::MotionFile(own, motion) => each(motion, |elapsed_s, position, velocity| {
            std::hint::black_box(own.tick(elapsed_s, position, velocity));
        }),
        Measured::Plane(block, motion) => {
            for to in motion.iter().skip(1) {
                std::hint::black_box(block.tick(to));
            }
        }
    }
}

/// What a probe runs through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Probe {
    /// Every case of the work-precision measurement with every scheme.
    Cases,
    /// Every law under every hand with every scheme.
    Hands,
    /// Every law on [`INSTRUCTIONS_ON`] with the exact scheme, then the excitations.
    Limits,
    /// Every motion in the plane with every scheme of it.
    Plane,
}

impl fmt::Display for Probe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cases => "cases",
            Self::Hands => "hands",
            Self::Limits => "limits",
            Self::Plane => "plane",
        })
    }
}

impl FromStr for Probe {
    type Err = String;

    /// Reads what [`fmt::Display`] writes.
    fn from_str(text: &str) -> Result<Self, String> {
        let all = [Self::Cases, Self::Hands, Self::Limits, Self::Plane];
        let names = || all.map(|probe| probe.to_string()).join(", ");
        all.into_iter()
            .find(|probe| probe.to_string() == text)
            .ok_or_else(|| format!("`{text}` is not a probe; there are {}", names()))
    }
}

impl Probe {
    /// Runs the ticks, each thing once, in the order of the tables.
    ///
    /// # Errors
    /// A scene cannot be rendered.
    pub fn run(self) -> Result<(), SceneError> {
        match self {
            Self::Cases => {
                for Case {
                    scene, motion, start, ..
                } in cases::all()
                {
                    for scheme in crate::accuracy::schemes() {
                        let mut renderer = renderer(&scene, scheme, &motion, start)?;
                        measured_ticks(Measured::Scene(&mut renderer, &motion));
                    }
                }
            }
            Self::Hands => {
                for case in law_cases(Extent::REPORT.samples) {
                    for scheme in schemes_by_law() {
                        let mut renderer = renderer(&case.scene, scheme, &case.motion, Start::default())?;
                        measured_ticks(Measured::Scene(&mut renderer, &case.motion));
                    }
                }
            }
            Self::Plane => {
                for case in plane_cases() {
                    for scheme in PlaneScheme::ALL {
                        let mut block = PlaneBlock::new(scheme, &case)?;
                        measured_ticks(Measured::Plane(&mut block, &case.motion));
                    }
                }
            }
            Self::Limits => {
                for (_, case) in limited_cases() {
                    let mut renderer = renderer(&case.scene, Scheme::Exact, &case.motion, Start::default())?;
                    measured_ticks(Measured::Scene(&mut renderer, &case.motion));
                }
                let motion = hand();
                for (_, excitation) in excitations() {
                    // They are bounded, which a test runs through.
                    if let Ok(mut own) = begun(excitation, &motion) {
                        measured_ticks(Measured::MotionFile(&mut own, &motion));
                    }
                }
            }
        }
        Ok(())
    }
}

/// The cases whose instructions have limits, each with its place in [`INSTRUCTIONS_ON`].
#[must_use]
pub fn limited_cases() -> Vec<(usize, LawCase)> {
    law_cases(Extent::REPORT.samples)
        .into_iter()
        .filter_map(|case| {
            let place = INSTRUCTIONS_ON
                .iter()
                .position(|&(hand, mass_kg)| case.hand == hand && case.mass_kg == mass_kg)?;
            Some((place, case))
        })
        .collect()
}

/// The excitations by which a rig is identified, within bounds that the table's hand keeps.
#[must_use]
pub fn excitations() -> Vec<(&'static str, Excitation)> {
    let along = |course| Excitation {
        course,
        force_limit_n: 20.0,
        slew_limit_n_per_s: 2000.0,
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 20.0,
        travel_limit_m: 0.25,
        speed_limit_mps: 0.5,
        lag_limit_m: 0.25,
        wrong_way_limit_m: 0.25,
    };
    vec![
        (
            "excitation along a chirp",
            along(Course::Chirp {
                amplitude_m: 0.005,
                from_hz: 0.5,
                to_hz: 3.0,
                duration_s: 12.0,
            }),
        ),
        (
            "excitation along a sweep",
            along(Course::Sweep {
                travel_m: 0.02,
                speed_mps: 0.01,
                rounds: 1,
            }),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::hands;
    use haptic_core::friction::{Friction, Karnopp};
    use haptic_core::{Directional, Scene};

    #[test]
    fn excitation_lasts_through_the_measured_motion() {
        let motion = hand();
        for (name, excitation) in excitations() {
            let mut own = begun(excitation, &motion).expect("bounded");
            measured_ticks(Measured::MotionFile(&mut own, &motion));
            assert_eq!(own.end(), None, "{name}");
        }
    }

    #[test]
    fn a_scene_keeps_no_bytes_for_what_it_lacks() {
        let motion = &hand()[..2];
        let of = |scene: Scene| {
            let renderer = renderer(&scene, Scheme::Exact, motion, Start::default());
            renderer.expect("a valid scene").state_bytes()
        };
        let named = |law: &str| {
            let mut laws = hands::laws_under_hands().into_iter();
            laws.find(|(name, _)| *name == law).expect("a law of the table").1
        };
        let behind = |friction| of(hands::behind_block(friction, 0.5));
        let karnopp = Karnopp::new(4.0, 3.5);
        let asymmetric = Karnopp {
            dynamic_force: Directional::new(3.5, 3.0),
            ..karnopp
        };
        let of_karnopp = |law| behind(Friction::Karnopp(law));
        assert!(of(hands::on_device(named("viscous"))) <= 32);
        assert!(of(hands::on_device(named("dahl"))) < behind(named("viscous")));
        assert!(behind(named("viscous")) < of_karnopp(karnopp));
        // The second direction is a second oscillator with its propagator.
        assert!(of_karnopp(karnopp) + 100 < of_karnopp(asymmetric));
        let rising = Karnopp {
            rising_rate: 10.0,
            ..asymmetric
        };
        assert_eq!(of_karnopp(rising), of_karnopp(asymmetric) + 16);
        let with_threshold = Karnopp {
            velocity_threshold: 0.01,
            ..karnopp
        };
        assert_eq!(of_karnopp(with_threshold), of_karnopp(karnopp));
    }
}

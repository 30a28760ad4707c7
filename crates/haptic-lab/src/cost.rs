//! What a tick costs, scene by scene: instructions, bytes and nanoseconds. A scene compiles to its
//! own parts only, and this is where that shows.
//!
//! Instructions are counted by callgrind (valgrind), which is deterministic and deaf to whatever
//! else the machine does: the program that counts starts itself once more under it, as a probe that
//! runs [`measured_ticks`] for one thing after another, and reads one total for each.

mod callgrind;
mod scenes;

pub use callgrind::{CountError, count};
pub use scenes::{excitations, scenes};

use crate::accuracy::cases::{self, Case, OscillatingHand};
use crate::accuracy::{
    Extent, INSTRUCTIONS_ON, LawCase, PlaneBlock, PlaneScheme, law_cases, plane_cases, schemes_by_law,
};
use crate::motion::{DeviceSample, median_period_s};
use crate::simulate::{Start, renderer};
use haptic_core::planar::Plane;
use haptic_core::{BoundError, Excitation, OwnMotion, Renderer, SceneError, Scheme};
use std::fmt;
use std::str::FromStr;

/// An excitation at the beginning of a motion.
fn begun(excitation: Excitation, motion: &[DeviceSample]) -> Result<OwnMotion, BoundError> {
    let first = motion.first().copied().unwrap_or_default();
    let mut own = OwnMotion::excitation(excitation, median_period_s(motion))?;
    own.place(first.position_m, first.velocity_mps);
    Ok(own)
}

/// The hand that the table's scenes are rendered for: to and fro for two seconds, with every stop
/// and breakaway in it.
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
    /// The table's scenes.
    Scenes,
    /// The excitations.
    Excitations,
    /// Every case of the work-precision measurement with every scheme.
    Cases,
    /// Every law under every hand with every scheme.
    Hands,
    /// Every law on [`INSTRUCTIONS_ON`] with the exact scheme.
    Limits,
    /// Every motion in the plane with every scheme of it.
    Plane,
}

impl fmt::Display for Probe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scenes => "scenes",
            Self::Excitations => "excitations",
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
        let all = [
            Self::Scenes,
            Self::Excitations,
            Self::Cases,
            Self::Hands,
            Self::Limits,
            Self::Plane,
        ];
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
            Self::Scenes => {
                let motion = hand();
                for (_, scene) in scenes() {
                    let mut renderer = renderer(&scene, Scheme::Exact, &motion, Start::default())?;
                    measured_ticks(Measured::Scene(&mut renderer, &motion));
                }
            }
            Self::Excitations => {
                let motion = hand();
                for (_, excitation) in excitations() {
                    // They are bounded, which a test runs through.
                    if let Ok(mut own) = begun(excitation, &motion) {
                        measured_ticks(Measured::MotionFile(&mut own, &motion));
                    }
                }
            }
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
                .position(|&(hand, mass_kg)| case.hand == hand && case.mass_kg == Some(mass_kg))?;
            Some((place, case))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let bytes: Vec<(&str, usize)> = scenes()
            .iter()
            .map(|(name, scene)| {
                let renderer = renderer(scene, Scheme::Exact, motion, Start::default()).expect("a valid scene");
                (*name, renderer.state_bytes())
            })
            .collect();
        println!("{bytes:?}");
        let of = |wanted: &str| {
            bytes
                .iter()
                .find(|(name, _)| *name == wanted)
                .map(|(_, bytes)| *bytes)
                .expect("in the table")
        };
        assert!(of("viscous on the device") <= 32);
        assert!(of("Dahl on the device") < of("viscous behind a block"));
        assert!(of("viscous behind a block") < of("Karnopp behind a block"));
        // The second direction is a second oscillator with its propagator.
        assert!(of("Karnopp behind a block") + 100 < of("the same, asymmetric"));
        assert_eq!(of("asymmetric with rising Fs"), of("the same, asymmetric") + 16);
        assert_eq!(of("the same with DV"), of("Karnopp behind a block"));
    }
}

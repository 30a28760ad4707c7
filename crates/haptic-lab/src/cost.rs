//! What a tick costs, scene by scene: instructions, bytes and nanoseconds. A scene compiles to its
//! own parts only, and this is where that shows.
//!
//! Instructions are counted by callgrind (valgrind), which is deterministic and deaf to whatever
//! else the machine does: the program that counts starts itself once more under it, as a probe that
//! runs [`measured_ticks`] for one thing after another, and reads one total for each.

use crate::accuracy::cases::{self, Case, ToAndFro};
use crate::accuracy::{Extent, INSTRUCTIONS_ON, LawCase, law_cases, schemes_by_law};
use crate::motion::{DeviceSample, usual_period_s};
use crate::simulate::{Start, measure_cost, renderer};
use haptic_core::friction::{
    Dahl, ElastoPlastic, Friction, HaywardArmstrong, Karnopp, Lugre, Reseat, ResetIntegrator, SalcudeanVlaar, Viscous,
};
use haptic_core::{BoundError, Course, Directional, Excitation, Renderer, Scene, SceneError, Scheme};
use std::fmt;
use std::io;
use std::path::Path;
use std::process::{Command, Stdio};
use std::str::FromStr;
use std::time::Instant;
use thiserror::Error;

/// The scenes of the table, from the least to the most that can be asked of a tick.
///
/// # Panics
/// Never: they are valid scenes, which a test runs through.
#[must_use]
pub fn scenes() -> Vec<(&'static str, Scene)> {
    let both = Directional::both;
    let apart = Directional {
        positive: 4.0,
        negative: 3.0,
    };
    let plain = Karnopp::new(4.0, 3.5);
    let asymmetric = Karnopp {
        static_force: Directional {
            positive: 5.0,
            negative: 4.0,
        },
        dynamic_force: apart,
        ..plain
    };
    let lugre = Lugre {
        static_force: both(4.0),
        dynamic_force: both(3.5),
        stribeck_velocity: 0.01,
        contact_stiffness: 1e4,
        contact_damping: 10.0,
        viscous: both(2.0),
    };
    let elasto_plastic = ElastoPlastic {
        static_force: both(4.0),
        dynamic_force: both(3.5),
        stribeck_velocity: 0.01,
        contact_stiffness: 1e4,
        contact_damping: 10.0,
        elastic_fraction: 0.7,
        viscous: both(2.0),
    };
    let viscous = Friction::Viscous(Viscous { viscous: both(35.0) });
    let dahl = Friction::Dahl(Dahl {
        dynamic_force: both(3.5),
        contact_stiffness: 1e4,
        exponent: 1.0,
        viscous: both(0.0),
    });
    let on_device = |friction| Scene {
        block: None,
        coupling: None,
        friction,
        ..Scene::paper()
    };
    let behind_block = |friction| Scene {
        friction,
        ..Scene::paper()
    };
    vec![
        ("viscous on the device", on_device(viscous)),
        (
            "Salcudean-Vlaar on the device",
            on_device(Friction::SalcudeanVlaar(SalcudeanVlaar {
                static_force: both(4.0),
                contact_stiffness: 5000.0,
                viscous: both(5.0),
                velocity_threshold: 0.002,
            })),
        ),
        ("Karnopp on the device", on_device(Friction::Karnopp(plain))),
        ("Dahl on the device", on_device(dahl)),
        (
            "Hayward-Armstrong on the device",
            on_device(Friction::HaywardArmstrong(HaywardArmstrong {
                dynamic_force: both(3.5),
                contact_stiffness: 1e4,
                elastic_fraction: 0.7,
                viscous: both(0.0),
            })),
        ),
        (
            "reset integrator on the device",
            on_device(Friction::ResetIntegrator(ResetIntegrator {
                static_force: both(4.0),
                dynamic_force: both(3.5),
                contact_stiffness: 1e4,
                contact_damping: 10.0,
                viscous: both(0.0),
                reseat: Reseat::Continuous,
            })),
        ),
        (
            "LuGre without Stribeck on the device",
            on_device(Friction::Lugre(Lugre {
                static_force: both(3.5),
                ..lugre
            })),
        ),
        ("LuGre on the device", on_device(Friction::Lugre(lugre))),
        (
            "elasto-plastic without Stribeck on the device",
            on_device(Friction::ElastoPlastic(ElastoPlastic {
                static_force: both(3.5),
                ..elasto_plastic
            })),
        ),
        (
            "elasto-plastic on the device",
            on_device(Friction::ElastoPlastic(elasto_plastic)),
        ),
        ("viscous behind a block", behind_block(viscous)),
        ("Karnopp behind a block", behind_block(Friction::Karnopp(plain))),
        (
            "the same with DV",
            behind_block(Friction::Karnopp(Karnopp {
                velocity_threshold: 0.01,
                ..plain
            })),
        ),
        ("the same, asymmetric", behind_block(Friction::Karnopp(asymmetric))),
        (
            "asymmetric with rising Fs",
            behind_block(Friction::Karnopp(Karnopp {
                rising_rate: 10.0,
                ..asymmetric
            })),
        ),
        (
            "Karnopp with Stribeck behind a block",
            behind_block(Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.01,
                ..plain
            })),
        ),
        ("Dahl behind a block", behind_block(dahl)),
        ("LuGre behind a block", behind_block(Friction::Lugre(lugre))),
        (
            "elasto-plastic behind a block",
            behind_block(Friction::ElastoPlastic(elasto_plastic)),
        ),
    ]
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

/// An excitation at the beginning of a motion.
fn follower(excitation: Excitation, motion: &[DeviceSample]) -> Result<Renderer, BoundError> {
    let first = motion.first().copied().unwrap_or_default();
    let mut renderer = Renderer::excitation(excitation, usual_period_s(motion))?;
    renderer.start_at(first.position_m, first.velocity_mps);
    Ok(renderer)
}

/// Times that a motion is gone through; the median counts.
const TIMES: usize = 15;

/// Measures every excitation. `instructions` are the totals of a probe, in their order, or none.
///
/// # Errors
/// An excitation is not bounded as it must be.
pub fn measure_excitations(instructions: Option<&[u64]>) -> Result<Vec<SceneCost>, BoundError> {
    let motion = hand();
    excitations()
        .into_iter()
        .enumerate()
        .map(|(index, (name, excitation))| {
            let renderer = follower(excitation, &motion)?;
            let mut times_ns: Vec<u64> = (0..TIMES)
                .map(|_| {
                    let (mut renderer, began) = (renderer.clone(), Instant::now());
                    measured_ticks(&mut renderer, &motion);
                    u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX)
                })
                .collect();
            times_ns.sort_unstable();
            Ok(SceneCost {
                scene: name,
                state_bytes: renderer.state_bytes(),
                instructions: instructions
                    .and_then(|totals| totals.get(index))
                    .map(|total| per_tick(*total, &motion)),
                median_ns: per_tick(times_ns[TIMES / 2], &motion),
            })
        })
        .collect()
}

/// The hand that the table's scenes are rendered for: to and fro for two seconds, with every stop
/// and breakaway in it.
#[must_use]
pub fn hand() -> Vec<DeviceSample> {
    ToAndFro {
        samples: 2001,
        ..ToAndFro::PLAIN
    }
    .samples()
}

/// What a scene costs.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCost {
    /// What the scene is.
    pub scene: &'static str,
    /// Bytes that a tick keeps.
    pub state_bytes: usize,
    /// Instructions a tick, over the whole motion; nothing where they could not be counted.
    pub instructions: Option<f64>,
    /// Nanoseconds a tick, median.
    pub median_ns: f64,
}

/// Measures every scene of the table. `instructions` are the totals of a probe, in the table's
/// order, or none.
///
/// # Errors
/// A scene cannot be rendered.
pub fn measure(instructions: Option<&[u64]>) -> Result<Vec<SceneCost>, SceneError> {
    let motion = hand();
    scenes()
        .into_iter()
        .enumerate()
        .map(|(index, (name, scene))| {
            Ok(SceneCost {
                scene: name,
                state_bytes: renderer(&scene, Scheme::Exact, &motion, Start::default())?.state_bytes(),
                instructions: instructions
                    .and_then(|totals| totals.get(index))
                    .map(|total| per_tick(*total, &motion)),
                median_ns: measure_cost(&scene, Scheme::Exact, &motion, Start::default())?.median_ns,
            })
        })
        .collect()
}

/// A total over a motion as a number a tick.
#[must_use]
pub fn per_tick(total: u64, motion: &[DeviceSample]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let (total, ticks) = (total as f64, (motion.len() - 1) as f64);
    total / ticks
}

/// What is measured: a function of its own, so that callgrind can tell it from the rest of the program.
#[inline(never)]
pub fn measured_ticks(renderer: &mut Renderer, motion: &[DeviceSample]) {
    for pair in motion.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        std::hint::black_box(renderer.tick(to.t_s - from.t_s, to.position_m, to.velocity_mps));
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
}

impl fmt::Display for Probe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Scenes => "scenes",
            Self::Excitations => "excitations",
            Self::Cases => "cases",
            Self::Hands => "hands",
            Self::Limits => "limits",
        })
    }
}

impl FromStr for Probe {
    type Err = String;

    /// Reads what [`fmt::Display`] writes.
    fn from_str(text: &str) -> Result<Self, String> {
        [Self::Scenes, Self::Excitations, Self::Cases, Self::Hands, Self::Limits]
            .into_iter()
            .find(|probe| probe.to_string() == text)
            .ok_or_else(|| format!("`{text}` is not a probe; there are scenes, excitations, cases, hands and limits"))
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
                    measured_ticks(
                        &mut renderer(&scene, Scheme::Exact, &motion, Start::default())?,
                        &motion,
                    );
                }
            }
            Self::Excitations => {
                let motion = hand();
                for (_, excitation) in excitations() {
                    // They are bounded, which a test runs through.
                    if let Ok(mut renderer) = follower(excitation, &motion) {
                        measured_ticks(&mut renderer, &motion);
                    }
                }
            }
            Self::Cases => {
                for Case {
                    scene, motion, start, ..
                } in cases::all()
                {
                    for scheme in crate::accuracy::schemes() {
                        measured_ticks(&mut renderer(&scene, scheme, &motion, start)?, &motion);
                    }
                }
            }
            Self::Hands => {
                for case in law_cases(Extent::REPORT.samples) {
                    for scheme in schemes_by_law() {
                        let mut renderer = renderer(&case.scene, scheme, &case.motion, Start::default())?;
                        measured_ticks(&mut renderer, &case.motion);
                    }
                }
            }
            Self::Limits => {
                for (_, case) in limited_cases() {
                    let mut renderer = renderer(&case.scene, Scheme::Exact, &case.motion, Start::default())?;
                    measured_ticks(&mut renderer, &case.motion);
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

/// Why instructions could not be counted.
#[derive(Debug, Error)]
pub enum CountError {
    /// There is no valgrind.
    #[error("valgrind is not installed, which counts instructions (Debian: apt install valgrind)")]
    NoValgrind,
    /// It could not be run, or its output not be read.
    #[error("callgrind: {0}")]
    Io(#[from] io::Error),
    /// The probe failed.
    #[error("callgrind failed: {0}")]
    Failed(String),
}

/// Counts the instructions of each call of [`measured_ticks`] that `program` makes when it is run
/// with `arguments`. `directory` takes callgrind's files.
///
/// # Errors
/// There is no valgrind, or the program fails under it.
pub fn count(program: &Path, arguments: &[&str], directory: &Path) -> Result<Vec<u64>, CountError> {
    // Whole: a pattern would do for the toggle, and not for the dump.
    const MEASURED: &str = "haptic_lab::cost::measured_ticks";
    let out = directory.join("callgrind.out");
    let ran = Command::new("valgrind")
        .arg("--tool=callgrind")
        .arg(format!("--toggle-collect={MEASURED}"))
        .arg(format!("--dump-after={MEASURED}"))
        .arg(format!("--callgrind-out-file={}", out.display()))
        .arg(program)
        .args(arguments)
        .stdin(Stdio::null())
        .output();
    let ran = match ran {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Err(CountError::NoValgrind),
        ran => ran?,
    };
    if !ran.status.success() {
        return Err(CountError::Failed(String::from_utf8_lossy(&ran.stderr).into_owned()));
    }
    let mut totals = Vec::new();
    loop {
        // One file for each call, numbered from 1.
        let path = format!("{}.{}", out.display(), totals.len() + 1);
        let Ok(text) = std::fs::read_to_string(&path) else {
            break;
        };
        let total = text
            .lines()
            .find_map(|line| line.strip_prefix("totals: ").or_else(|| line.strip_prefix("summary: ")))
            .and_then(|total| total.trim().parse().ok())
            .ok_or_else(|| CountError::Failed(format!("{path} has no total")))?;
        totals.push(total);
    }
    Ok(totals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excitation_lasts_for_all_of_the_motion_that_it_is_measured_on() {
        let motion = hand();
        for (name, excitation) in excitations() {
            let mut renderer = follower(excitation, &motion).expect("bounded");
            measured_ticks(&mut renderer, &motion);
            assert_ne!(renderer.state().contact, haptic_core::block::Contact::Stuck, "{name}");
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

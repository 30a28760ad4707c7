//! The rig of a simulated operator: the daemon's servo on the fake rig's carriage, tick by tick and as fast as the
//! machine computes.

use super::hand;
use crate::plan::MountedBlock;
use device_io::fake::{Hand, Plant, RigProperties};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::sample::Measurement;
use haptic_core::servo::{Command, CompiledScene, Events, InputWord, Inputs, Servo, Settings};
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, SceneError, Scheme};
use haptic_ipc::{Sample, SceneArrival, SceneRamp, ServoSetup};
use haptic_lab::row::of_step;
use haptic_recording::Mark;

/// Time of a tick, s.
pub const PERIOD_S: f64 = 1e-3;
const PERIOD_NS: u64 = 1_000_000;

/// The tick in which the rig engages. A replay needs some tenths of a second without force before it.
const ENGAGE_TICK: u32 = 300;
/// Time over which its force rises then, s.
const RAMP_S: f64 = 0.2;
/// Time until it is engaged, s.
pub(super) const ENGAGED_S: f64 = (ENGAGE_TICK + 1) as f64 * PERIOD_S + RAMP_S;

/// The daemon's usual settings.
#[must_use]
pub fn setup() -> ServoSetup {
    let properties = RigProperties::default();
    ServoSetup {
        settings: Settings {
            period_s: PERIOD_S,
            ramp_s: RAMP_S,
            limits: Limits::default(),
            losses: RigLosses {
                damping: properties.damping_ns_per_m,
                friction: properties.friction_n,
            },
            passivity_control_n: 0.0,
            compensation: None,
            velocity: Method::default(),
            stale_ns: 20_000_000,
            stop_button: None,
            enable_button: None,
            workspace: None,
        },
        scheme: Scheme::Exact,
        device_resolution_m: properties.resolution_m,
        device_force_limit_n: None,
        version: haptic_core::servo::VERSION,
    }
}

/// The rig, held by a hand that pushes.
#[derive(Debug)]
pub(super) struct Rig {
    setup: ServoSetup,
    servo: Servo,
    plant: Plant,
    /// Where the carriage began, m.
    origin_m: f64,
    scene: Scene,
    revision: u64,
    arriving: Option<Box<CompiledScene>>,
    tick: u64,
    force_n: f64,
}

impl Rig {
    /// A rig at rest at a position, m, that renders a scene and moves what is mounted on it, and the hand. It engages
    /// once it has settled.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(super) fn new(scene: &Scene, mounted: MountedBlock, origin_m: f64) -> Result<Self, SceneError> {
        let setup = setup();
        let renderer = Renderer::new(scene, setup.scheme, PERIOD_S)?;
        let bare = RigProperties::default();
        let friction_n = bare.friction_n + mounted.dynamic_force_n;
        let properties = RigProperties {
            mass_kg: bare.mass_kg + mounted.mass_kg + hand::MASS_KG,
            friction_n,
            breakaway_ratio: (bare.friction_n + mounted.static_force_n) / friction_n,
            ..bare
        };
        Ok(Self {
            servo: Servo::new(setup.settings, Box::new(CompiledScene::at_once(renderer, 1))),
            setup,
            plant: Plant::new(&properties, Hand::Free),
            origin_m,
            scene: scene.clone(),
            revision: 1,
            arriving: None,
            tick: 0,
            force_n: 0.0,
        })
    }

    /// Changes to another scene along a ramp of a time, s; the mark of it, as a recording has it.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub(super) fn change_scene(&mut self, scene: &Scene, ramp_s: f64) -> Result<Mark, SceneError> {
        self.revision += 1;
        let from = std::mem::replace(&mut self.scene, scene.clone());
        let compiled = CompiledScene::ramped(&from, scene, self.revision, self.setup.scheme, PERIOD_S, ramp_s)?;
        self.arriving = Some(Box::new(compiled));
        Ok(Mark::Scene {
            tick: self.tick + 1,
            revision: self.revision,
            name: scene.name.clone(),
            law: scene.friction.law().to_owned(),
            params: haptic_ipc::params_of(scene),
            arrival: Some(Box::new(SceneArrival {
                scene: scene.clone(),
                ramp: Some(SceneRamp { from, over_s: ramp_s }),
            })),
        })
    }

    /// Revision of the scene.
    #[must_use]
    pub(super) fn revision(&self) -> u64 {
        self.revision
    }

    /// Position of the handle, m.
    #[must_use]
    pub(super) fn position_m(&self) -> f64 {
        self.origin_m + self.plant.position_m()
    }

    /// Velocity of the handle, m/s.
    #[must_use]
    pub(super) fn velocity_mps(&self) -> f64 {
        self.plant.velocity_mps()
    }

    /// Lives through a tick in which the hand pushes with a force, N; the row of the tick, as a recording has it.
    pub(super) fn tick(&mut self, hand_n: f64) -> Sample {
        self.tick += 1;
        let t_s = self.tick as f64 * PERIOD_S;
        self.plant.advance(PERIOD_S, t_s, self.force_n + hand_n);
        let resolution_m = self.setup.device_resolution_m;
        let counted_m = (self.position_m() / resolution_m).round() * resolution_m;
        // The number wraps around.
        let sample = Measurement::new(self.tick as u32, self.tick * PERIOD_NS, counted_m);
        let inputs = Inputs {
            elapsed_ns: if self.tick == 1 { 0 } else { PERIOD_NS },
            sample: Ok(sample),
            device_resolution_m: resolution_m,
            device_force_limit_n: f64::INFINITY,
            events: Events::default(),
            command: (self.tick == u64::from(ENGAGE_TICK)).then_some(Command::Engage),
        };
        let arriving = self.arriving.take();
        let word = InputWord::new(&inputs, arriving.is_some());
        let outputs = self.servo.step(&inputs, arriving);
        while self.servo.take_retired().is_some() {}
        self.force_n = outputs.force_n;
        of_step(self.tick, t_s, &inputs, word, &self.servo, &outputs).sample
    }
}

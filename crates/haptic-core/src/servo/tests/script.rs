//! A servo of which the test decides every input.

use super::*;

/// A servo, and what its next step is made from.
pub(super) struct Script {
    pub(super) servo: Servo,
    /// The newest sample of the device.
    pub(super) sample: Measurement,
    pub(super) device_force_limit_n: f64,
    pub(super) device_resolution_m: f64,
    /// What the next step is given, and the one after it no more.
    pub(super) once: Once,
}

/// What one step is given.
pub(super) struct Once {
    pub(super) elapsed_ns: u64,
    /// What the device's clock goes on by, ns.
    pub(super) device_elapsed_ns: u64,
    pub(super) events: Events,
    pub(super) command: Option<Command>,
    pub(super) scene: Option<Box<CompiledScene>>,
}

impl Once {
    fn defaults() -> Self {
        Self {
            elapsed_ns: MS,
            device_elapsed_ns: MS,
            events: Events::default(),
            command: None,
            scene: None,
        }
    }
}

/// The shared settings, with a velocity that is the difference of two positions.
pub(super) const PLAIN: Settings = Settings {
    velocity: velocity::Method::FiniteDifference,
    ..SETTINGS
};

pub(super) const SPEED_MPS: f64 = 0.1;

impl Script {
    pub(super) fn new(settings: Settings) -> Self {
        Self {
            servo: Servo::new(settings, paper()),
            sample: Measurement::new(0, 0, 0.0),
            device_force_limit_n: f64::INFINITY,
            device_resolution_m: 0.0,
            once: Once::defaults(),
        }
    }

    /// An engaged servo, whose hand has gone at [`SPEED_MPS`] for long enough to drag the block.
    pub(super) fn engaged(settings: Settings) -> Self {
        let mut script = Self::new(settings);
        script.go_on(50);
        script.command(Command::Engage);
        // Longer than the longest ramp of these tests.
        script.go_on(1200);
        assert_eq!(script.servo.state(), RigState::Engaged);
        script
    }

    fn given(&mut self, sample: Result<Measurement, DeviceError>) -> Outputs {
        let once = core::mem::replace(&mut self.once, Once::defaults());
        let inputs = Inputs {
            elapsed_ns: once.elapsed_ns,
            sample,
            device_resolution_m: self.device_resolution_m,
            device_force_limit_n: self.device_force_limit_n,
            events: once.events,
            command: once.command,
        };
        self.servo.step(&inputs, once.scene)
    }

    /// A step with a new sample, of a hand at a place, m.
    pub(super) fn step(&mut self, position_m: f64) -> Outputs {
        self.sample.sequence += 1;
        self.sample.time_ns += self.once.device_elapsed_ns;
        self.sample.position_m = position_m;
        self.repeat()
    }

    /// A step with the sample of the one before.
    pub(super) fn repeat(&mut self) -> Outputs {
        self.given(Ok(self.sample))
    }

    /// A step in which the device cannot be read.
    pub(super) fn fail(&mut self, error: DeviceError) -> Outputs {
        self.given(Err(error))
    }

    /// The next step of a hand that goes on at [`SPEED_MPS`].
    pub(super) fn next(&mut self) -> Outputs {
        #[expect(clippy::cast_precision_loss, reason = "a few milliseconds")]
        let elapsed_s = self.once.device_elapsed_ns as f64 * 1e-9;
        self.step(self.sample.position_m + SPEED_MPS * elapsed_s)
    }

    pub(super) fn go_on(&mut self, steps: usize) {
        for _ in 0..steps {
            self.next();
        }
    }

    /// The next step, with a command; says whether it was refused.
    pub(super) fn command(&mut self, command: Command) -> bool {
        self.once.command = Some(command);
        self.next().refused
    }

    /// Steps until no force may flow; returns how many that were.
    pub(super) fn until_released(&mut self) -> u32 {
        let mut steps = 0;
        while self.servo.state().is_live() {
            self.go_on(1);
            steps += 1;
            assert!(steps < 10_000, "it is never released");
        }
        steps
    }
}

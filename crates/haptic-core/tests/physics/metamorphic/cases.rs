//! Random cases: a law with any values that are accepted, behind a block or on the device, and a hand.

use crate::random::Random;
use haptic_core::friction::Friction;
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Direction, Directional, Parameter, ParameterKey, Scene};
use std::f64::consts::TAU;

/// A sample of the hand: time since the one before, s, position, m, and velocity, m/s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) elapsed_s: f64,
    pub(crate) position: f64,
    pub(crate) velocity: f64,
}

/// A scene and the hand that moves it, which begins at rest at the origin.
#[derive(Clone, Debug)]
pub(crate) struct Case {
    pub(crate) scene: Scene,
    pub(crate) period_s: f64,
    pub(crate) hand: Vec<Sample>,
}

/// Ticks of a case.
const TICKS: u32 = 40;

/// The range in which a parameter is drawn: the accepted one, but for what no rig can show.
fn range(parameter: Parameter) -> (f64, f64) {
    let info = parameter.info();
    let least = match parameter {
        Parameter::VelocityThreshold => 1e-5,
        Parameter::StribeckVelocity => 1e-4,
        Parameter::RisingRate => 1e-2,
        Parameter::Stiffness => 1.0,
        _ if info.min > 0.0 => info.min,
        _ => 1e-3,
    };
    (least, info.max)
}

/// A value of a parameter: now and then a special one.
fn value(parameter: Parameter, random: &mut Random) -> f64 {
    let (least, most) = range(parameter);
    let min = parameter.info().min;
    match parameter {
        _ if min == 0.0 && random.one_in(5) => 0.0,
        Parameter::Exponent if random.one_in(3) => random.one_of(&[0.5, 1.0, 2.0]),
        Parameter::Exponent | Parameter::ElasticFraction => random.between(least, most),
        _ => random.decades(least, most),
    }
}

/// A scene of a law whose values are anywhere in their ranges, as far as they go together.
pub(crate) fn scene(law: &str, has_block: bool, random: &mut Random) -> Scene {
    let mut scene = Scene {
        name: String::new(),
        block: has_block.then_some(Block { mass: 1.0 }),
        coupling: has_block.then_some(Coupling {
            stiffness: 1e4,
            damping: 1.0,
        }),
        friction: Friction::default_of(law).expect("a law of the list"),
    };
    let draw = |scene: &mut Scene, key: ParameterKey, value: f64| {
        if let Ok(changed) = scene.with(&[(key, value)]) {
            *scene = changed;
        }
    };
    for parameter in scene.parameters() {
        draw(&mut scene, parameter.into(), value(parameter, random));
    }
    // The forces again, in a ratio that is of use.
    if let Some(force) = scene.value(Parameter::DynamicForce) {
        let above = random.one_of(&[1.0, 1.0, 1.1, 2.0, 10.0]);
        draw(&mut scene, Parameter::StaticForce.into(), force.positive * above);
    }
    if random.one_in(2) {
        let share = random.decades(1e-2, 1e2);
        for parameter in [Parameter::StaticForce, Parameter::DynamicForce, Parameter::Viscous] {
            let Some(value) = scene.value(parameter) else { continue };
            draw(
                &mut scene,
                parameter.in_direction(Direction::Negative),
                value.negative * share,
            );
        }
    }
    scene
}

/// The hand's velocity: it swings, and rests now and then.
fn hand(period_s: f64, random: &mut Random) -> Vec<Sample> {
    let (frequency, speed) = (random.decades(1.0, 60.0), random.decades(1e-4, 1.0));
    let second = random.between(0.0, 0.5);
    let (mut t, mut position, mut last) = (0.0_f64, 0.0, 0.0);
    let mut rests = 0;
    let mut samples = Vec::new();
    for _ in 0..TICKS {
        let elapsed_s = period_s * random.one_of(&[1.0, 1.0, 0.8, 1.3]);
        t += elapsed_s;
        if rests > 0 {
            rests -= 1;
        } else if random.one_in(15) {
            rests = 4;
        }
        let velocity = if rests > 0 {
            0.0
        } else {
            speed * ((TAU * frequency * t).sin() + second * (TAU * 3.7 * frequency * t).sin())
        };
        position += 0.5 * (last + velocity) * elapsed_s;
        last = velocity;
        samples.push(Sample {
            elapsed_s,
            position,
            velocity,
        });
    }
    samples
}

impl Case {
    /// A case of a law; `None` where what was drawn cannot be rendered.
    pub(crate) fn draw(law: &str, has_block: bool, random: &mut Random) -> Option<Self> {
        let scene = scene(law, has_block, random);
        let period_s = random.decades(50e-6, 50e-3);
        let case = Self {
            hand: hand(period_s, random),
            scene,
            period_s,
        };
        case.scene.validate_rate(period_s).is_ok().then_some(case)
    }

    /// The same with positions on a grid, m, and velocities by their differences, where it is an
    /// encoder's.
    pub(crate) fn on_grid(&self, grid: f64, by_differences: bool) -> Self {
        let mut case = self.clone();
        let mut last = 0.0;
        for sample in &mut case.hand {
            sample.position = (sample.position / grid).round() * grid;
            if by_differences {
                sample.velocity = (sample.position - last) / sample.elapsed_s;
            }
            last = sample.position;
        }
        case
    }

    /// The force of a step of the device within a tick, N/m.
    pub(crate) fn stiffness(&self) -> f64 {
        let of = |parameter: Parameter| self.scene.value(parameter).map_or(0.0, Directional::greatest);
        if self.scene.is_on_device() {
            of(Parameter::ContactStiffness) + (of(Parameter::Viscous) + of(Parameter::ContactDamping)) / self.period_s
        } else {
            of(Parameter::Stiffness) + of(Parameter::Damping) / self.period_s
        }
    }
}

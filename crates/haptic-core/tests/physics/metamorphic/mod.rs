//! What must not matter to a force: how time is cut, which way is called positive, in what units and
//! from where it is measured, and when a value is touched. No reference is asked, so that every law
//! is tried over its whole range.

pub(crate) mod cases;

use crate::random::Random;
use cases::{Case, Sample};
use haptic_core::{Direction, Directional, Parameter, ParameterKey, Renderer, Scene, Scheme};

/// A force that every tick may be wrong by, as a share of the greatest one, and at least, N.
const SHARE: f64 = 1e-9;
const MIN_N: f64 = 1e-9;
/// What the device's position says no better, in its last digits.
const LAST_DIGITS: f64 = 8.0;
/// Parts of a tick that is cut.
const PARTS: u32 = 10;
/// Whole runs may differ by so many bounds: what single ticks are off by adds up.
const OF_A_RUN: f64 = 4.0;
/// A parameter's last digits, as a share of it.
const LAST: f64 = 1e-12;
/// Share by which a parameter is changed, and so many times the bound that it may make.
const NUDGE: f64 = 1e-9;
const MADE_BY_A_NUDGE: f64 = 1e3;

/// What must not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    /// Every tick cut into ten.
    Cut,
    /// The other direction called positive; every second hand is that of a coarse encoder.
    Mirror,
    /// Mass, time and length in other units, by powers of two.
    Scale,
    /// The origin 1024 m away.
    Move,
    /// The same scene taken over at every seventh tick.
    TakeOver,
    /// A parameter ramped to itself, a step in each tick.
    Ramp,
    /// A parameter changed by 1e-9 of it.
    Nudge,
    /// A rest before it all.
    Rest,
    /// A parameter at a special value, and next to it.
    Special,
}

impl Property {
    pub(crate) const ALL: [Self; 9] = [
        Self::Cut,
        Self::Mirror,
        Self::Scale,
        Self::Move,
        Self::TakeOver,
        Self::Ramp,
        Self::Nudge,
        Self::Rest,
        Self::Special,
    ];
}

/// What one case showed.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub(crate) ticks: u32,
    /// Worst error over its bound, of the ticks that were compared.
    pub(crate) worst: f64,
    /// The run ended where an input within the bound decides.
    pub(crate) decided: bool,
    /// The run ended where the work of a tick ran out.
    pub(crate) exhausted: bool,
    /// So many bounds it is wrong by, and where.
    pub(crate) wrong: Option<(f64, String)>,
}

/// A tick's force, N, and whether its work ran out.
type Tick = (f64, bool);

fn renderer(scene: &Scene, period_s: f64) -> Option<Renderer> {
    let mut renderer = Renderer::new(scene, Scheme::Exact, period_s).ok()?;
    renderer.start_at(0.0, 0.0);
    Some(renderer)
}

/// Follows a hand; `before` is called before each tick.
fn follow(mut surface: Renderer, hand: &[Sample], mut before: impl FnMut(usize, &mut Renderer)) -> Vec<Tick> {
    let mut ticks = Vec::with_capacity(hand.len());
    for (k, sample) in hand.iter().enumerate() {
        before(k, &mut surface);
        let rendered = surface.tick(sample.elapsed_s, sample.position, sample.velocity);
        ticks.push((rendered.coupling_force, rendered.work_exhausted));
    }
    ticks
}

/// Each tick cut, from where the whole ones have come to: under a block the device goes on straight lines of position
/// and velocity, on the device itself with constant acceleration.
fn follow_cut(mut surface: Renderer, case: &Case) -> Vec<Tick> {
    let (mut position, mut velocity) = (0.0, 0.0);
    let mut ticks = Vec::new();
    for sample in &case.hand {
        let mut tick = (0.0, false);
        let mut cut = surface.clone();
        for part in 1..=PARTS {
            let share = f64::from(part) / f64::from(PARTS);
            let gained = share * (sample.velocity - velocity);
            let by = if case.scene.is_on_device() {
                (velocity + 0.5 * gained) * share * sample.elapsed_s
            } else {
                share * (sample.position - position)
            };
            let to = if part == PARTS {
                (sample.position, sample.velocity)
            } else {
                (position + by, velocity + gained)
            };
            let rendered = cut.tick(sample.elapsed_s / f64::from(PARTS), to.0, to.1);
            tick = (rendered.coupling_force, tick.1 || rendered.work_exhausted);
        }
        surface.tick(sample.elapsed_s, sample.position, sample.velocity);
        (position, velocity) = (sample.position, sample.velocity);
        ticks.push(tick);
    }
    ticks
}

/// A scene whose values are others, by parameter, direction and the values by direction.
fn with_values(scene: &Scene, value: impl Fn(Parameter, Direction, Directional) -> f64) -> Option<Scene> {
    let mut changes = Vec::new();
    for parameter in scene.parameters() {
        let had = scene.value(parameter)?;
        if had.is_symmetric() {
            let key = ParameterKey::from(parameter);
            changes.push((key, value(parameter, Direction::Positive, had)));
        } else {
            let of = |direction| (parameter.in_direction(direction), value(parameter, direction, had));
            changes.extend(Direction::BOTH.map(of));
        }
    }
    scene.with(&changes).ok()
}

fn mirrored(scene: &Scene) -> Option<Scene> {
    with_values(scene, |_, direction, had| had.get(Direction::of(-direction.sign())))
}

/// Powers of two in which mass, time and length are measured.
type Units = [i32; 3];

/// The powers of a parameter's unit, as the table writes it.
fn unit(parameter: Parameter) -> Units {
    let mut powers = [0; 3];
    for (part, sign) in parameter.info().unit.split('/').zip([1, -1]) {
        for factor in part.split(' ') {
            let (base, power) = factor.split_once('^').unwrap_or((factor, "1"));
            let base = match base {
                "kg" => [1, 0, 0],
                "s" => [0, 1, 0],
                "m" => [0, 0, 1],
                "N" => FORCE,
                "1" => [0; 3],
                _ => panic!("{parameter:?} is measured in {base}"),
            };
            let power = sign * power.parse::<i32>().expect("a power");
            powers
                .iter_mut()
                .zip(base)
                .for_each(|(sum, of_base)| *sum += power * of_base);
        }
    }
    powers
}

const FORCE: Units = [1, -2, 1];

fn factor(units: Units, unit: Units) -> f64 {
    2.0_f64.powi(units.iter().zip(unit).map(|(power, times)| power * times).sum())
}

fn scaled(scene: &Scene, units: Units) -> Option<Scene> {
    with_values(scene, |parameter, direction, had| {
        factor(units, unit(parameter)) * had.get(direction)
    })
}

/// Ticks whose forces are so many times as large.
fn measured_in(unit: f64, mut ticks: Vec<Tick>) -> Vec<Tick> {
    ticks.iter_mut().for_each(|(force, _)| *force /= unit);
    ticks
}

/// Whether its limit depends on the time at rest.
fn rises(scene: &Scene) -> bool {
    scene
        .value(Parameter::RisingRate)
        .is_some_and(|rate| rate.positive > 0.0)
}

/// A case whose parameter is at a special value, and the scene with the one next to it.
fn special(case: &mut Case, random: &mut Random) -> Option<Scene> {
    let scene = &case.scene;
    let has: Vec<Parameter> = scene.parameters();
    let parameter = random.one_of(&has);
    let tiny = 1e-12;
    let (at, next) = match parameter {
        // At once, or as good as never: what 0 stands for is not next to it.
        Parameter::RisingRate | Parameter::StribeckVelocity | Parameter::Mass | Parameter::ContactStiffness => {
            return None;
        }
        // Without a threshold a slide of the hand ends where it turns, and not where it rests.
        Parameter::VelocityThreshold if scene.is_on_device() => return None,
        // How long a contact has rested whose limits are equal cannot be derived from them.
        Parameter::StaticForce if rises(scene) => return None,
        Parameter::Exponent => {
            let at = random.one_of(&[0.0, 0.5, 1.0, 1.0, 2.0]);
            (
                at,
                at + random.one_of(&[tiny, -tiny, 2.0 * f64::EPSILON, -f64::EPSILON]),
            )
        }
        Parameter::StaticForce => {
            let force = scene.value(Parameter::DynamicForce)?.positive;
            (force, force * (1.0 + tiny))
        }
        Parameter::DynamicForce => {
            // Both directions alike, and nearly.
            let force = scene.value(parameter)?.positive;
            case.scene = scene.with(&[(parameter.into(), force)]).ok()?;
            let key = parameter.in_direction(Direction::Negative);
            return case.scene.with(&[(key, force * (1.0 - tiny))]).ok();
        }
        _ => (0.0, tiny),
    };
    case.scene = scene.with(&[(parameter.into(), at)]).ok()?;
    case.scene.with(&[(parameter.into(), next)]).ok()
}

/// A scene with a parameter changed by a share, and by as much the other way.
fn nudged(scene: &Scene, random: &mut Random) -> Option<[Scene; 2]> {
    let parameter = random.one_of(&scene.parameters());
    let info = parameter.info();
    let value = scene.value(parameter)?;
    let mut key = ParameterKey::from(parameter);
    if !value.is_symmetric() {
        key.direction = Some(Direction::Positive);
    }
    let value = value.positive;
    if value == 0.0 && (parameter == Parameter::RisingRate || scene.is_on_device()) {
        // As above: 0 has a meaning of its own.
        return None;
    }
    let by = if value == 0.0 { info.step * NUDGE } else { value * NUDGE };
    let moved = |by: f64| scene.with(&[(key, (value + by).clamp(info.min, info.max))]).ok();
    Some([moved(by)?, moved(-by)?])
}

/// A case done both ways: its forces, those of the variant in the same units, and so many times the
/// bound that they may differ by; `None` where the property has nothing to say of it.
fn both(property: Property, case: &mut Case, random: &mut Random) -> Option<(Vec<Tick>, Vec<Tick>, f64)> {
    if property == Property::Mirror && random.one_in(2) {
        *case = case.on_grid(1e-5, true);
    }
    if property == Property::Move {
        *case = case.on_grid(2.0_f64.powi(-30), false);
    }
    let mut next = None;
    if property == Property::Special {
        next = Some(special(case, random)?);
    }
    if property == Property::Rest && rises(&case.scene) {
        return None;
    }
    let Case { scene, period_s, hand } = &*case;
    let surface = renderer(scene, *period_s)?;
    let alike = follow(surface.clone(), hand, |_, _| {});
    let mut times = if property == Property::Cut { 1.0 } else { OF_A_RUN };
    let take_over = |surface: &mut Renderer, scene: &Scene| {
        if let Some(mut new) = renderer(scene, *period_s) {
            new.take_over(surface);
            *surface = new;
        }
    };
    let variant = match property {
        Property::Cut => follow_cut(surface, case),
        Property::Mirror => {
            let mut hand = hand.clone();
            for sample in &mut hand {
                (sample.position, sample.velocity) = (-sample.position, -sample.velocity);
            }
            let ticks = follow(renderer(&mirrored(scene)?, *period_s)?, &hand, |_, _| {});
            measured_in(-1.0, ticks)
        }
        Property::Scale => {
            let mut power = || random.one_of(&[-2, -1, 0, 1, 2]);
            let units = [power(), power(), power()];
            let (time, length) = (factor(units, [0, 1, 0]), factor(units, [0, 0, 1]));
            let mut hand = hand.clone();
            for sample in &mut hand {
                sample.elapsed_s *= time;
                sample.position *= length;
                sample.velocity *= length / time;
            }
            let by = factor(units, FORCE);
            // Its own least error is that of newtons.
            times *= (1.0 / by).max(1.0);
            let ticks = follow(renderer(&scaled(scene, units)?, period_s * time)?, &hand, |_, _| {});
            measured_in(by, ticks)
        }
        Property::Move => {
            let mut hand = hand.clone();
            let mut surface = surface;
            surface.start_at(1024.0, 0.0);
            for sample in &mut hand {
                sample.position += 1024.0;
            }
            follow(surface, &hand, |_, _| {})
        }
        Property::TakeOver => follow(surface, hand, |k, surface| {
            if k % 7 == 6 {
                take_over(surface, scene);
            }
        }),
        Property::Ramp => follow(surface, hand, |_, surface| take_over(surface, scene)),
        Property::Nudge => {
            let nudged = nudged(scene, random)?;
            let at = random.one_of(&[3_usize, 10, 20, 30]);
            times = MADE_BY_A_NUDGE;
            let [mut ticks, other] = nudged.map(|nudged| {
                follow(surface.clone(), hand, |k, surface| {
                    if k == at {
                        take_over(surface, &nudged);
                    }
                })
            });
            // On a threshold one of the two is on the other side of it.
            for (tick, (other, &(force, _))) in ticks.iter_mut().zip(other.into_iter().zip(&alike)) {
                if (other.0 - force).abs() < (tick.0 - force).abs() {
                    *tick = other;
                }
            }
            // It may grow with time where a block swings.
            ticks.truncate(at + 3);
            ticks
        }
        Property::Rest => {
            let mut surface = surface;
            for _ in 0..5 {
                surface.tick(*period_s, 0.0, 0.0);
            }
            follow(surface, hand, |_, _| {})
        }
        Property::Special => follow(renderer(&next?, *period_s)?, hand, |_, _| {}),
    };
    Some((alike, variant, times))
}

/// Tries a property in a random case of a law.
pub(crate) fn attempt(property: Property, law: &str, has_block: bool, random: &mut Random) -> Option<Found> {
    let mut case = Case::draw(law, has_block, random)?;
    let (alike, variant, times) = both(property, &mut case, random)?;
    let mut found = Found::default();
    let farthest = case.hand.iter().map(|sample| sample.position.abs()).fold(0.0, f64::max);
    let farthest = if property == Property::Move {
        1024.0 + farthest
    } else {
        farthest
    };
    let digits = LAST_DIGITS * case.stiffness() * (f64::EPSILON * farthest);
    let mut greatest: f64 = 0.0;
    for (k, (&(force, exhausted), &(other, also))) in alike.iter().zip(&variant).enumerate() {
        if exhausted || also {
            found.exhausted = true;
            break;
        }
        found.ticks += 1;
        greatest = greatest.max(force.abs());
        let bound = times * ((SHARE * greatest).max(MIN_N) + digits);
        let error = (force - other).abs();
        if error.is_nan() || error > bound {
            if decided(&case, k, error, bound) {
                found.decided = true;
                break;
            }
            let ratio = if error.is_nan() { f64::INFINITY } else { error / bound };
            let what = format!(
                "{property:?} at tick {k}: {force} N, {other} N, which is {ratio:.1e} times the bound of {bound:.1e} N, of \
                 {:?} at {:.3e} s: {:?}",
                case.scene,
                case.period_s,
                &case.hand[k.saturating_sub(1)..=k]
            );
            found.wrong = Some((ratio, what));
            break;
        }
        found.worst = found.worst.max(error / bound);
    }
    Some(found)
}

/// Whether a push of the bound's size, or a parameter that is another in its last digits, makes as much of the force
/// at a tick as what is wrong there: a decision lies within the bound of its threshold.
fn decided(case: &Case, tick: usize, error: f64, bound: f64) -> bool {
    let force = |scene: &Scene, by: f64| {
        let mut hand = case.hand[..=tick].to_vec();
        for sample in &mut hand {
            sample.position += by;
        }
        let surface = renderer(scene, case.period_s)?;
        Some(follow(surface, &hand, |_, _| {})[tick].0)
    };
    let Some(there) = force(&case.scene, 0.0) else {
        return false;
    };
    let flips = |other: Option<f64>| other.is_some_and(|other| (other - there).abs() > 0.5 * error);
    let by = bound / case.stiffness().max(1e-9);
    let pushes = [0.25, -0.25, 0.05, -0.05];
    pushes.iter().any(|share| flips(force(&case.scene, share * by)))
        || case.scene.parameters().into_iter().any(|parameter| {
            Direction::BOTH.into_iter().any(|direction| {
                let mut key = ParameterKey::from(parameter);
                if parameter.info().directional {
                    key.direction = Some(direction);
                }
                let value = case.scene.value(parameter).map_or(0.0, |value| value.get(direction));
                [1.0 + LAST, 1.0 - LAST].iter().any(|times| {
                    let scene = case.scene.with(&[(key, value * times)]);
                    scene.is_ok_and(|scene| flips(force(&scene, 0.0)))
                })
            })
        })
}

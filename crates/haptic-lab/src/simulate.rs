//! A scene rendered along a motion, on a line or in the plane, tick by tick as the daemon does it: the
//! same in every run, to the last bit.

use crate::motion::{DeviceSample, median_period_s};
use haptic_core::block::{Contact, EventSink};
use haptic_core::{Renderer, Rendering, Scene, SceneError, Scheme, Vector};
use haptic_motion::median::median;
use std::io;
use std::time::Instant;

/// Where the block begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Start<V = f64> {
    /// Block position, m; the device's first position when absent.
    pub position_m: Option<V>,
    /// Block velocity, m/s; a block that moves begins sliding.
    pub velocity_mps: V,
}

/// The block after a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimulatedRow<V = f64> {
    /// The sample.
    pub device: DeviceSample<V>,
    /// Block position, m.
    pub block_position_m: V,
    /// Block velocity, m/s.
    pub block_velocity_mps: V,
    /// Coupling force on the block, N; the hand feels its negative.
    pub coupling_force_n: V,
    /// Contact with the surface.
    pub contact: Contact,
    /// Whether the tick's bounded work ran out.
    pub at_bound: bool,
}

/// A change of contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactChange {
    /// When, s.
    pub t_s: f64,
    /// From this contact.
    pub from: Contact,
    /// To this contact.
    pub to: Contact,
}

/// Result of a run.
#[derive(Clone, Debug, Default)]
pub struct Simulation<V = f64> {
    /// One row for each sample.
    pub rows: Vec<SimulatedRow<V>>,
    /// The changes of contact.
    pub events: Vec<ContactChange>,
    /// Energy that friction put into the block, J. A friction that only opposes motion gives 0.
    pub energy_created_j: f64,
    /// Ticks whose bounded work ran out.
    pub exhausted_ticks: u64,
}

struct Listener<'a> {
    tick_began_s: f64,
    events: &'a mut Vec<ContactChange>,
    energy_created_j: f64,
}

impl EventSink for Listener<'_> {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        self.events.push(ContactChange {
            t_s: self.tick_began_s + at_s,
            from,
            to,
        });
    }

    fn dissipated(&mut self, energy_j: f64) {
        self.energy_created_j += (-energy_j).max(0.0);
    }
}

/// A scene rendered one sample after another.
#[derive(Debug)]
pub struct Simulator<V: Vector = f64> {
    renderer: V::Renderer,
    last_s: f64,
    energy_created_j: f64,
    exhausted_ticks: u64,
}

impl<V: Vector> Simulator<V> {
    /// Begins at the first sample of a motion whose samples are `period_s` apart.
    ///
    /// # Errors
    /// The scene cannot be rendered at this rate.
    pub fn new(
        scene: &Scene,
        scheme: Scheme,
        period_s: f64,
        first: &DeviceSample<V>,
        start: Start<V>,
    ) -> Result<Self, SceneError> {
        Ok(Self {
            renderer: renderer_at(scene, scheme, period_s, first, start)?,
            last_s: first.t_s,
            energy_created_j: 0.0,
            exhausted_ticks: 0,
        })
    }

    /// A meter of the ticks from here on, after `last`.
    #[must_use]
    pub fn cost_meter(&self, last: &DeviceSample<V>) -> CostMeter<V> {
        CostMeter {
            renderer: self.renderer.clone(),
            last: *last,
            batches: Vec::new(),
            worst_ns: 0,
        }
    }

    /// The block after a sample; adds the changes of contact on the way. No time passes before the
    /// first sample: its row is the start.
    pub fn step(&mut self, sample: &DeviceSample<V>, events: &mut Vec<ContactChange>) -> SimulatedRow<V> {
        let mut listener = Listener {
            tick_began_s: self.last_s,
            events,
            energy_created_j: 0.0,
        };
        let rendered = self.renderer.render_with_events(
            sample.t_s - self.last_s,
            sample.position_m,
            sample.velocity_mps,
            &mut listener,
        );
        self.energy_created_j += listener.energy_created_j;
        self.exhausted_ticks += u64::from(rendered.work_exhausted);
        self.last_s = sample.t_s;
        let block = self.renderer.shown();
        SimulatedRow {
            device: *sample,
            block_position_m: block.position,
            block_velocity_mps: block.velocity,
            coupling_force_n: rendered.coupling_force,
            contact: block.contact,
            at_bound: rendered.work_exhausted,
        }
    }

    /// Energy that friction has put into the block, J; on the device itself in the plane it is not measured.
    #[must_use]
    pub fn energy_created_j(&self) -> f64 {
        self.energy_created_j
    }

    /// Ticks whose bounded work ran out.
    #[must_use]
    pub fn exhausted_ticks(&self) -> u64 {
        self.exhausted_ticks
    }
}

/// Renders `scene` along `motion`.
///
/// # Errors
/// The scene cannot be rendered at the rate of the motion.
pub fn simulate<V: Vector>(
    scene: &Scene,
    scheme: Scheme,
    motion: &[DeviceSample<V>],
    start: Start<V>,
) -> Result<Simulation<V>, SceneError> {
    let first = motion.first().copied().unwrap_or_default();
    let mut simulator = Simulator::new(scene, scheme, median_period_s(motion), &first, start)?;
    let mut events = Vec::new();
    let rows = motion
        .iter()
        .map(|sample| simulator.step(sample, &mut events))
        .collect();
    Ok(Simulation {
        rows,
        events,
        energy_created_j: simulator.energy_created_j,
        exhausted_ticks: simulator.exhausted_ticks,
    })
}

pub(crate) fn renderer(
    scene: &Scene,
    scheme: Scheme,
    motion: &[DeviceSample],
    start: Start,
) -> Result<Renderer, SceneError> {
    let first = motion.first().copied().unwrap_or_default();
    renderer_at(scene, scheme, median_period_s(motion), &first, start)
}

fn renderer_at<V: Vector>(
    scene: &Scene,
    scheme: Scheme,
    period_s: f64,
    first: &DeviceSample<V>,
    start: Start<V>,
) -> Result<V::Renderer, SceneError> {
    let mut renderer = V::Renderer::new(scene, scheme, period_s)?;
    let position = start.position_m.unwrap_or(first.position_m);
    renderer.hold_at(position, start.velocity_mps, first.position_m, first.velocity_mps);
    Ok(renderer)
}

/// Cost of a tick on this machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Median over batches of ticks, ns.
    pub median_ns: f64,
    /// The slowest single tick, ns; on a busy machine another program's work.
    pub worst_ns: u64,
}

/// Ticks timed together, so that the clock's own cost does not count.
const BATCH: usize = 100;
/// Whole runs that the median is taken over.
const RUNS: usize = 5;

/// Measures the ticks that a [`Simulator`] does, without the bookkeeping, one stretch of the motion
/// after another.
#[derive(Debug)]
pub struct CostMeter<V: Vector = f64> {
    renderer: V::Renderer,
    last: DeviceSample<V>,
    batches: Vec<f64>,
    worst_ns: u64,
}

impl<V: Vector> CostMeter<V> {
    /// Measures the ticks up to each sample of a stretch; the first sample of all has none.
    pub fn measure(&mut self, stretch: &[DeviceSample<V>]) {
        let tick = |renderer: &mut V::Renderer, last: &mut DeviceSample<V>, to: &DeviceSample<V>| {
            std::hint::black_box(renderer.render(to.t_s - last.t_s, to.position_m, to.velocity_mps));
            *last = *to;
        };
        let stretch = match stretch {
            [first, rest @ ..] if *first == self.last => rest,
            all => all,
        };
        for _ in 0..RUNS {
            let (mut renderer, mut last) = (self.renderer.clone(), self.last);
            for ticks in stretch.chunks(BATCH) {
                let began = Instant::now();
                for to in ticks {
                    tick(&mut renderer, &mut last, to);
                }
                self.batches
                    .push(began.elapsed().as_nanos() as f64 / ticks.len() as f64);
            }
        }
        for to in stretch {
            let began = Instant::now();
            tick(&mut self.renderer, &mut self.last, to);
            let took_ns = u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX);
            self.worst_ns = self.worst_ns.max(took_ns);
        }
    }

    /// What was measured.
    #[must_use]
    pub fn cost(mut self) -> Cost {
        Cost {
            median_ns: median(&mut self.batches).unwrap_or(0.0),
            worst_ns: self.worst_ns,
        }
    }
}

/// Measures the cost of the ticks that [`simulate`] does, without the bookkeeping.
///
/// # Errors
/// The scene cannot be rendered at the rate of the motion.
pub fn measure_cost(scene: &Scene, scheme: Scheme, motion: &[DeviceSample], start: Start) -> Result<Cost, SceneError> {
    let first = motion.first().copied().unwrap_or_default();
    let simulator = Simulator::new(scene, scheme, median_period_s(motion), &first, start)?;
    let mut meter = simulator.cost_meter(&first);
    meter.measure(motion);
    Ok(meter.cost())
}

/// Cost of the ticks of a motion one by one, on this machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickCost {
    /// The median tick, ns.
    pub median_ns: f64,
    /// The dearest tick, ns.
    pub dearest_ns: f64,
}

/// Copies of a tick that are timed together.
const COPIES: usize = 8;
/// Times that they are; a tick's cost is the least, which no other program has part in.
const TIMES: usize = 3;

/// Measures each tick of a motion by itself, over and over from its own state.
///
/// # Errors
/// The scene cannot be rendered at the rate of the motion.
pub fn tick_cost(scene: &Scene, scheme: Scheme, motion: &[DeviceSample]) -> Result<TickCost, SceneError> {
    let renderer = renderer(scene, scheme, motion, Start::default())?;
    Ok(cost_of_ticks(renderer, motion, |renderer, from, to| {
        std::hint::black_box(renderer.tick(to.t_s - from.t_s, to.position_m, to.velocity_mps));
    }))
}

/// The same of anything that a tick moves on from one sample to the next.
pub(crate) fn cost_of_ticks<T: Clone, V>(
    mut block: T,
    motion: &[DeviceSample<V>],
    tick: impl Fn(&mut T, &DeviceSample<V>, &DeviceSample<V>),
) -> TickCost {
    let mut costs = Vec::with_capacity(motion.len());
    for pair in motion.windows(2) {
        let (from, to) = (&pair[0], &pair[1]);
        let least = (0..TIMES)
            .map(|_| {
                let mut copies: [T; COPIES] = std::array::from_fn(|_| block.clone());
                let began = Instant::now();
                for copy in &mut copies {
                    tick(copy, from, to);
                }
                began.elapsed().as_nanos() as f64 / COPIES as f64
            })
            .fold(f64::INFINITY, f64::min);
        costs.push(least);
        tick(&mut block, from, to);
    }
    let dearest_ns = costs.iter().copied().fold(0.0, f64::max);
    TickCost {
        median_ns: median(&mut costs).unwrap_or(0.0),
        dearest_ns,
    }
}

/// Writes the header of [`write_rows`].
///
/// # Errors
/// The output cannot be written.
pub fn write_rows_header<V: Vector>(mut out: impl io::Write) -> io::Result<()> {
    let second_axis = if V::AXES == 2 {
        ",device_position_y_m,device_velocity_y_mps,block_position_y_m,block_velocity_y_mps,coupling_force_y_N,\
         command_force_y_N"
    } else {
        ""
    };
    writeln!(
        out,
        "t_s,device_position_m,device_velocity_mps,block_position_m,block_velocity_mps,coupling_force_N,\
         contact{second_axis}"
    )
}

/// Writes rows as CSV, numbers in full precision.
///
/// # Errors
/// The output cannot be written.
pub fn write_rows<V: Vector>(rows: &[SimulatedRow<V>], mut out: impl io::Write) -> io::Result<()> {
    for row in rows {
        let vectors = [
            row.device.position_m,
            row.device.velocity_mps,
            row.block_position_m,
            row.block_velocity_mps,
            row.coupling_force_n,
        ];
        write!(out, "{}", row.device.t_s)?;
        for cell in vectors.map(V::first) {
            write!(out, ",{cell}")?;
        }
        write!(out, ",{}", row.contact.as_number())?;
        if V::AXES == 2 {
            let cells = vectors.map(V::second);
            let [.., coupling_n] = cells;
            for cell in cells.into_iter().chain([-coupling_n]) {
                write!(out, ",{cell}")?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Writes the header of [`write_events`].
///
/// # Errors
/// The output cannot be written.
pub fn write_events_header(mut out: impl io::Write) -> io::Result<()> {
    writeln!(out, "t_s,from,to")
}

/// Writes changes of contact as CSV, numbers in full precision.
///
/// # Errors
/// The output cannot be written.
pub fn write_events(events: &[ContactChange], mut out: impl io::Write) -> io::Result<()> {
    for event in events {
        writeln!(out, "{},{},{}", event.t_s, event.from.as_number(), event.to.as_number())?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull() -> Vec<DeviceSample> {
        (0..2000)
            .map(|k| {
                let phase = 0.0126 * f64::from(k);
                DeviceSample {
                    t_s: 5.0 + f64::from(k) * 1e-3,
                    position_m: -0.03 * phase.cos(),
                    velocity_mps: 0.378 * phase.sin(),
                }
            })
            .collect()
    }

    #[test]
    fn run_has_a_row_per_sample_and_starts_as_requested() {
        let motion = pull();
        let run = simulate(&Scene::paper(), Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        assert_eq!(run.rows.len(), motion.len());
        assert_eq!(run.rows[0].block_position_m, motion[0].position_m);
        assert_eq!(run.rows[0].contact, Contact::Stuck);
        assert!(run.events.len() > 10 && run.events[0].t_s > 5.0);
        assert_eq!(run.energy_created_j, 0.0);
        let moving = Start {
            position_m: Some(-0.0301),
            velocity_mps: 0.2,
        };
        let run = simulate(&Scene::paper(), Scheme::Exact, &motion, moving).expect("a valid scene");
        assert_eq!(run.rows[0].block_position_m, -0.0301);
        assert_eq!(run.rows[0].contact.as_number(), 1);
    }

    #[test]
    fn literal_scheme_creates_energy_and_substeps_cut_its_error() {
        let motion = pull();
        let exact = simulate(&Scene::paper(), Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        let error = |scheme: &str| {
            let scheme = scheme.parse().expect("a scheme");
            let run = simulate(&Scene::paper(), scheme, &motion, Start::default()).expect("a valid scene");
            let worst = run
                .rows
                .iter()
                .zip(&exact.rows)
                .map(|(row, truth)| (row.coupling_force_n - truth.coupling_force_n).abs())
                .fold(0.0, f64::max);
            (worst, run.energy_created_j)
        };
        let [one, ten, hundred] = ["literal", "literal:10", "literal:100"].map(error);
        println!("{one:?} {ten:?} {hundred:?}");
        assert!(one.1 > 1e-4, "{one:?}");
        assert!(
            one.0 > 3.0 * ten.0 && ten.0 > 3.0 * hundred.0,
            "{one:?} {ten:?} {hundred:?}"
        );
    }

    #[test]
    fn files_keep_every_digit() {
        let motion = pull();
        let run = simulate(&Scene::paper(), Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        let (mut rows, mut events) = (Vec::new(), Vec::new());
        write_rows(&run.rows, &mut rows).expect("written");
        write_events(&run.events, &mut events).expect("written");
        let text = String::from_utf8(rows).expect("text");
        let line = text.lines().nth(700).expect("a row");
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        assert_eq!(cells[3].to_bits(), run.rows[700].block_position_m.to_bits());
        assert_eq!(cells[5].to_bits(), run.rows[700].coupling_force_n.to_bits());
        assert_eq!(
            String::from_utf8(events).expect("text").lines().count(),
            run.events.len()
        );
    }
}

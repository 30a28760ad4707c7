//! The truth of a plant is found again from the motions by which a rig is identified: the plant of the fake rig and the
//! daemon's own estimator and excitation, in a 1 kHz loop without a clock.

use device_io::Device;
use device_io::fake::{FakeRig, Hand, RigProperties};
use haptic_core::velocity::{Estimator, Method};
use haptic_core::{Course, Excitation, OwnMotion};
use haptic_ipc::{IdentificationReply, Peer, Sample};
use haptic_lab::identify::cogging::{SweepSample, at_speed};
use haptic_lab::identify::plan::Bounds;
use haptic_lab::identify::record_file::of_device;
use haptic_lab::identify::rig_itself::{self, RigItself};
use haptic_lab::identify::{Clocks, ModelKind, Options, identify};
use std::collections::VecDeque;

const PERIOD_NS: u64 = 1_000_000;

/// Ticks without force between two motions.
const REST_TICKS: usize = 200;

/// A rig that is moved, tick by tick.
struct Loop {
    rig: FakeRig,
    velocity: Estimator,
    now_ns: u64,
    rows: Vec<Sample>,
    /// Commands on their way to the motor, N.
    under_way: VecDeque<f64>,
}

impl Loop {
    /// A motor whose force acts so many ticks after its command.
    fn new(properties: RigProperties, late_ticks: usize) -> Self {
        Self {
            rig: FakeRig::new(properties, Hand::Free),
            velocity: Estimator::new(Method::default(), 1e-3, properties.resolution_m),
            now_ns: 0,
            rows: Vec::new(),
            under_way: vec![0.0; late_ticks].into(),
        }
    }

    /// A tick of a motion; returns position and force.
    fn tick(&mut self, motion: &mut OwnMotion) -> (f64, f64) {
        let sample = self.rig.read(self.now_ns).expect("it is there");
        let speed = self.velocity.update(1e-3, sample.position_m);
        let force_n = -motion.tick(1e-3, sample.position_m, speed);
        self.under_way.push_back(force_n);
        let arrived_n = self.under_way.pop_front().expect("it was put there");
        self.rig.write(arrived_n, true).expect("it is there");
        self.rows.push(Sample {
            tick: self.rows.len() as u64,
            t_s: self.now_ns as f64 * 1e-9,
            device_position_m: sample.position_m,
            device_sequence: sample.sequence,
            device_time_ns: self.now_ns,
            sample_position_m: sample.position_m,
            command_force_n: force_n,
            ..Sample::default()
        });
        self.now_ns += PERIOD_NS;
        (sample.position_m, force_n)
    }

    /// A motion from rest to rest: what a sweep is judged by.
    fn excite(&mut self, excitation: Excitation) -> Vec<SweepSample> {
        let (mut rest, mut place_m) = (OwnMotion::REST, 0.0);
        for _ in 0..REST_TICKS {
            (place_m, _) = self.tick(&mut rest);
        }
        let mut motion = OwnMotion::excitation(excitation, 1e-3).expect("bounded");
        motion.place(place_m, 0.0);
        let mut ticks = Vec::new();
        loop {
            let (position_m, force_n) = self.tick(&mut motion);
            if motion.end().is_some() {
                return at_speed(&ticks, 1e-3);
            }
            let (_, reference_mps) = motion.reference();
            ticks.push((position_m, reference_mps, force_n));
        }
    }
}

/// What `haptic-ctl identify --rig` finds on a plant.
fn measured(properties: RigProperties) -> RigItself {
    let mut rig = Loop::new(properties, 0);
    let bounds = Bounds::new(&of_rig(properties.resolution_m), None, None);
    let chirp = bounds.chirp(12.0, 1.0);
    rig.excite(chirp);
    rig.excite(bounds.ramps(1));
    let sweep = rig.excite(bounds.sweep());
    let least_s = chirp.duration_s() + bounds.ramps(1).duration_s() + bounds.sweep().duration_s();
    let record_s = rig.rows.len() as f64 * 1e-3;
    assert!(
        record_s > least_s,
        "no motion has ended early: {record_s} s of {least_s} s"
    );
    let record = of_device(&rig.rows, properties.resolution_m);
    rig_itself::measure(&record, &sweep, 0.0).expect("a usable record")
}

/// A rig of 20 N with 100 mm of range.
fn of_rig(resolution_m: f64) -> IdentificationReply {
    IdentificationReply {
        by: Peer::default(),
        rig: "fake".to_owned(),
        firmware: "fake".to_owned(),
        moving: false,
        ended: None,
        force_limit_n: 10.0,
        range_m: 0.1,
        middle_m: 0.0,
        travel_limit_m: 0.05,
        friction_n: None,
        friction: None,
        resolution_m,
        ramp_ms: 20.0,
        position_m: 0.0,
        excitations: 0,
        gone_s: None,
        last: None,
        path: None,
    }
}

#[test]
fn mass_friction_by_direction_and_cogging_of_a_rig_are_found() {
    let truth = RigProperties {
        mass_kg: 1.0,
        friction_n: 0.9,
        negative_friction_n: Some(0.7),
        damping_ns_per_m: 3.0,
        cogging_n: 0.25,
        cogging_pitch_m: 0.006,
        ..RigProperties::default()
    };
    let found = measured(truth);
    println!("{found:#?}");
    let friction = found.friction().expect("all of it was found");
    let cogging = found.cogging.expect("it was found");
    for (name, value, truth, within) in [
        ("mass, kg", friction.mass, 1.0, 0.02),
        ("friction +, N", friction.dynamic_force.positive, 0.9, 0.02),
        ("friction -, N", friction.dynamic_force.negative, 0.7, 0.02),
        ("viscous +, N s/m", friction.viscous.positive, 3.0, 0.05),
        ("viscous -, N s/m", friction.viscous.negative, 3.0, 0.05),
        ("cogging, N", cogging.amplitude_n, 0.25, 0.05),
        ("period, m", cogging.cogging.period_m, 0.006, 0.005),
        // Against the positive axis: the plant's own force, the other way round.
        ("its sine, N", cogging.cogging.harmonics[0].sine, 0.25, 0.05),
    ] {
        let is_within = (value - truth).abs() <= within * truth;
        assert!(is_within, "{name}: {value}, truly {truth}");
    }
}

/// As `identify --run` and a recording of it are read.
#[test]
fn intervals_of_a_late_motor_hold_the_truth() {
    let truth = RigProperties {
        mass_kg: 1.4,
        friction_n: 0.8,
        damping_ns_per_m: 2.0,
        ..RigProperties::default()
    };
    for late_ticks in [0, 1, 4] {
        let mut rig = Loop::new(truth, late_ticks);
        let bounds = Bounds::new(&of_rig(truth.resolution_m), None, None);
        rig.excite(bounds.chirp(12.0, 1.0));
        rig.excite(bounds.ramps(1));
        let options = Options {
            offset_n: Some(0.0),
            clocks: Clocks::Commanded(0.021),
            ..Options::new(ModelKind::Karnopp)
        };
        let found = identify(&of_device(&rig.rows, truth.resolution_m), &options).expect("a usable record");
        println!("{late_ticks}: {found:#?}");
        for (name, truth) in [
            ("mass_kg", truth.mass_kg),
            ("dynamic_force_N.positive", truth.friction_n),
            ("dynamic_force_N.negative", truth.friction_n),
            ("viscous_Ns_per_m.positive", truth.damping_ns_per_m),
            ("viscous_Ns_per_m.negative", truth.damping_ns_per_m),
        ] {
            let [low, high] = found.intervals[name];
            assert!(
                low <= truth && truth <= high,
                "{late_ticks} ticks late, {name}: {truth} in {low} to {high}"
            );
        }
    }
}

/// Strokes of one frequency do not determine the delay: the intervals hold for any up to the longest.
#[test]
fn intervals_hold_where_the_delay_is_not_determined() {
    let truth = RigProperties {
        damping_ns_per_m: 2.0,
        ..RigProperties::default()
    };
    let mut rig = Loop::new(truth, 2);
    rig.excite(Excitation {
        course: Course::Chirp {
            amplitude_m: 0.005,
            from_hz: 2.0,
            to_hz: 2.0,
            duration_s: 12.0,
        },
        ..Bounds::new(&of_rig(truth.resolution_m), None, None).chirp(12.0, 1.0)
    });
    let options = Options {
        mass_kg: Some(truth.mass_kg),
        offset_n: Some(0.0),
        clocks: Clocks::Commanded(0.004),
        ..Options::new(ModelKind::Karnopp)
    };
    let found = identify(&of_device(&rig.rows, truth.resolution_m), &options).expect("a usable record");
    println!("{found:#?}");
    let is_said = |note: &String| note.contains("how much the force acts after its command");
    assert!(found.notes.iter().any(is_said), "{:?}", found.notes);
    for name in ["viscous_Ns_per_m.positive", "viscous_Ns_per_m.negative"] {
        let [low, high] = found.intervals[name];
        assert!((low..=high).contains(&2.0), "{name}: 2 in {low} to {high}");
    }
}

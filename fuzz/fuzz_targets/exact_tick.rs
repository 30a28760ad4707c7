//! Whatever the scene and whatever the device says, the exact tick gives numbers, goes the way it
//! slides, does bounded work, and takes no energy from friction.
#![no_main]

use arbitrary::Arbitrary;
use haptic_core::block::{Contact, EventSink};
use haptic_core::{ParameterKey, Renderer, Scene, Scheme};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Case {
    /// Exponents of ten over the accepted ranges, by parameter; the smallest stands for zero.
    parameters: [u8; 10],
    start: (i16, i16),
    samples: Vec<(u16, i16, i16)>,
}

/// A byte spread over the decades of a range.
fn decade(byte: u8, low: f64, high: f64) -> f64 {
    10_f64.powf(low + (high - low) * f64::from(byte) / 255.0)
}

fn or_zero(byte: u8, low: f64, high: f64) -> f64 {
    if byte == 0 { 0.0 } else { decade(byte, low, high) }
}

struct NoEnergy;

impl EventSink for NoEnergy {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        assert!(at_s >= 0.0 && from != to);
    }

    fn dissipated(&mut self, energy_j: f64) {
        assert!(energy_j >= 0.0, "friction pushed: {energy_j} J");
    }
}

fuzz_target!(|case: Case| {
    let p = case.parameters;
    let (plus, minus) = (or_zero(p[3], -6.0, 3.0), or_zero(p[4], -6.0, 3.0));
    let values = [
        ("M", decade(p[0], -6.0, 2.0)),
        ("K", or_zero(p[1], -6.0, 6.477)),
        ("B", or_zero(p[2], -6.0, 4.0)),
        ("Fs+", plus),
        ("Fs-", minus),
        ("Fd+", plus * f64::from(p[5]) / 200.0),
        ("Fd-", minus * f64::from(p[6]) / 255.0),
        ("b+", or_zero(p[7], -6.0, 4.0)),
        ("b-", or_zero(p[8], -6.0, 4.0)),
        ("DV", or_zero(p[9], -6.0, 0.0)),
    ]
    .map(|(name, value)| (name.parse::<ParameterKey>().expect("a parameter"), value));
    let Ok(scene) = Scene::paper().with(&values) else { return };
    let Ok(mut renderer) = Renderer::new(&scene, Scheme::Exact, 1e-3) else { return };
    let position = |count: i16| f64::from(count) * 1e-5;
    renderer.start_at(position(case.start.0), position(case.start.1));
    for (time, p, v) in case.samples {
        // From a microsecond to a missed second.
        let elapsed = decade((time >> 8) as u8, -6.0, 0.0) * f64::from(time & 0xff) / 128.0;
        let rendered = renderer.tick_with_events(elapsed, position(p), f64::from(v) * 1e-3, &mut NoEnergy);
        let state = renderer.state();
        assert!(rendered.coupling_force.is_finite() && state.position.is_finite() && state.velocity.is_finite());
        assert!(rendered.events <= 271, "{rendered:?}");
        match state.contact {
            Contact::Stuck => assert_eq!(state.velocity, 0.0),
            Contact::Sliding(direction) => assert!(direction.sign() * state.velocity >= 0.0, "{state:?}"),
        }
    }
});

//! Draws how often a block lets go of a hand that keeps its speed, as rendered and as reckoned.
//!
//!     cargo run --release -p haptic-lab --example stick-slip > stick-slip.svg
//!
//! Lines are what the adviser reckons from one period of the exact block. Dots are counted: the
//! renderer is pulled for 20 s at 1 kHz, and each breakaway of its second half counts. How far the
//! dots are off their lines is printed on standard error.

use haptic_core::adviser::stick_slip;
use haptic_core::block::Contact;
use haptic_core::{Renderer, Scene, SceneError, Scheme};
use haptic_lab::drawing::{Chart, Trace, svg};

/// Time between ticks, s, and their number.
const TICK_S: f64 = 1e-3;
const TICKS: u32 = 20_000;

/// Surfaces: `DV`, m/s, and `gamma`, 1/s.
const SURFACES: [(&str, f64, f64); 5] = [
    ("DV = 0", 0.0, 0.0),
    ("DV = 5 mm/s", 5e-3, 0.0),
    ("DV = 20 mm/s", 20e-3, 0.0),
    ("stiction rises at 5/s", 0.0, 5.0),
    ("stiction rises at 50/s", 0.0, 50.0),
];

/// A block of 0.5 kg in a coupling of 2 kN/m, which lets go at 6 N and slides at 3 N.
fn scene(threshold: f64, rate: f64) -> Result<Scene, SceneError> {
    let values = [
        ("K", 2000.0),
        ("B", 2.0),
        ("Fs", 6.0),
        ("Fd", 3.0),
        ("DV", threshold),
        ("gamma", rate),
    ];
    let changes = values.map(|(name, value)| (name.parse().expect("a parameter of the table"), value));
    Scene::paper().with(&changes)
}

/// Breakaways a second of a hand that pulls at a speed, m/s; 0 where the block slides on.
fn rendered(scene: &Scene, speed: f64) -> Result<f64, SceneError> {
    let mut renderer = Renderer::new(scene, Scheme::Exact, TICK_S)?;
    renderer.start_at(0.0, 0.0);
    let mut breakaways = Vec::new();
    for tick in 0..TICKS {
        let from_s = f64::from(tick) * TICK_S;
        let mut listener = |at_s: f64, from: Contact, _: Contact| {
            if from == Contact::Stuck && tick > TICKS / 2 {
                breakaways.push(from_s + at_s);
            }
        };
        renderer.tick_with_events(TICK_S, speed * (from_s + TICK_S), speed, &mut listener);
    }
    Ok(match breakaways.as_slice() {
        [first, .., last] => (breakaways.len() - 1) as f64 / (last - first),
        _ => 0.0,
    })
}

/// The chart, and the greatest share by which a dot is off its line.
fn chart() -> Result<(Chart, f64), Box<dyn std::error::Error>> {
    let mut chart = Chart::new(
        "Stick-slip: lines reckoned, dots rendered",
        "Speed of the hand (mm/s)",
        "Breakaways a second (Hz)",
    );
    let mut worst = 0.0_f64;
    let mut dots = Vec::new();
    for (colour, (name, threshold, rate)) in SURFACES.into_iter().enumerate() {
        let scene = scene(threshold, rate)?;
        let reckoned = |speed: f64| {
            Ok::<_, Box<dyn std::error::Error>>(stick_slip(&scene, speed)?.map(|found| found.frequency_hz))
        };
        let mut line = Vec::new();
        for k in 1..=150 {
            let speed = f64::from(k) * 1e-3;
            line.push([speed * 1e3, reckoned(speed)?.unwrap_or(f64::NAN)]);
        }
        let mut counted = Vec::new();
        for k in 0..15 {
            let speed = f64::from(2 + 10 * k) * 1e-3;
            let (found, frequency) = (reckoned(speed)?, rendered(&scene, speed)?);
            worst = worst.max(found.map_or(frequency, |found| (frequency / found - 1.0).abs()));
            if frequency > 0.0 {
                counted.push([speed * 1e3, frequency]);
            }
        }
        chart = chart.with(Trace::line(name, line).in_colour(colour));
        dots.push(Trace::dots("", counted).in_colour(colour));
    }
    // Above all lines.
    Ok((dots.into_iter().fold(chart, Chart::with), worst))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (chart, worst) = chart()?;
    println!("{}", svg(&[chart]));
    eprintln!("rendered and reckoned differ by {worst:.1e} of the frequency at most");
    Ok(())
}

#[test]
fn what_is_rendered_is_what_is_reckoned() {
    let (chart, worst) = chart().expect("every surface is reckoned");
    assert!(worst < 1e-3, "{worst}");
    assert!(svg(&[chart]).contains("DV = 20 mm/s"));
}

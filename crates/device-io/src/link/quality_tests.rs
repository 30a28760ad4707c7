//! What a bad line does to the force, and what comes through one: the host's session and the fake
//! firmware at the two ends of channels that fail on purpose, in a time of their own. The same
//! numbers come out every time.

use super::connector::LoopTiming;
use super::health::LinkCounters;
use super::serial::Reader;
use super::session::LinkSession;
use super::session::tests::greeted_firmware;
use crate::fake::{Channel, Firmware, Quality};
use crate::protocol::frame::{Decoder, Frame};
use crate::protocol::message::{FromDevice, FromHost};
use crate::protocol::view::View;
use haptic_core::velocity::{Estimator, Method};
use haptic_core::{Renderer, Scene, Scheme};
use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

const MS: u64 = 1_000_000;
/// The firmware and the line are looked at so often, ns.
const STEP_NS: u64 = MS / 20;

/// A rig on a line, and a loop that renders the paper's scene on it.
struct Rendering {
    firmware: Firmware,
    decoder: Decoder,
    up: Channel,
    down: Channel,
    quality: Quality,
    reader: Reader,
    session: LinkSession,
    counters: Arc<LinkCounters>,
    velocity: Estimator,
    renderer: Renderer,
    /// The device's time and the velocity at the newest sample.
    last: Option<(u64, f64)>,
    now_ns: u64,
    /// Every sample that the firmware sent.
    sent: Vec<FromDevice>,
    /// Everything that was read at the other end.
    taken: Vec<FromDevice>,
}

impl Rendering {
    fn new(quality: Quality) -> Self {
        let now_ns = 1000 * MS;
        let (firmware, hello) = greeted_firmware(now_ns);
        let counters = Arc::new(LinkCounters::default());
        let mut renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
        renderer.start_at(0.0, 0.0);
        Self {
            firmware,
            decoder: Decoder::default(),
            up: Channel::new(1),
            down: Channel::new(2),
            quality,
            reader: Reader::default(),
            session: LinkSession::new(&hello, LoopTiming::default(), now_ns, Arc::clone(&counters)),
            counters,
            velocity: Estimator::new(Method::default(), 1e-3, 1e-5),
            renderer,
            last: None,
            now_ns,
            sent: Vec::new(),
            taken: Vec::new(),
        }
    }

    /// A millisecond: the firmware samples at its beginning, the host ticks in its middle. Returns
    /// the force at the motor at its end, N.
    fn millisecond(&mut self) -> f64 {
        for step in 0..MS / STEP_NS {
            if step == 0
                && let Some(sample) = self.firmware.sample(self.now_ns)
            {
                self.sent.push(sample);
                let frame = Frame::of(sample.bytes().as_slice());
                self.up.send(frame.as_slice().to_vec(), &self.quality, self.now_ns);
            }
            if step == MS / STEP_NS / 2 {
                self.tick();
            }
            while let Some(frame) = self.down.receive(self.now_ns) {
                self.receive(&frame);
            }
            self.now_ns += STEP_NS;
        }
        self.firmware.force_n()
    }

    /// What a firmware does with a frame.
    fn receive(&mut self, frame: &[u8]) {
        for byte in frame {
            let Some(Ok(message)) = self.decoder.push(*byte) else {
                continue;
            };
            if let Ok(view) = View::whole(message)
                && let Ok(message) = FromHost::read(view)
            {
                // Acknowledgements go unsent: the samples say the same.
                self.firmware.receive(message, self.now_ns);
            }
        }
    }

    fn tick(&mut self) {
        let now_ns = self.now_ns;
        while let Some(frame) = self.up.receive(now_ns) {
            let (session, taken) = (&mut self.session, &mut self.taken);
            self.reader.take(&frame, |came| {
                taken.extend(came.as_ref().ok());
                session.take(came, now_ns);
            });
        }
        let mut force_n = 0.0;
        if let Ok(Some(sample)) = self.session.measurement(now_ns) {
            let (last_ns, last_velocity) = self.last.unwrap_or((sample.time_ns, 0.0));
            let elapsed_s = (sample.time_ns - last_ns) as f64 * 1e-9;
            let velocity = if elapsed_s > 0.0 || self.last.is_none() {
                self.velocity.update(elapsed_s, sample.position_m[0])
            } else {
                last_velocity
            };
            self.last = Some((sample.time_ns, velocity));
            let rendered = self.renderer.tick(elapsed_s, sample.position_m[0], velocity);
            force_n = -rendered.coupling_force;
        }
        for message in self.session.command([force_n, 0.0], true, now_ns).messages() {
            let frame = Frame::of(message.bytes().as_slice());
            self.down.send(frame.as_slice().to_vec(), &self.quality, now_ns);
        }
    }
}

/// Root mean square and largest difference to the force over a perfect line, N.
fn force_error(quality: Quality) -> (f64, f64) {
    const MILLISECONDS: u32 = 5000;
    let (mut perfect, mut bad) = (Rendering::new(Quality::default()), Rendering::new(quality));
    let (mut sum, mut largest) = (0.0, 0.0_f64);
    for _ in 0..MILLISECONDS {
        let difference = perfect.millisecond() - bad.millisecond();
        sum += difference * difference;
        largest = largest.max(difference.abs());
    }
    ((sum / f64::from(MILLISECONDS)).sqrt(), largest)
}

#[test]
fn force_error_over_jitter_and_loss_is_what_the_document_says() {
    let mut table = String::from("| jitter | no loss | 1 % | 5 % | 20 % |\n|---|---|---|---|---|\n");
    for jitter_ms in [0.0, 0.5, 1.0, 2.0, 5.0] {
        write!(table, "| {jitter_ms} ms |").expect("a string takes it");
        for loss in [0.0, 0.01, 0.05, 0.2] {
            let (rms, largest) = force_error(Quality {
                jitter_ms,
                loss,
                ..Quality::default()
            });
            write!(table, " {rms:.2} / {largest:.1} |").expect("a string takes it");
        }
        table.push('\n');
    }
    let document = include_str!("../../../../docs/device-protocol.md");
    let (_, rest) = document.split_once("<!-- quality -->\n").expect("its place");
    let (there, _) = rest.split_once("<!-- end of quality -->").expect("its end");
    assert!(there.trim() == table.trim(), "the document is to say:\n{table}");
}

#[test]
fn of_damaged_frames_none_is_taken_for_what_it_is_not() {
    for corrupt in [0.01, 0.05, 0.2] {
        let mut rendering = Rendering::new(Quality {
            corrupt,
            ..Quality::default()
        });
        for _ in 0..100_000 {
            rendering.millisecond();
        }
        let (sent, taken) = (&rendering.sent, &rendering.taken);
        // What was taken is among what was sent, in its order, bit by bit.
        let mut from = sent.iter();
        let wrong = taken.iter().filter(|sample| !from.any(|sent| sent == *sample)).count();
        let counters = &rendering.counters;
        println!(
            "{:.0} % of the frames damaged: {} sent, {} taken, {} refused for CRC or stuffing, {} malformed, {wrong} wrong values taken",
            corrupt * 100.0,
            sent.len(),
            taken.len(),
            counters.bad_crc.load(Relaxed),
            counters.malformed.load(Relaxed)
        );
        assert_eq!(wrong, 0);
        assert!(
            taken.len() as f64 > sent.len() as f64 * (1.0 - 2.2 * corrupt),
            "{corrupt}"
        );
        assert_eq!(counters.samples.load(Relaxed), taken.len() as u64);
        assert!(counters.bad_crc.load(Relaxed) as f64 > 0.9 * corrupt * sent.len() as f64);
    }
}

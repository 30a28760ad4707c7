//! What a whole tick costs, in instructions: the processor's trap flag counts them, deaf to whatever else the machine
//! does.
#![allow(unsafe_code, reason = "single-stepping and its signal")]

use crate::rt::clock::Wake;
use crate::rt::handoff::hand_over;
use crate::rt::lateness::{LatePolicy, Lateness};
use crate::rt::outbox;
use crate::rt::tick::Tick;
use crate::rt::tick::tests::servo;
use crate::self_test::NoLink;
use device_io::Device;
use haptic_core::servo::{Command, CompiledScene};
use haptic_core::{Renderer, Scene, Scheme};
use std::arch::asm;
use std::hint::black_box;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::Relaxed;

/// Instructions of a whole tick on the paper's scene: its median, and its most, which has a change of
/// contact in it. Without those of the test's own device and of the counting. The first of the two is for the
/// profile of the tests, which does not optimise the daemon, with a tenth on top; .ci/full tests the second with
/// `--release`. What the median took when this was written is in docs/measured.md.
const TICK_BUDGET: (u64, u64) = if cfg!(debug_assertions) {
    (5100, 5870)
} else {
    (1500, 3500)
};

/// Ticks of two strokes, 1 ms each.
const TICKS: u32 = 4000;

const PERIOD_NS: u64 = 1_000_000;

/// Traps since the count began. Only the thread whose trap flag is set has any.
static COUNT: AtomicU64 = AtomicU64::new(0);

extern "C" fn on_trap(_: libc::c_int) {
    COUNT.fetch_add(1, Relaxed);
}

/// Instructions that something takes.
fn instructions_of(work: impl FnOnce()) -> u64 {
    COUNT.store(0, Relaxed);
    // SAFETY: sets one flag of the processor, for which `on_trap` is installed; what it pushes it pops.
    unsafe { asm!("pushfq", "or qword ptr [rsp], 0x100", "popfq") }
    work();
    // SAFETY: as above.
    unsafe { asm!("pushfq", "and qword ptr [rsp], ~0x100", "popfq") }
    COUNT.load(Relaxed)
}

fn median(mut counts: Vec<u64>) -> u64 {
    counts.sort_unstable();
    counts[counts.len() / 2]
}

#[test]
fn whole_tick_on_the_papers_scene_keeps_its_budget() {
    // SAFETY: a zeroed action is a valid one, and the handler has the signature of one without SA_SIGINFO.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = on_trap as *const () as usize;
        let installed = libc::sigaction(libc::SIGTRAP, &raw const action, std::ptr::null_mut());
        assert_eq!(installed, 0);
    }
    let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
    let (mut control, loop_side) = hand_over(outbox::RECORDS);
    let mut tick: Tick<dyn Device> = Tick::new(
        Box::new(NoLink::new(PERIOD_NS)),
        loop_side,
        servo(1e-3, CompiledScene::at_once(renderer, 1)),
        Lateness::new(LatePolicy::Warn),
        u64::MAX,
    );
    assert!(control.inbox.command(1, Command::Engage, 0));

    // Some of the ticks: a trap costs microseconds.
    let counted = if cfg!(debug_assertions) {
        10
    } else {
        test_run::extent(10, 500)
    };
    let mut counts = Vec::new();
    for number in 1..=TICKS {
        let at_ns = 1_000_000_000 + u64::from(number) * PERIOD_NS;
        let wake = Wake {
            deadline_ns: at_ns,
            began_ns: at_ns,
            asleep_ns: 0,
        };
        if number % (TICKS / counted) == 0 {
            // The loop's own queue: a full one would be cheaper.
            while control.records.pop().is_some() {}
            counts.push(instructions_of(|| _ = tick.run(wake, 0)));
        } else {
            tick.run(wake, 0);
        }
    }

    let mut device = NoLink::new(PERIOD_NS);
    let own = instructions_of(|| {
        black_box(device.read(1_000_000_000)).expect("it has samples");
        black_box(device.bounds());
        black_box(device.write(1.0, true)).expect("it takes it");
    });
    let most = counts.iter().max().expect("some are counted") - own;
    let median = median(counts) - own;
    println!("{median} instructions a tick (median), {most} at most, without {own} of the test's own");
    assert!(median > 200, "nothing was rendered");
    assert!(median <= TICK_BUDGET.0 && most <= TICK_BUDGET.1, "{median}, {most}");
}

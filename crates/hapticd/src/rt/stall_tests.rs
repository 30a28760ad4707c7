//! The control side stalls at every instruction inside the hand-over, and the real-time side still
//! ends, in a bounded number of instructions.
//!
//! A real-time thread that preempts the control thread on its own processor runs while that one
//! stands between two instructions, for as long as it likes. Here the processor's trap flag stops
//! the control side after its first instruction, in the next round after its second, and so on; in
//! the trap, on the same thread, a whole tick of the real-time side runs, counted by the same flag.
//! Had it to wait for the control side (for a slot in flight, or for a lock such as the
//! allocator's), it would never end, and the count would show it. No privilege is needed.
#![allow(unsafe_code, reason = "single-stepping, signals and fork")]

use crate::rt::clock::Wake;
use crate::rt::handoff::{ControlSide, hand_over};
use crate::rt::lateness::{LatePolicy, Lateness};
use crate::rt::tick::Tick;
use crate::rt::tick::tests::servo;
use crossbeam::queue::ArrayQueue;
use device_io::Device;
use device_io::fake::{FakeRig, Hand, Motion, RigProperties};
use haptic_core::servo::{Command, CompiledScene};
use haptic_core::{Renderer, Scene, Scheme};
use std::arch::asm;
use std::hint::black_box;
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicPtr, AtomicU64};

/// Instructions after which the real-time side counts as stuck: some ten times what its tick takes.
const BOUND: u64 = 30_000;

/// Instructions of the control side at which it is stopped, at most: more than one whole hand-over, which is
/// longer in the tests' profile; what follows is the same over again.
const MAX_STEPS: u64 = if cfg!(debug_assertions) { 1300 } else { 400 };

/// Instructions from one at which it is stopped to the next: every one of an optimised build, as .ci/full does; else
/// few enough that a queue that stalls is seen to stall.
const STRIDE: usize = if cfg!(debug_assertions) { 41 } else { 1 };

/// The extent of a run of an optimised build; one that is not is always short.
pub(super) fn extent<T>(short: T, full: T) -> T {
    if cfg!(debug_assertions) {
        short
    } else {
        test_run::extent(short, full)
    }
}

const IDLE: u64 = 0;
const FREEZING: u64 = 1;
const REAL_TIME: u64 = 2;

/// What the trap handler goes by. Only the forked child uses them, and it has one thread.
static PHASE: AtomicU64 = AtomicU64::new(IDLE);
static STEP: AtomicU64 = AtomicU64::new(0);
static TARGET: AtomicU64 = AtomicU64::new(0);
static COUNT: AtomicU64 = AtomicU64::new(0);
static REAL_TIME_SIDE: AtomicPtr<&mut dyn FnMut()> = AtomicPtr::new(std::ptr::null_mut());
static REPORT: AtomicPtr<Report> = AtomicPtr::new(std::ptr::null_mut());

/// What the child reports, in memory that it shares.
#[derive(Debug)]
pub(super) struct Report {
    /// Instructions of the control side after which it was stopped.
    pub(super) steps: AtomicU64,
    /// Most instructions that the real-time side took.
    pub(super) worst: AtomicU64,
    /// The instruction of the control side at which the real-time side did not end, or 0.
    stuck_at: AtomicU64,
    /// Instructions of what else was counted.
    pub(super) parts: [AtomicU64; 11],
}

const TRAP_FLAG: i64 = 0x100;

fn set_trap_flag() {
    // SAFETY: sets one flag of the processor, for which `on_trap` is prepared; what it pushes it pops.
    unsafe { asm!("pushfq", "or qword ptr [rsp], 0x100", "popfq") }
}

fn clear_trap_flag() {
    // SAFETY: as above.
    unsafe { asm!("pushfq", "and qword ptr [rsp], ~0x100", "popfq") }
}

extern "C" fn on_trap(_: libc::c_int, _: *mut libc::siginfo_t, context: *mut libc::c_void) {
    match PHASE.load(SeqCst) {
        FREEZING => {
            if STEP.fetch_add(1, SeqCst) + 1 < TARGET.load(SeqCst) {
                return;
            }
            stop_stepping(context);
            COUNT.store(0, SeqCst);
            PHASE.store(REAL_TIME, SeqCst);
            set_trap_flag();
            // SAFETY: set by `at_every_step`, whose frame lies below this one.
            unsafe { (*REAL_TIME_SIDE.load(SeqCst))() };
            clear_trap_flag();
            PHASE.store(IDLE, SeqCst);
        }
        REAL_TIME => {
            if COUNT.fetch_add(1, SeqCst) > BOUND {
                // SAFETY: the report is mapped for the whole life of this process.
                unsafe { &*REPORT.load(SeqCst) }
                    .stuck_at
                    .store(TARGET.load(SeqCst), SeqCst);
                // SAFETY: ends the forked child, here and now.
                unsafe { libc::_exit(0) };
            }
        }
        _ => stop_stepping(context),
    }
}

fn stop_stepping(context: *mut libc::c_void) {
    // SAFETY: the kernel hands a signal handler its context, which is this handler's alone.
    let context = unsafe { &mut *context.cast::<libc::ucontext_t>() };
    context.uc_mcontext.gregs[libc::REG_EFL as usize] &= !TRAP_FLAG;
}

/// The two sides of a hand-over, as they are before it.
struct Round {
    control: Box<dyn FnMut()>,
    real_time: Box<dyn FnMut()>,
}

/// Stops the control side after its instructions in turn and lets the real-time side run there.
fn at_every_step(round: impl Fn() -> Round) -> &'static Report {
    in_a_child(|report| step_through(&round, STRIDE, report))
}

/// Runs what needs the trap flag in a process of its own, with one thread.
pub(super) fn in_a_child(run: impl FnOnce(&'static Report)) -> &'static Report {
    // SAFETY: fresh anonymous memory, shared with the child, never unmapped.
    let page = unsafe {
        libc::mmap(
            std::ptr::null_mut(),
            size_of::<Report>(),
            libc::PROT_READ | libc::PROT_WRITE,
            libc::MAP_SHARED | libc::MAP_ANONYMOUS,
            -1,
            0,
        )
    };
    assert_ne!(page, libc::MAP_FAILED);
    // SAFETY: it is zeroed, aligned and large enough, and zeros are a valid report.
    let report: &'static Report = unsafe { &*page.cast::<Report>() };
    // SAFETY: glibc leaves the allocator usable in the child, which takes no other lock of the parent's.
    let child = unsafe { libc::fork() };
    if child == 0 {
        REPORT.store(page.cast(), SeqCst);
        take_traps();
        let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| run(report)));
        // SAFETY: ends the child without the parent's exit handlers.
        unsafe { libc::_exit(if done.is_ok() { 0 } else { 1 }) };
    }
    assert!(child > 0, "{}", std::io::Error::last_os_error());
    let mut status = 0;
    // SAFETY: waits for the child made above.
    assert_eq!(unsafe { libc::waitpid(child, &raw mut status, 0) }, child);
    assert_eq!(status, 0, "the child failed: {report:?}");
    println!("{report:?}");
    report
}

fn take_traps() {
    // SAFETY: a zeroed action is a valid one, and the handler has the signature that SA_SIGINFO asks for.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = on_trap as *const () as usize;
        // The real-time side is stepped from within the handler.
        action.sa_flags = libc::SA_SIGINFO | libc::SA_NODEFER;
        assert_eq!(
            libc::sigaction(libc::SIGTRAP, &raw const action, std::ptr::null_mut()),
            0
        );
    }
}

/// Instructions that something takes.
pub(super) fn instructions_of(work: impl FnOnce()) -> u64 {
    COUNT.store(0, SeqCst);
    PHASE.store(REAL_TIME, SeqCst);
    set_trap_flag();
    work();
    clear_trap_flag();
    PHASE.store(IDLE, SeqCst);
    COUNT.load(SeqCst)
}

fn step_through(round: &impl Fn() -> Round, stride: usize, report: &Report) {
    for target in (1..=MAX_STEPS).step_by(stride) {
        let mut round = round();
        let mut real_time: &mut dyn FnMut() = &mut *round.real_time;
        // SAFETY: only the lifetime is dropped; the handler uses it while this frame stands.
        REAL_TIME_SIDE.store(
            unsafe { std::mem::transmute::<*mut &mut dyn FnMut(), *mut &mut dyn FnMut()>(&raw mut real_time) },
            SeqCst,
        );
        STEP.store(0, SeqCst);
        TARGET.store(target, SeqCst);
        PHASE.store(FREEZING, SeqCst);
        set_trap_flag();
        (round.control)();
        clear_trap_flag();
        let reached = PHASE.swap(IDLE, SeqCst) == IDLE;
        if !reached {
            return;
        }
        report.steps.store(target, SeqCst);
        report.worst.fetch_max(COUNT.load(SeqCst), SeqCst);
    }
}

pub(super) fn compiled(renderer: &Renderer, revision: u64) -> CompiledScene {
    CompiledScene::at_once(renderer.clone(), revision)
}

/// An engaged loop on the fake rig, between two ticks.
pub(super) struct Bench {
    tick: Tick<dyn Device>,
    pub(super) control: ControlSide,
    clock_ns: u64,
    revision: u64,
}

impl Bench {
    fn new(renderer: &Renderer) -> Self {
        let motion = Motion::Sine {
            amplitude_m: 0.03,
            frequency_hz: 2.0,
        };
        let rig = FakeRig::new(RigProperties::default(), Hand::Prescribed(motion));
        Self::on(Box::new(rig), renderer, 8)
    }

    /// One on a device, with room for so many records.
    pub(super) fn on(device: Box<dyn Device>, renderer: &Renderer, records: usize) -> Self {
        let (control, loop_side) = hand_over(records);
        let tick = Tick::new(
            device,
            loop_side,
            servo(0.001, compiled(renderer, 1)),
            Lateness::new(LatePolicy::Warn),
            u64::MAX,
        );
        let mut bench = Self {
            tick,
            control,
            clock_ns: 1_000_000_000,
            revision: 1,
        };
        assert!(bench.control.inbox.command(1, Command::Engage, 0));
        bench.ticks(4);
        bench
    }

    pub(super) fn ticks(&mut self, count: u32) {
        for _ in 0..count {
            one_tick(&mut self.tick, &mut self.clock_ns);
        }
    }

    fn post(&mut self, renderer: &Renderer) {
        self.revision += 1;
        self.control.inbox.post(compiled(renderer, self.revision));
    }

    /// The round in which this loop ticks once while the control side stands still in `work`.
    fn against(self, mut work: impl FnMut(&mut ControlSide) + 'static) -> Round {
        let Self {
            mut tick,
            mut control,
            mut clock_ns,
            ..
        } = self;
        Round {
            control: Box::new(move || work(&mut control)),
            real_time: Box::new(move || one_tick(&mut tick, &mut clock_ns)),
        }
    }
}

fn one_tick(tick: &mut Tick<dyn Device>, clock_ns: &mut u64) {
    *clock_ns += 1_000_000;
    let wake = Wake {
        deadline_ns: *clock_ns,
        began_ns: *clock_ns,
        asleep_ns: 0,
    };
    tick.run(wake, 0);
}

pub(super) fn renderer() -> Renderer {
    Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene")
}

#[track_caller]
fn assert_never_stuck(report: &Report, least_steps: u64) {
    assert_eq!(
        report.stuck_at.load(SeqCst),
        0,
        "the real-time side waits for the control side, which stands at this instruction"
    );
    let steps = report.steps.load(SeqCst);
    assert!(
        steps >= least_steps,
        "the control side was stopped at {steps} places only"
    );
    assert!(report.worst.load(SeqCst) > 100, "the real-time side did nothing");
}

#[test]
fn a_tick_ends_wherever_the_posting_of_a_scene_is_preempted() {
    let renderer = renderer();
    // The ring has room for the scene; or it has none, and the scene that waits for it is freed.
    for &scenes in extent(&[20][..], &[0, 20]) {
        let report = at_every_step(|| {
            let mut bench = Bench::new(&renderer);
            (0..scenes).for_each(|_| bench.post(&renderer));
            let mut new = Some(compiled(&renderer, 100));
            bench.against(move |control| {
                if let Some(new) = new.take() {
                    control.inbox.post(new);
                }
            })
        });
        assert_never_stuck(report, 50);
    }
}

#[test]
fn a_tick_ends_wherever_the_reading_of_its_outbox_is_preempted() {
    let renderer = renderer();
    // Records and replaced scenes beforehand, with room for 8 records: none, some, more than it takes.
    for &ticks in extent(&[20][..], &[0, 2, 20]) {
        let report = at_every_step(|| {
            let mut bench = Bench::new(&renderer);
            while bench.control.records.pop().is_some() {}
            for _ in 0..ticks {
                bench.post(&renderer);
                bench.ticks(1);
            }
            bench.post(&renderer);
            bench.against(|control| {
                black_box([control.records.pop(), control.records.pop()]);
            })
        });
        assert_never_stuck(report, 10);
    }
}

#[test]
fn a_tick_ends_wherever_a_command_or_a_stop_is_preempted() {
    let renderer = renderer();
    let report = at_every_step(|| {
        Bench::new(&renderer).against(|ControlSide { shared, inbox, records }| {
            inbox.command(2, Command::Release, shared.stops());
            shared.stop();
            inbox.command(3, Command::Reset, shared.stops());
            shared.withdraw(3);
            black_box(records.answers().command(3));
        })
    });
    assert_never_stuck(report, 10);
}

#[test]
fn queue_towards_the_real_time_side_is_seen_to_stall_it() {
    let round = || {
        let queue = Arc::new(ArrayQueue::new(1));
        let (control, real_time) = (Arc::clone(&queue), queue);
        Round {
            control: Box::new(move || {
                black_box(control.force_push(7_u64));
            }),
            real_time: Box::new(move || {
                black_box(real_time.pop());
            }),
        }
    };
    let report = in_a_child(|report| step_through(&round, 1, report));
    assert_ne!(report.stuck_at.load(SeqCst), 0, "{report:?}");
}

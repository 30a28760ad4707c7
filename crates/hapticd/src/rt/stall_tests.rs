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
use crate::rt::handoff::Shared;
use crate::rt::lateness::{LatePolicy, Lateness};
use crate::rt::outbox;
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

/// Instructions from one at which it is stopped to the next: every one of an optimised build, as .ci/full does; else few
/// enough that a queue that stalls is seen to stall.
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
    shared: Arc<Shared>,
    pub(super) records: outbox::Consumer,
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
        Self::on(Box::new(rig), renderer)
    }

    fn on(device: Box<dyn Device>, renderer: &Renderer) -> Self {
        Self::with_outbox(device, renderer, outbox::with_capacity(8))
    }

    pub(super) fn with_outbox(
        device: Box<dyn Device>,
        renderer: &Renderer,
        (producer, records): (outbox::Producer, outbox::Consumer),
    ) -> Self {
        let shared = Arc::new(Shared::new());
        let tick = Tick::new(
            device,
            Arc::clone(&shared),
            producer,
            servo(0.001, compiled(renderer, 1)),
            Lateness::new(LatePolicy::Warn),
            u64::MAX,
        );
        let mut bench = Self {
            tick,
            shared,
            records,
            clock_ns: 1_000_000_000,
            revision: 1,
        };
        bench.shared.send(1, Command::Engage, 0);
        bench.ticks(4);
        bench
    }

    pub(super) fn ticks(&mut self, count: u32) {
        for _ in 0..count {
            self.clock_ns += 1_000_000;
            let wake = Wake {
                deadline_ns: self.clock_ns,
                began_ns: self.clock_ns,
                asleep_ns: 0,
            };
            self.tick.run(wake, 0);
        }
    }

    fn post(&mut self, renderer: &Renderer) {
        self.revision += 1;
        self.shared.scenes.post(compiled(renderer, self.revision));
    }

    /// The round in which this loop ticks once while `control` stands still.
    fn against(mut self, control: impl FnMut() + 'static) -> Round {
        Round {
            control: Box::new(control),
            real_time: Box::new(move || self.ticks(1)),
        }
    }
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
    let report = at_every_step(|| {
        let mut bench = Bench::new(&renderer);
        // One waits already: the post takes it out, and frees it.
        bench.post(&renderer);
        let (shared, mut new) = (Arc::clone(&bench.shared), Some(compiled(&renderer, 3)));
        bench.against(move || {
            if let Some(new) = new.take() {
                shared.scenes.post(new);
            }
        })
    });
    assert_never_stuck(report, 50);
}

#[test]
fn a_tick_ends_wherever_the_dropping_of_old_scenes_is_preempted() {
    let renderer = renderer();
    // The tick that preempts the dropping hands back one more; after 16 scenes there is no room for it.
    for &scenes in extent(&[16][..], &[2, 16]) {
        let report = at_every_step(|| {
            let mut bench = Bench::new(&renderer);
            for _ in 0..scenes {
                bench.post(&renderer);
                bench.ticks(1);
            }
            bench.post(&renderer);
            let mut records = std::mem::replace(&mut bench.records, outbox::outbox().1);
            bench.against(move || records.drop_retired())
        });
        assert_never_stuck(report, 50);
    }
}

#[test]
fn a_tick_ends_wherever_the_reading_of_its_records_is_preempted() {
    let renderer = renderer();
    // Records in the ring of 8 beforehand: none, some, as many as it takes.
    for &ticks in extent(&[20][..], &[0, 2, 20]) {
        let report = at_every_step(|| {
            let mut bench = Bench::new(&renderer);
            while bench.records.pop().is_some() {}
            bench.ticks(ticks);
            let mut records = std::mem::replace(&mut bench.records, outbox::outbox().1);
            bench.against(move || {
                black_box([records.pop(), records.pop()]);
            })
        });
        assert_never_stuck(report, 10);
    }
}

#[test]
fn a_tick_ends_wherever_a_command_or_a_stop_is_preempted() {
    let renderer = renderer();
    let report = at_every_step(|| {
        let bench = Bench::new(&renderer);
        let shared = Arc::clone(&bench.shared);
        bench.against(move || {
            shared.send(2, Command::Release, shared.stops());
            shared.stop();
            shared.send(3, Command::Reset, shared.stops());
            shared.withdraw(3);
            black_box(shared.answers.command(3));
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

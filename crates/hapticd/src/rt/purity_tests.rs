//! The real loop, on its own thread as the daemon starts it, does nothing that it must not: it
//! allocates and frees nothing, and makes no system call but its sleep and, on a link, the device's
//! read, write and poll. Meanwhile scenes change, people stop, reset, engage and release, and the
//! device fails in every way it can, or is unplugged and plugged in again.
//!
//! All of it is counted, not timed, so that a busy machine cannot disturb it.
#![allow(unsafe_code, reason = "a counting allocator, a seccomp filter and a signal handler")]

use crate::rt::clock::now_ns;
use crate::rt::handoff::{ControlSide, hand_over};
use crate::rt::inbox::ToLoop;
use crate::rt::lateness::{LatePolicy, Lateness};
use crate::rt::outbox::{RECORDS, TickRecord};
use crate::rt::space::Space;
use crate::rt::thread::{self, RunningLoop};
use crate::rt::thread::{Policy, ThreadSettings};
use crate::rt::tick::Tick;
use crate::rt::tick::tests::servo;
use device_io::fake::{
    FakeRig, Figure, Firmware, FirmwareProperties, Hand, HandMotion, Path as PlanarPath, PlanarFake, PlanarProperties,
};
use device_io::fake::{PlanarRig, Port, RigProperties};
use device_io::link::{Keeper, LoopTiming, SerialConnector};
use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::{FromDevice, FromHost};
use device_io::protocol::view::View;
use device_io::{Device, DeviceBounds, DeviceError, Measurement, Written};
use haptic_core::friction::LAWS;
use haptic_core::planar::Plane;
use haptic_core::scene::SceneFile;
use haptic_core::servo::{Command, CompiledScene};
use haptic_core::{Scene, Scheme};
use haptic_ipc::{BUILT_IN_SCENES, RealTimeStatus, RigState};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering::SeqCst;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

thread_local! {
    /// Whether this thread's calls are counted.
    static WATCHED: Cell<bool> = const { Cell::new(false) };
}

static ALLOCATED: AtomicU64 = AtomicU64::new(0);
static FREED: AtomicU64 = AtomicU64::new(0);
static TRAPPED: AtomicU64 = AtomicU64::new(0);
/// The number of the last system call that was trapped.
static TRAPPED_CALL: AtomicU64 = AtomicU64::new(u64::MAX);

/// The system's allocator, which counts for the thread that is watched.
struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn count(counter: &AtomicU64) {
    if WATCHED.get() {
        counter.fetch_add(1, SeqCst);
    }
}

// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(&ALLOCATED);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count(&FREED);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count(&ALLOCATED);
        // SAFETY: as the caller promises.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

extern "C" fn on_forbidden_call(_: libc::c_int, info: *mut libc::siginfo_t, _: *mut libc::c_void) {
    if WATCHED.get() {
        TRAPPED.fetch_add(1, SeqCst);
        // SAFETY: in the information of a SIGSYS the call's number follows the address of the call,
        // which follows three words and their padding.
        let call = unsafe { info.byte_add(24).cast::<i32>().read() };
        TRAPPED_CALL.store(u64::from(call.unsigned_abs()), SeqCst);
    }
}

/// What the loop may call, and what its thread needs to end: returning from the handler and giving
/// back its stack.
const ALLOWED: [libc::c_long; 9] = [
    libc::SYS_clock_nanosleep,
    libc::SYS_clock_gettime,
    libc::SYS_rt_sigreturn,
    libc::SYS_exit,
    libc::SYS_rt_sigprocmask,
    libc::SYS_sigaltstack,
    libc::SYS_munmap,
    libc::SYS_madvise,
    libc::SYS_exit_group,
];

/// What a link may call besides.
const ALLOWED_ON_A_LINK: [libc::c_long; 4] = [libc::SYS_read, libc::SYS_write, libc::SYS_poll, libc::SYS_ppoll];

/// Lets the calling thread make no other call from now on: the others are not made but trapped.
fn forbid_system_calls(on_a_link: bool) -> Result<(), std::io::Error> {
    let mut allowed = ALLOWED.to_vec();
    if on_a_link {
        allowed.extend(ALLOWED_ON_A_LINK);
    }

    // SAFETY: a zeroed action is a valid one, and the handler has the signature of one with SA_SIGINFO.
    unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        action.sa_sigaction = on_forbidden_call as *const () as usize;
        action.sa_flags = libc::SA_SIGINFO;
        if libc::sigaction(libc::SIGSYS, &raw const action, std::ptr::null_mut()) != 0 {
            return Err(std::io::Error::last_os_error());
        }
    }
    filter_calls(&allowed, libc::SECCOMP_RET_ALLOW, libc::SECCOMP_RET_TRAP)
}

/// Answers some system calls of this thread in one way and all others in another, for ever.
pub(super) fn filter_calls(calls: &[libc::c_long], these: u32, others: u32) -> std::io::Result<()> {
    // The statements of linux/filter.h: the call's number is the first word of what a filter sees.
    let statement = |code: u32, k: u32, jt: u8| libc::sock_filter {
        code: u16::try_from(code).unwrap_or(0),
        jt,
        jf: 0,
        k,
    };
    let number = |call: libc::c_long| u32::try_from(call).unwrap_or(u32::MAX);
    let mut filter = vec![statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0, 0)];
    for (index, call) in calls.iter().copied().enumerate() {
        // To the last statement, over those in between.
        let over = u8::try_from(calls.len() - index).unwrap_or(0);
        filter.push(statement(
            libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K,
            number(call),
            over,
        ));
    }
    filter.push(statement(libc::BPF_RET | libc::BPF_K, others, 0));
    filter.push(statement(libc::BPF_RET | libc::BPF_K, these, 0));
    let program = libc::sock_fprog {
        len: u16::try_from(filter.len()).unwrap_or(0),
        filter: filter.as_mut_ptr(),
    };
    // SAFETY: plain system calls on this thread, with a valid program, which the kernel copies.
    let done = unsafe {
        libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0
            && libc::syscall(libc::SYS_seccomp, libc::SECCOMP_SET_MODE_FILTER, 0, &raw const program) == 0
    };
    if done {
        Ok(())
    } else {
        Err(std::io::Error::last_os_error())
    }
}

/// More snapshots than this are taken.
const MIN_SNAPSHOTS: u64 = 100;

/// Tick at which the watch begins: by then the stack and the device are warm.
const WATCH_FROM: u64 = 100;

/// A rig that fails now and then, and sets the watch over the thread that reads it.
struct Failing<V> {
    rig: Box<dyn Device<V>>,
    on_a_link: bool,
    reads: u64,
    seconds_ticks: u64,
    over: Arc<AtomicBool>,
    unwatched: Arc<AtomicBool>,
    filtered: Arc<AtomicU64>,
}

impl<V: Space> Device<V> for Failing<V> {
    fn description(&self) -> String {
        self.rig.description()
    }

    fn bounds(&self) -> DeviceBounds {
        DeviceBounds {
            resolution_m: self.rig.bounds().resolution_m,
            ..DeviceBounds::default()
        }
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement<V>, DeviceError> {
        self.reads += 1;
        if self.reads == WATCH_FROM {
            self.filtered.store(
                if forbid_system_calls(self.on_a_link).is_ok() {
                    1
                } else {
                    2
                },
                SeqCst,
            );
            WATCHED.set(true);
        }
        if self.over.load(SeqCst) {
            WATCHED.set(false);
            self.unwatched.store(true, SeqCst);
        }
        let mut sample = self.rig.read(now_ns)?;
        match self.reads % self.seconds_ticks {
            // Unreadable for a while, then no number, then the same sample for longer than is borne.
            300..310 => return Err(DeviceError::Disconnected),
            500 => sample.position_m.parts().for_each(|part| *part = f64::NAN),
            700..780 => sample.sequence = 0,
            _ => {}
        }
        Ok(sample)
    }

    fn write(&mut self, force_n: V, enabled: bool) -> Result<Written, DeviceError> {
        if (900..905).contains(&(self.reads % self.seconds_ticks)) {
            return Err(DeviceError::Disconnected);
        }
        self.rig.write(force_n, enabled)
    }
}

const PERIOD_NS: u64 = 1_000_000;

fn compiled<V: Space>(scene: &Scene, revision: u64) -> CompiledScene<V> {
    ramped(scene, scene, 0.0, revision)
}

/// A scene that takes effect over a time, after another.
fn ramped<V: Space>(from: &Scene, to: &Scene, ramp_s: f64, revision: u64) -> CompiledScene<V> {
    CompiledScene::ramped(from, to, revision, Scheme::Exact, 1e-3, ramp_s).expect("a valid scene")
}

/// The library's scenes and every law, as far as a space has them.
fn scenes<V: Space>() -> Vec<Scene> {
    let built_in = BUILT_IN_SCENES
        .iter()
        .map(|(_, text)| toml::from_str::<SceneFile>(text).expect("a scene").on(None));
    let laws = LAWS.map(|law| Scene::paper().with_law(law).expect("a law").expect("a scene"));
    let mut scenes: Vec<Scene> = built_in.chain(laws).collect();
    // On a line there are all.
    scenes
        .retain(|scene| V::AXES == 1 || CompiledScene::<V>::ramped(scene, scene, 1, Scheme::Exact, 1e-3, 0.0).is_ok());
    scenes
}

/// Starts the loop as the daemon does, at an ordinary rate.
pub(super) fn start<V: Space>(device: Box<dyn Device<V>>, scene: &Scene) -> (RunningLoop, ControlSide) {
    let (control, loop_side) = hand_over(RECORDS);
    let tick = Tick::new(
        device,
        loop_side,
        servo(0.02, compiled(scene, 1)),
        Lateness::new(LatePolicy::Warn),
        u64::MAX,
    );
    let settings = ThreadSettings {
        period_ns: PERIOD_NS,
        phase_ns: PERIOD_NS / 2,
        cpu: None,
        policy: Policy::Fifo { priority: 1 },
        spin_ns: None,
    };
    let status = RealTimeStatus::default();
    let shared = Arc::clone(&control.shared);
    let (running, _) = thread::start(tick, shared, settings, status).expect("a thread");
    (running, control)
}

#[test]
fn the_loop_allocates_nothing_frees_nothing_and_only_sleeps() {
    // One after the other: they share what counts. At full length each takes the snapshot of every ten seconds, too.
    let seconds = test_run::extent(2, 12);
    watch::<f64>(Box::new(FakeRig::new(RigProperties::default(), hand())), false, seconds);
    watch::<Plane>(Box::new(gantry()), false, seconds);
    let rig = UnpluggedNowAndThen::start();
    let connector = SerialConnector {
        path: rig.link.clone(),
        baud: 1_000_000,
    };
    let (device, monitor, keeper) = Keeper::new(Box::new(connector), LoopTiming::default());
    let _keeper = keeper.start().expect("a thread");
    watch::<f64>(Box::new(device), true, seconds);
    let connections = monitor.counters().connections.load(SeqCst);
    println!("{connections} connections");
    assert!(connections > 1, "it was never unplugged");
}

/// A rig of two axes whose hand draws a circle.
fn gantry() -> PlanarFake {
    let kinematics = "xy".parse().expect("kinematics");
    let path = PlanarPath::Figure {
        figure: Figure::Circle,
        middle: Plane::ZERO,
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    };
    let rig = PlanarRig::new(PlanarProperties::of(&kinematics), kinematics, Some(path));
    PlanarFake::new(rig.expect("in reach"))
}

pub(super) fn hand() -> Hand {
    Hand::Prescribed(HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    })
}

/// The fake rig behind a pseudo-terminal, on a thread of its own.
struct UnpluggedNowAndThen {
    link: PathBuf,
    over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    _directory: tempfile::TempDir,
}

impl UnpluggedNowAndThen {
    fn start() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let link = directory.path().join("rig");
        let over = Arc::new(AtomicBool::new(false));
        let (to, is_over) = (link.clone(), Arc::clone(&over));
        Self {
            link,
            over,
            thread: Some(std::thread::spawn(move || Self::run(&to, &is_over))),
            _directory: directory,
        }
    }

    fn run(link: &Path, over: &AtomicBool) {
        let began = Instant::now();
        let mut firmware = Firmware::new(RigProperties::default(), hand(), FirmwareProperties::default());
        let (mut terminal, mut decoder) = (None, Decoder::default());
        while !over.load(SeqCst) {
            // Unplugged for a tenth of each second: more than once in the shortest run.
            if began.elapsed().as_millis() % 1000 < 900 {
                terminal.get_or_insert_with(|| Port::plug_in(link).expect("a terminal"));
            } else {
                terminal = None;
            }
            let now_ns = now_ns();
            let mut messages: Vec<FromDevice> = firmware.sample(now_ns).into_iter().collect();
            if let Some(terminal) = &mut terminal {
                let read = terminal.read(|bytes| {
                    for byte in bytes {
                        if let Some(Ok(message)) = decoder.push(*byte)
                            && let Ok(view) = View::whole(message)
                            && let Ok(message) = FromHost::read(view)
                        {
                            messages.extend(firmware.receive(message, now_ns));
                        }
                    }
                });
                read.expect("the terminal is there");
                for message in messages {
                    let frame = Frame::of(message.bytes().as_slice());
                    terminal.write(frame.as_slice()).expect("the terminal is there");
                }
            }
            // A sample a millisecond, more or less.
            Port::wait(None, Duration::from_millis(1));
        }
    }
}

impl Drop for UnpluggedNowAndThen {
    fn drop(&mut self) {
        self.over.store(true, SeqCst);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

/// The ticks that were recorded, by their states.
#[derive(Debug, Default)]
struct TickCounts {
    recorded: u64,
    live: u64,
    stopped: u64,
    faulted: u64,
    lost: u64,
}

impl TickCounts {
    fn count(&mut self, record: &TickRecord) {
        self.recorded += 1;
        self.live += u64::from(record.state.is_live());
        self.stopped += u64::from(record.state == RigState::Stopped);
        self.faulted += u64::from(record.state == RigState::Faulted);
        self.lost += u64::from(record.state == RigState::Disconnected);
        let ticks = self.recorded + record.dropped;
        assert_eq!(ticks, record.tick + 1, "every tick is recorded or dropped");
    }

    /// Whether there was one of every kind.
    fn has_all(&self) -> bool {
        [self.live, self.stopped, self.faulted, self.lost]
            .iter()
            .all(|&ticks| ticks > 0)
    }
}

fn watch<V: Space>(rig: Box<dyn Device<V>>, on_a_link: bool, seconds: u64) {
    let filtered = Arc::new(AtomicU64::new(0));
    let (over, unwatched) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let device: Box<dyn Device<V>> = Box::new(Failing {
        rig,
        on_a_link,
        reads: 0,
        seconds_ticks: 1000,
        over: Arc::clone(&over),
        unwatched: Arc::clone(&unwatched),
        filtered: Arc::clone(&filtered),
    });
    let scenes = scenes::<V>();
    let mass = "mass".parse().expect("a parameter");
    let heavy = Scene::paper().with(&[(mass, 5.0)]).expect("a valid scene");
    let drag = scenes
        .iter()
        .find(|scene| scene.friction.law() == "viscous")
        .expect("a drag")
        .clone();
    let (mut running, control) = start(device, &scenes[0]);
    let ControlSide {
        shared,
        mut inbox,
        mut records,
    } = control;

    let began = Instant::now();
    // The control side, as busy as it gets: the next scene as soon as one is rendered, and the next
    // command as soon as one is answered.
    let (mut revision, mut serial, mut stops, mut newest) = (1, 0, 0, None);
    let (mut ticks, mut snapshots, mut asked) = (TickCounts::default(), 0, 0);
    let commands = [Command::Reset, Command::Engage, Command::Engage, Command::Release];
    // For so many ticks, and until one of every kind was seen and enough snapshots have come: which
    // command meets which failure, and how soon is asked again, is up to the machine.
    while !unwatched.load(SeqCst) {
        let long_enough = newest.is_some_and(|record: TickRecord| record.tick >= WATCH_FROM + seconds * 1000);
        over.store(long_enough && ticks.has_all() && snapshots > MIN_SNAPSHOTS, SeqCst);
        // Some take effect over twenty ticks, and are given ten or thirty.
        let long = [10, 30][usize::from(revision % 4 == 0)] * u64::from(revision % 10 < 2);
        if records
            .answers()
            .applied(revision)
            .is_some_and(|tick| newest.is_some_and(|record| record.tick >= tick + long))
        {
            revision += 1;
            let index = usize::try_from(revision).expect("few scenes") % scenes.len();
            inbox.post(match revision % 10 {
                0 => ramped::<V>(&Scene::paper(), &heavy, 0.02, revision),
                1 => ramped(&scenes[index], &drag, 0.02, revision),
                _ => compiled(&scenes[index], revision),
            });
            // A lease that has lapsed lets the force out; most of the time there is none.
            shared.lease_until(if revision % 50 < 3 { 0 } else { u64::MAX });
            // Now and then one that is replaced before it is taken.
            if revision % 7 == 0 {
                revision += 1;
                inbox.post(compiled::<V>(&scenes[0], revision));
            }
        }
        // By ticks, not by scenes, of which few take effect on a busy machine.
        if newest.is_some_and(|record| record.tick / 150 > stops) {
            stops += 1;
            shared.stop();
        }
        // A command every few ticks, so that force flows in between.
        let due = newest.is_some_and(|record| record.tick / 16 > serial);
        if due && (serial == 0 || records.answers().command(serial).is_some()) {
            serial += 1;
            let command = commands[usize::try_from(serial).expect("few commands") % commands.len()];
            assert!(inbox.command(serial, command, shared.stops()));
        }
        inbox.flush();
        // One at a time.
        if asked == snapshots {
            asked += u64::from(inbox.send(ToLoop::Snapshot(Box::new(None))));
        }
        snapshots += std::iter::from_fn(|| records.pop_snapshot()).count() as u64;
        while let Some(record) = records.pop() {
            ticks.count(&record);
            newest = Some(record);
        }
        let elapsed_s = began.elapsed().as_secs();
        assert!(
            elapsed_s < 2 * seconds + 60,
            "the loop ended by itself, is stuck, or had not one of every kind: {newest:?}, {ticks:?}"
        );
        std::thread::yield_now();
    }
    assert!(running.end().is_some_and(|end| end.panic.is_none()));

    println!("{revision} scenes, {serial} commands, {snapshots} snapshots; {ticks:?}");
    assert!(snapshots > MIN_SNAPSHOTS);
    assert_eq!(
        (ALLOCATED.load(SeqCst), FREED.load(SeqCst)),
        (0, 0),
        "allocated and freed"
    );
    if filtered.load(SeqCst) == 1 {
        assert_eq!(
            TRAPPED.load(SeqCst),
            0,
            "it made system call {}",
            TRAPPED_CALL.load(SeqCst)
        );
    } else {
        test_run::skip("seccomp", "a kernel with it");
    }
}

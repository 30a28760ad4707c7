//! The boards over a real pseudo-terminal, as the real-time thread uses them: the greeting, ticks
//! without an allocation, and the last words.
#![allow(unsafe_code, reason = "a counting allocator")]

use device_boards::Address;
use device_boards::fake::{ODriveBoard, ODriveProperties};
use device_io::fake::{Hand, Port, RigProperties};
use device_io::link::{LinkCounters, LoopTiming};
use device_io::now_ns;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest that anything may take on a busy machine before a test gives up.
const PATIENCE: Duration = Duration::from_secs(30);

/// Counts what the thread that asks allocates and frees.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    COUNT.set(COUNT.get() + 1);
}

// SAFETY: the system's allocator does it all.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        count();
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A fake board behind a terminal, and when it was switched on.
struct PluggedBoard {
    board: ODriveBoard,
    terminal: Port,
    began: Instant,
}

impl PluggedBoard {
    fn now_ns(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_nanos()).expect("soon")
    }

    /// Takes in what has come, and answers.
    fn live(&mut self) {
        let now_ns = self.now_ns();
        let (board, mut answers) = (&mut self.board, Vec::new());
        let read = self.terminal.read(|bytes| answers.extend(board.receive(bytes, now_ns)));
        read.expect("it reads");
        board.live_until(now_ns);
        for answer in answers {
            self.terminal.write(&answer).expect("it writes");
        }
        std::thread::yield_now();
    }
}

#[test]
fn tick_on_board_does_not_allocate() {
    let directory = tempfile::tempdir().expect("a directory");
    let link = directory.path().join("board");
    let properties = ODriveProperties::default();
    let mut plugged = PluggedBoard {
        board: ODriveBoard::new(RigProperties::default(), Hand::Free, properties),
        terminal: Port::plug_in(&link).expect("a terminal"),
        began: Instant::now(),
    };
    let address: Address = format!("odrive:{}?radius_mm=5&torque_limit_nm=0.1", link.display())
        .parse()
        .expect("an address");
    let mut connector = address.connector().expect("a link");
    let counters = Arc::new(LinkCounters::default());
    let greeted = std::thread::scope(|scope| {
        let greeting = scope.spawn(|| connector.connect(LoopTiming::default(), &counters));
        while !greeting.is_finished() {
            plugged.live();
        }
        greeting.join().expect("it ends")
    });
    let mut connection = greeted.expect("it answers").connection;
    let (began, mut sequence) = (Instant::now(), 0);
    // A tick, and what the board makes of it; whether it brought a new sample.
    let mut tick = |plugged: &mut PluggedBoard, enabled: bool| {
        assert!(began.elapsed() < PATIENCE, "{counters:?}");
        let before = COUNT.get();
        let now_ns = now_ns();
        let sample = connection.read(now_ns);
        // Where this thread waited for a processor longer than a watchdog waits for it, it lets
        // go and begins anew.
        let written = connection.write([2.0, 0.0], enabled && sample.is_ok(), now_ns);
        assert_eq!(COUNT.get(), before, "a tick allocates");
        plugged.live();
        let newest = sample.ok().flatten().map_or(sequence, |sample| sample.sequence);
        written.is_ok() && std::mem::replace(&mut sequence, newest) != newest
    };
    // Idle, arming, on, and idle again.
    for (enabled, samples) in [(false, 100), (true, 500), (false, 100)] {
        let mut seen = 0;
        while seen < samples {
            seen += u32::from(tick(&mut plugged, enabled));
        }
    }
    while !(plugged.board.is_on() && (plugged.board.force_n() - 2.0).abs() < 0.01) {
        tick(&mut plugged, true);
    }
    // A damaged command that has lost its checksum is believed, and cut by the board itself.
    let now_ns = plugged.now_ns();
    plugged.board.take_largest_force_n();
    plugged.board.receive(b"c 0 9\n", now_ns);
    assert!((plugged.board.take_largest_force_n() - 20.0).abs() < 0.01);
    drop(connection);
    let began = Instant::now();
    while plugged.board.is_on() || plugged.board.force_n() != 0.0 {
        assert!(began.elapsed() < PATIENCE, "waited in vain for the last word");
        plugged.live();
    }
}

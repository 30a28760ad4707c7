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
use std::path::Path;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
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

/// A fake board behind a terminal, on a thread of its own.
struct RunningBoard {
    board: Arc<Mutex<ODriveBoard>>,
    began: Instant,
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl RunningBoard {
    fn start(board: ODriveBoard, link: &Path) -> Self {
        let mut terminal = Port::plug_in(link).expect("a terminal");
        let board = Arc::new(Mutex::new(board));
        let quit = Arc::new(AtomicBool::new(false));
        let (its_board, its_quit) = (Arc::clone(&board), Arc::clone(&quit));
        let began = Instant::now();
        let thread = std::thread::spawn(move || {
            while !its_quit.load(Relaxed) {
                let now_ns = u64::try_from(began.elapsed().as_nanos()).expect("soon");
                let mut board = its_board.lock().expect("alive");
                let mut answers = Vec::new();
                terminal
                    .read(|bytes| answers.extend(board.receive(bytes, now_ns)))
                    .expect("it reads");
                board.live_until(now_ns);
                drop(board);
                for answer in answers {
                    terminal.write(&answer).expect("it writes");
                }
                Port::wait(Some(&terminal), Duration::from_millis(1));
            }
        });
        Self {
            board,
            began,
            quit,
            thread: Some(thread),
        }
    }

    fn wait_for(&self, what: &str, wanted: impl Fn(&ODriveBoard) -> bool) {
        let began = Instant::now();
        while !wanted(&self.board.lock().expect("alive")) {
            assert!(began.elapsed() < PATIENCE, "waited in vain for {what}");
            std::thread::yield_now();
        }
    }
}

impl Drop for RunningBoard {
    fn drop(&mut self) {
        self.quit.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

#[test]
fn tick_on_board_does_not_allocate() {
    let properties = ODriveProperties::default();
    let board = ODriveBoard::new(RigProperties::default(), Hand::Free, properties);
    let directory = tempfile::tempdir().expect("a directory");
    let link = directory.path().join("board");
    let played = RunningBoard::start(board, &link);
    let address: Address = format!("odrive:{}?radius_mm=5&torque_limit_nm=0.1", link.display())
        .parse()
        .expect("an address");
    let mut connector = address.connector().expect("a link");
    let counters = Arc::new(LinkCounters::default());
    let greeted = connector.connect(LoopTiming::default(), &counters);
    let mut connection = greeted.expect("it answers").connection;
    let (began, mut sequence) = (Instant::now(), 0);
    // A tick, as soon as there is an answer; whether it brought a new sample.
    let mut tick = |enabled: bool| {
        assert!(began.elapsed() < PATIENCE, "{counters:?}");
        let before = COUNT.get();
        let now_ns = now_ns();
        let sample = connection.read(now_ns);
        // Where this thread waited for a processor longer than a watchdog waits for it, it lets
        // go and begins anew.
        let written = connection.write([2.0, 0.0], enabled && sample.is_ok(), now_ns);
        assert_eq!(COUNT.get(), before, "a tick allocates");
        std::thread::yield_now();
        let newest = sample.ok().flatten().map_or(sequence, |sample| sample.sequence);
        written.is_ok() && std::mem::replace(&mut sequence, newest) != newest
    };
    // Idle, arming, on, and idle again.
    for (enabled, samples) in [(false, 100), (true, 500), (false, 100)] {
        let mut seen = 0;
        while seen < samples {
            seen += u32::from(tick(enabled));
        }
    }
    let pulls = |board: &ODriveBoard| board.is_on() && (board.force_n() - 2.0).abs() < 0.01;
    loop {
        tick(true);
        let mut board = played.board.lock().expect("alive");
        if !pulls(&board) {
            continue;
        }
        // A damaged command that has lost its checksum is believed, and cut by the board itself.
        let now_ns = u64::try_from(played.began.elapsed().as_nanos()).expect("soon");
        board.take_largest_force_n();
        board.receive(b"c 0 9\n", now_ns);
        assert!((board.take_largest_force_n() - 20.0).abs() < 0.01);
        break;
    }
    drop(connection);
    played.wait_for("the last word", |board| !board.is_on() && board.force_n() == 0.0);
}

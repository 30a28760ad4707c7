//! A relay in front of a daemon's socket, which holds back a request until a test releases it.

use std::io::{self, BufRead, BufReader, Write};
use std::net::Shutdown;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};

/// Connects each client to the daemon, as `ssh -L` does.
pub struct Relay {
    shared: Arc<Shared>,
}

#[derive(Default)]
struct Shared {
    requests: Mutex<Requests>,
    changed: Condvar,
}

#[derive(Default)]
struct Requests {
    /// Requests with this text are held back.
    kept_back: Option<String>,
    waiting: usize,
    passed: Vec<String>,
}

impl Relay {
    /// Starts one between two sockets.
    pub fn start(from: &Path, to: &Path) -> Self {
        let listener = UnixListener::bind(from).expect("a socket");
        let (to, shared) = (to.to_path_buf(), Arc::<Shared>::default());
        let relay = Self {
            shared: Arc::clone(&shared),
        };
        std::thread::spawn(move || {
            for here in listener.incoming() {
                let (here, there) = (here.expect("a client"), UnixStream::connect(&to).expect("it serves"));
                let (mut answers, mut client) = (
                    there.try_clone().expect("a handle"),
                    here.try_clone().expect("a handle"),
                );
                std::thread::spawn(move || {
                    drop(io::copy(&mut answers, &mut client));
                    drop(client.shutdown(Shutdown::Write));
                });
                let shared = Arc::clone(&shared);
                std::thread::spawn(move || pass_on(&here, &there, &shared));
            }
        });
        relay
    }

    /// Keeps requests back that have this in them, until [`release`](Self::release).
    pub fn keep_back(&self, part: &str) {
        self.shared.lock().kept_back = Some(part.to_owned());
    }

    /// Waits until a request is kept back.
    pub fn wait_for_one(&self) {
        let requests = self.shared.lock();
        drop(
            self.shared
                .changed
                .wait_while(requests, |requests| requests.waiting == 0)
                .expect("no test panicked"),
        );
    }

    /// Passes on what is kept back, and everything from here on.
    pub fn release(&self) {
        self.shared.lock().kept_back = None;
        self.shared.changed.notify_all();
    }

    /// The requests passed on so far.
    pub fn passed(&self) -> Vec<String> {
        self.shared.lock().passed.clone()
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Requests> {
        self.requests.lock().expect("no test panicked")
    }
}

fn pass_on(here: &UnixStream, mut there: &UnixStream, shared: &Shared) {
    for request in BufReader::new(here).lines() {
        let Ok(request) = request else { break };
        let mut requests = shared.lock();
        requests.waiting += 1;
        shared.changed.notify_all();
        let is_kept_back =
            |requests: &mut Requests| matches!(&requests.kept_back, Some(part) if request.contains(part));
        requests = shared
            .changed
            .wait_while(requests, is_kept_back)
            .expect("no test panicked");
        requests.waiting -= 1;
        requests.passed.push(request.clone());
        drop(requests);
        if writeln!(there, "{request}").is_err() {
            break;
        }
    }
    drop(there.shutdown(Shutdown::Write));
}

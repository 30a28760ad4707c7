//! The control socket, the optional watchers' socket, and a task for each client.

use crate::control::RigHandle;
use crate::control::peer::{UserNames, peer_of};
use crate::control::places::{Newcomer, Places};
use crate::control::session;
use crate::control::socket::{Access, InheritedSockets, Socket, SocketError};
use crate::log::{Level, say, say_at};
use haptic_ipc::{ErrorCode, Problem, Rights, WireError};
use nix::unistd::Group;
use rustix::net::SendFlags;
use serde_json::json;
use std::cell::{Cell, OnceCell, RefCell};
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;
use tokio::net::UnixStream;

/// Time between two looks whether clients can still find the sockets.
const LOOK: Duration = Duration::from_millis(50);

/// Time after a connection that could not be taken.
const TAKE_AGAIN: Duration = Duration::from_millis(5);

/// A socket and the clients on it.
#[derive(Debug)]
struct Listener {
    socket: Socket,
    rights: Rights,
    places: OnceCell<Rc<Places>>,
    /// Why clients cannot find it.
    lost: RefCell<Option<String>>,
}

impl Listener {
    fn bind(path: &Path, access: Access, rights: Rights, passed: &mut InheritedSockets) -> Result<Self, SocketError> {
        Ok(Self {
            socket: Socket::bind(path, access, passed)?,
            rights,
            places: OnceCell::new(),
            lost: RefCell::default(),
        })
    }

    /// Whether clients find it, after a try to bind it again where it was lost. Tells when that changes, and what
    /// follows.
    fn stays_reachable(&self, consequence: &str) -> bool {
        let path = self.socket.path().display();
        let found = self.socket.stay_reachable();
        let mut lost = self.lost.borrow_mut();
        match &found {
            Ok(bound_again) if *bound_again || lost.is_some() => {
                say(&format!("{path}: it was lost, and clients find it again"));
            }
            Err(why) if lost.as_ref() != Some(why) => {
                say_at(Level::Error, &format!("{path}: {why}; {consequence}"));
            }
            _ => {}
        }
        *lost = found.err();
        lost.is_none()
    }
}

/// The sockets that clients connect to.
#[derive(Debug)]
pub(crate) struct Server {
    control: Listener,
    watch: Option<Listener>,
    /// Sessions begun so far.
    sessions: Cell<u64>,
    names: Rc<UserNames>,
}

impl Server {
    /// Binds the control socket, which `group` may use too, and the watchers' socket if it has a
    /// path. Sockets that the service manager passed are taken instead.
    pub(crate) fn bind(control: &Path, group: Option<Group>, watch: Option<&Path>) -> Result<Self, SocketError> {
        let access = group.map_or(Access::Owner, Access::Group);
        let mut passed = InheritedSockets::of_process()?;
        let control = Listener::bind(control, access, Rights::All, &mut passed)?;
        let watch = watch
            .map(|path| Listener::bind(path, Access::Watchers, Rights::Watch, &mut passed))
            .transpose()?;
        passed.all_taken()?;
        Ok(Self {
            control,
            watch,
            sessions: Cell::new(0),
            names: Rc::default(),
        })
    }

    /// Path of the control socket.
    pub(crate) fn path(&self) -> &Path {
        self.control.socket.path()
    }

    /// Path of the watchers' socket.
    pub(crate) fn watch_path(&self) -> Option<&Path> {
        self.watch.as_ref().map(|listener| listener.socket.path())
    }

    /// What keeps the sockets' intended clients from reaching them.
    pub(crate) fn problems(&self) -> impl Iterator<Item = Problem> {
        [Some(&self.control), self.watch.as_ref()]
            .into_iter()
            .flatten()
            .filter_map(|listener| listener.socket.problem())
    }

    /// Serves clients for ever. Must run within a `LocalSet`.
    pub(crate) async fn serve(&self, rig: Rc<RigHandle>) {
        let watching = async {
            match &self.watch {
                Some(listener) => self.accept(listener, &rig).await,
                None => std::future::pending().await,
            }
        };
        tokio::join!(self.accept(&self.control, &rig), watching, self.stay_reachable(&rig));
    }

    async fn accept(&self, listener: &Listener, rig: &Rc<RigHandle>) {
        // All else that takes descriptors for ever has them by now.
        let sockets = 1 + usize::from(self.watch.is_some());
        let places = listener.places.get_or_init(|| Rc::new(Places::of_process(sockets)));
        loop {
            // Connected clients come first: a crowd that connects would otherwise delay a stop.
            tokio::task::yield_now().await;
            let Ok(stream) = listener.socket.accept().await else {
                // Most likely out of descriptors.
                places.send_one_away().await;
                tokio::time::sleep(TAKE_AGAIN).await;
                continue;
            };
            if !listener.socket.access.admits(&stream) {
                let error = WireError::new(ErrorCode::NotPermitted, listener.socket.access.who());
                refuse(&stream, &error);
                continue;
            }
            let newcomer = if places.has_room() {
                None
            } else {
                Some(places.admit().await)
            };
            let rights = if newcomer.is_some() {
                Rights::Stop
            } else {
                listener.rights
            };
            let number = self.sessions.get() + 1;
            self.sessions.set(number);
            let (names, place) = (
                Rc::clone(&self.names),
                ClientPlace::take(Rc::clone(places), newcomer, rig),
            );
            // Until it closes its connection; a newcomer for a moment.
            tokio::task::spawn_local(async move {
                let session = format!("{}-{number}", std::process::id());
                let ClientPlace { rig, newcomer, .. } = &place;
                if let Some(peer) = peer_of(&stream, session, &names).await {
                    session::run(Rc::clone(rig), stream, number, peer, rights, newcomer.clone()).await;
                }
            });
        }
    }

    /// Sees to it that clients find the sockets, and that the log tells of the link. Where nobody can ask for a stop
    /// any more, no force may flow.
    async fn stay_reachable(&self, rig: &RigHandle) {
        loop {
            rig.channel.set_reachable(
                self.control
                    .stays_reachable("its force is released, as nobody can stop the rig"),
            );
            if let Some(watch) = &self.watch {
                watch.stays_reachable("watchers stay away");
            }
            rig.log_link();
            tokio::time::sleep(LOOK).await;
        }
    }
}

/// A client's place, returned however its session ends.
struct ClientPlace {
    places: Rc<Places>,
    newcomer: Option<Rc<Newcomer>>,
    rig: Rc<RigHandle>,
}

impl ClientPlace {
    fn take(places: Rc<Places>, newcomer: Option<Rc<Newcomer>>, rig: &Rc<RigHandle>) -> Self {
        if newcomer.is_none() {
            places.clients.set(places.clients.get() + 1);
        }
        rig.clients.set(rig.clients.get() + 1);
        Self {
            places,
            newcomer,
            rig: Rc::clone(rig),
        }
    }
}

impl Drop for ClientPlace {
    fn drop(&mut self) {
        match &self.newcomer {
            Some(newcomer) => self.places.give_back(newcomer),
            None => self.places.clients.set(self.places.clients.get() - 1),
        }
        self.rig.clients.set(self.rig.clients.get() - 1);
    }
}

/// Tells a client why it is not served, without waiting.
fn refuse(stream: &UnixStream, error: &WireError) {
    let line = format!("{}\n", json!({ "id": null, "error": error }));
    // Nothing was sent before, so the socket has room.
    rustix::net::send(stream, line.as_bytes(), SendFlags::DONTWAIT | SendFlags::NOSIGNAL).unwrap_or_default();
}

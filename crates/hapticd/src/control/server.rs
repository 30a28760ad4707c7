//! The control socket, the optional watchers' socket, and a task for each client.

use crate::control::RigHandle;
use crate::control::peer::{UserNames, peer_of};
use crate::control::session::{self, MOST_CLIENTS};
use crate::control::socket::{Access, InheritedSockets, Socket, SocketError};
use haptic_ipc::{ErrorCode, Problem, Rights, WireError};
use nix::unistd::Group;
use rustix::net::SendFlags;
use serde_json::json;
use std::cell::Cell;
use std::path::Path;
use std::rc::Rc;
use std::time::Duration;
use tokio::net::UnixStream;

/// Clients beyond [`MOST_CLIENTS`] that may connect to a socket for a moment, only to stop the rig.
const STOPPING_CLIENTS: usize = 8;

/// How long such a client may stay connected.
const STOPPING_TIME: Duration = Duration::from_secs(2);

/// A socket and the clients on it.
#[derive(Debug)]
struct Listener {
    socket: Socket,
    rights: Rights,
    clients: Rc<Cell<usize>>,
}

impl Listener {
    fn bind(path: &Path, access: Access, rights: Rights, passed: &mut InheritedSockets) -> Result<Self, SocketError> {
        Ok(Self {
            socket: Socket::bind(path, access, passed)?,
            rights,
            clients: Rc::default(),
        })
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
        tokio::join!(self.accept(&self.control, &rig), watching);
    }

    async fn accept(&self, listener: &Listener, rig: &Rc<RigHandle>) {
        loop {
            // Connected clients come first: a crowd that connects would otherwise delay a stop.
            tokio::task::yield_now().await;
            let Ok((stream, _)) = listener.socket.listener.accept().await else {
                // Most likely out of descriptors: a client may close its connection before the next
                // try.
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            let connected = listener.clients.get();
            if !listener.socket.access.admits(&stream) {
                let error = WireError::new(ErrorCode::NotPermitted, listener.socket.access.who());
                refuse(&stream, &error);
                continue;
            }
            if connected >= MOST_CLIENTS + STOPPING_CLIENTS {
                let error = WireError::new(ErrorCode::TooManyClients, "too many clients are connected even to stop");
                refuse(&stream, &error);
                continue;
            }
            let rights = if connected < MOST_CLIENTS {
                listener.rights
            } else {
                Rights::Stop
            };
            let place = Place::take(&listener.clients, rig);
            let (number, names) = (self.sessions.get() + 1, Rc::clone(&self.names));
            self.sessions.set(number);
            tokio::task::spawn_local(serve(stream, place, number, rights, names));
        }
    }
}

/// Serves one client until it closes its connection.
async fn serve(stream: UnixStream, place: Place, number: u64, rights: Rights, names: Rc<UserNames>) {
    let session = format!("{}-{number}", std::process::id());
    let Some(peer) = peer_of(&stream, session, &names).await else {
        return;
    };
    let served = session::run(Rc::clone(&place.rig), stream, number, peer, rights);
    if rights == Rights::Stop {
        // The client has had time to stop the rig; its connection is dropped.
        drop(tokio::time::timeout(STOPPING_TIME, served).await);
    } else {
        served.await;
    }
}

/// One of the places for clients, returned however its session ends.
struct Place {
    on_listener: Rc<Cell<usize>>,
    rig: Rc<RigHandle>,
}

impl Place {
    fn take(on_listener: &Rc<Cell<usize>>, rig: &Rc<RigHandle>) -> Self {
        on_listener.set(on_listener.get() + 1);
        rig.clients().set(rig.clients().get() + 1);
        Self {
            on_listener: Rc::clone(on_listener),
            rig: Rc::clone(rig),
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.on_listener.set(self.on_listener.get() - 1);
        self.rig.clients().set(self.rig.clients().get() - 1);
    }
}

/// Tells a client why it is not served, without waiting.
fn refuse(stream: &UnixStream, error: &WireError) {
    let line = format!("{}\n", json!({ "id": null, "error": error }));
    // Nothing was sent before, so the socket has room.
    rustix::net::send(stream, line.as_bytes(), SendFlags::DONTWAIT | SendFlags::NOSIGNAL).unwrap_or_default();
}

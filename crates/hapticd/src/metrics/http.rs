//! The metrics over HTTP, for a Prometheus that scrapes: one path, one answer, one request a connection.

use crate::control::RigHandle;
use std::cell::Cell;
use std::net::SocketAddr;
use std::rc::Rc;
use std::time::Duration;
use thiserror::Error;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::time::timeout;

/// Most connections at once; a monitor needs one.
const MAX_CONNECTIONS: usize = 8;

/// How long a connection may take, whatever it does.
const PATIENCE: Duration = Duration::from_secs(2);

/// Longest request that is read, bytes.
const MAX_REQUEST: usize = 8 * 1024;

/// Why metrics are not served.
#[derive(Debug, Error)]
#[error("cannot serve metrics on {address}: {source}; {remedy}")]
pub(crate) struct MetricsError {
    address: SocketAddr,
    source: std::io::Error,
    remedy: &'static str,
}

/// What helps, for a person.
fn remedy(source: &std::io::Error) -> &'static str {
    if rustix::io::Errno::from_io_error(source) == Some(rustix::io::Errno::AFNOSUPPORT) {
        "the service has no network: install /usr/share/doc/hapticd/examples/metrics.conf as it says, for a rig with a name \
         in hapticd@.service.d"
    } else {
        "name another address with `metrics`"
    }
}

/// Serves the metrics.
#[derive(Debug)]
pub(crate) struct Server(TcpListener);

impl Server {
    pub(crate) async fn bind(address: SocketAddr) -> Result<Self, MetricsError> {
        let bound = TcpListener::bind(address).await;
        bound.map(Self).map_err(|source| MetricsError {
            address,
            remedy: remedy(&source),
            source,
        })
    }

    /// The address, with the port that the system chose for port 0.
    pub(crate) fn address(&self) -> Option<SocketAddr> {
        self.0.local_addr().ok()
    }

    /// Serves for ever. Must run within a `LocalSet`.
    pub(crate) async fn serve(&self, rig: Rc<RigHandle>) {
        let connected = Rc::new(Cell::new(0));
        loop {
            // Clients of the control socket come first.
            tokio::task::yield_now().await;
            let Ok((stream, _)) = self.0.accept().await else {
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            if connected.get() == MAX_CONNECTIONS {
                continue;
            }
            connected.set(connected.get() + 1);
            let (rig, connected) = (Rc::clone(&rig), Rc::clone(&connected));
            tokio::task::spawn_local(async move {
                // A monitor that went away misses nothing but its own scrape.
                drop(timeout(PATIENCE, answer(stream, &rig)).await);
                connected.set(connected.get() - 1);
            });
        }
    }
}

async fn answer(mut stream: TcpStream, rig: &RigHandle) -> std::io::Result<()> {
    let mut request = Vec::with_capacity(1024);
    while !request.windows(4).any(|end| end == b"\r\n\r\n") {
        if request.len() > MAX_REQUEST || stream.read_buf(&mut request).await? == 0 {
            return Ok(());
        }
    }
    let mut words = request.split(u8::is_ascii_whitespace);
    let (method, path) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let path = path.split(|&byte| byte == b'?').next().unwrap_or_default();
    const OPENMETRICS: &str = "application/openmetrics-text";
    let (status, kind, body) = match (method, path) {
        (b"GET", b"/metrics") if String::from_utf8_lossy(&request).contains(OPENMETRICS) => (
            "200 OK",
            "application/openmetrics-text; version=1.0.0; charset=utf-8",
            super::openmetrics(rig),
        ),
        (b"GET", b"/metrics") => (
            "200 OK",
            "text/plain; version=0.0.4; charset=utf-8",
            super::prometheus_text(&super::openmetrics(rig)),
        ),
        (b"GET", _) => (
            "404 Not Found",
            "text/plain",
            "The metrics are at /metrics.\n".to_owned(),
        ),
        _ => (
            "405 Method Not Allowed\r\nAllow: GET",
            "text/plain",
            "GET /metrics\n".to_owned(),
        ),
    };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes()).await?;
    stream.write_all(body.as_bytes()).await?;
    stream.shutdown().await
}

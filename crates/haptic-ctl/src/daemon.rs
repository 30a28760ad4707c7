//! The daemon, as the subcommands ask it.

use crate::failure::Failure;
use haptic_ipc::{AsyncClient, ClientError, Event, Hello, LeaseReply, MAX_COMMISSION_LEASE_MS, Request, socket_path};
use serde::de::{DeserializeOwned, IgnoredAny};
use std::path::Path;
use std::time::Duration;

/// How long an answer may take before the daemon counts as hung.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// How long it may be quiet before it is asked whether it is there.
const QUIET: Duration = Duration::from_secs(1);

pub(crate) struct Daemon {
    client: AsyncClient,
}

impl Daemon {
    /// Connects to the socket given, else to the first default that exists.
    pub(crate) async fn connect(socket: Option<&Path>) -> Result<Self, Failure> {
        let path = socket_path::for_client(socket);
        Ok(Self {
            client: in_time(AsyncClient::connect(&path)).await?,
        })
    }

    /// Connects and asks at once, as who has no place must.
    pub(crate) async fn ask_at_once<R: DeserializeOwned>(
        socket: Option<&Path>,
        request: Request,
    ) -> Result<R, Failure> {
        let path = socket_path::for_client(socket);
        in_time(AsyncClient::ask_at_once(&path, request)).await
    }

    pub(crate) fn hello(&self) -> &Hello {
        self.client.hello()
    }

    pub(crate) async fn ask<R: DeserializeOwned>(&mut self, request: Request) -> Result<R, Failure> {
        in_time(self.client.request(request)).await
    }

    /// Begins what moves the rig by itself, with a lease that ends it with this program. One that is refused leaves
    /// none behind, which would take another client's force away.
    pub(crate) async fn begin_with_lease<R: DeserializeOwned>(&mut self, request: Request) -> Result<R, Failure> {
        let lease = |timeout_ms| Request::Lease { timeout_ms };
        let _: LeaseReply = self.ask(lease(MAX_COMMISSION_LEASE_MS)).await?;
        let begun = self.ask(request).await;
        if begun.is_err() {
            // Why it was refused is worth more than an error of this.
            drop(self.ask::<LeaseReply>(lease(0)).await);
        }
        begun
    }

    /// Waits for the next event, for as long as the daemon answers. Safe to drop half-way.
    pub(crate) async fn next_event(&mut self) -> Result<Event, Failure> {
        loop {
            match tokio::time::timeout(QUIET, self.client.next_event()).await {
                Ok(event) => return Ok(event?),
                Err(_) => drop(self.ask::<IgnoredAny>(are_you_there()).await?),
            }
        }
    }

    pub(crate) async fn answers_within(&mut self, time: Duration) -> bool {
        let asked = self.client.request::<IgnoredAny>(are_you_there());
        tokio::time::timeout(time, asked).await.is_ok()
    }

    /// Waits for the next event of a subscription that brings one each second. Safe to drop
    /// half-way.
    pub(crate) async fn regular_event(&mut self) -> Result<Event, Failure> {
        in_time(self.client.next_event()).await
    }
}

/// What costs a daemon the least to answer.
const fn are_you_there() -> Request {
    Request::Log {
        after: None,
        limit: Some(0),
    }
}

async fn in_time<T>(answer: impl Future<Output = Result<T, ClientError>>) -> Result<T, Failure> {
    match tokio::time::timeout(ANSWER_TIMEOUT, answer).await {
        Ok(answer) => Ok(answer?),
        Err(_) => Err(Failure::NoAnswer(ANSWER_TIMEOUT)),
    }
}

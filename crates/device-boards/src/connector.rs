//! The connector of any board here: it opens the line, greets the controller in its dialect, and
//! begins the conversation.

use crate::connection::TextConnection;
use crate::conversation::{Conversation, Scale};
use crate::dialect::Dialect;
use crate::greeting::Greeting;
use crate::motor_options::MotorOptions;
use device_io::clock;
use device_io::link::{
    ConnectError, Connector, DeviceFacts, GreetedDevice, LinkCounters, LoopTiming, RigIdentity, folder_of,
};
use std::ffi::OsStr;
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

/// One maker's controller, by its options: all that greeting it does not share with those of other
/// makers.
pub(crate) trait Controller: Debug + Send {
    /// Its protocol.
    type Dialect: Dialect + 'static;

    /// Its kind, as in an address.
    const KIND: &'static str;

    /// Its line and mechanism.
    fn motor(&self) -> &MotorOptions;

    /// The motor, for people, as in `axis 0 of the ODrive`.
    fn name(&self) -> String;

    /// The motor among those of the board, as in `axis0`.
    fn part(&self) -> String;

    /// Asks it who it is, and leaves its motor off.
    ///
    /// # Errors
    /// It does not answer, or cannot be used.
    fn greet(&self, greeting: &mut Greeting) -> Result<Introduction<Self::Dialect>, ConnectError>;
}

/// What is known of a controller that has been greeted.
#[derive(Debug)]
pub(crate) struct Introduction<D> {
    pub(crate) dialect: D,
    pub(crate) scale: Scale,
    /// Name and version of its firmware.
    pub(crate) firmware: String,
    /// Time without a command after which it switches its motor off, ms.
    pub(crate) watchdog_ms: Option<u32>,
}

/// Finds and greets a controller.
#[derive(Debug)]
pub(crate) struct BoardConnector<C> {
    controller: C,
}

impl<C: Controller> BoardConnector<C> {
    pub(crate) fn new(controller: C) -> Self {
        Self { controller }
    }
}

impl<C: Controller> Connector for BoardConnector<C> {
    fn address(&self) -> String {
        format!(
            "{} on {}",
            self.controller.name(),
            self.controller.motor().path.display()
        )
    }

    fn folder(&self) -> PathBuf {
        folder_of(&self.controller.motor().path)
    }

    fn concerns(&self, node: &OsStr) -> bool {
        self.controller.motor().path.file_name() == Some(node)
    }

    fn connect(
        &mut self,
        LoopTiming { period_ns, .. }: LoopTiming,
        counters: &Arc<LinkCounters>,
    ) -> Result<GreetedDevice, ConnectError> {
        let motor = self.controller.motor();
        let mut greeting = Greeting::begin(&motor.path, motor.baud)?;
        let _asking = counters.ask(clock::now_ns());
        let Introduction {
            dialect,
            scale,
            firmware,
            watchdog_ms,
        } = self.controller.greet(&mut greeting)?;
        #[expect(clippy::cast_precision_loss, reason = "a period of milliseconds")]
        let sample_rate_hz = 1e9 / period_ns as f64;
        let conversation = Conversation::new(dialect, scale, period_ns, clock::now_ns(), Arc::clone(counters));
        Ok(GreetedDevice {
            device: DeviceFacts {
                firmware,
                force_limit_n: scale.force_limit_n(),
                sample_rate_hz,
                resolution_m: scale.resolution_m,
                watchdog_ms,
                buttons: 0,
                rig: RigIdentity::of_line(C::KIND, &motor.path)
                    .with_part(&self.controller.part())
                    .turned_round(motor.reversed),
            },
            connection: Box::new(TextConnection::new(greeting.line, conversation, Arc::clone(counters))),
        })
    }
}

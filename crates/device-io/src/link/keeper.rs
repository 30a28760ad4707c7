//! The keeper of a link: it finds the device, greets it, hands the connection to the real-time
//! thread, takes it back after a failure, and looks again. It looks when the device nodes change,
//! and otherwise only repeats its question to a device that is there and does not answer.

use super::connector::{ConnectError, Connection, Connector, DeviceInfo, GreetedDevice, LoopTiming};
use super::health::LinkCounters;
use super::link_device::{Handover, LinkDevice};
use super::nodes::NodeWatch;
use super::planar_link::{Homing, PlanarLink};
use crate::device::DeviceBounds;
use crate::kinematics::Kinematics;
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::atomic::Ordering::{Relaxed, SeqCst};
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// The state of a link.
#[derive(Clone, Debug, PartialEq)]
pub enum LinkState {
    /// Looking for the device.
    Looking,
    /// It cannot be used.
    Waiting(ConnectError),
    /// It has been greeted. Its connection is that of the [bounds](crate::Device::bounds) while it is used.
    Connected(DeviceInfo),
}

/// The view of a link for all threads but the real-time thread.
#[derive(Clone, Debug)]
pub struct LinkMonitor {
    state: Arc<Mutex<LinkState>>,
    counters: Arc<LinkCounters>,
    failed_attempts: Arc<AtomicU64>,
    homing: Homing,
}

impl LinkMonitor {
    /// Whether the home pose of a rig of two axes is known, and how to tell it.
    #[must_use]
    pub fn homing(&self) -> &Homing {
        &self.homing
    }

    /// Times that the device could not be used.
    #[must_use]
    pub fn failed_attempts(&self) -> u64 {
        self.failed_attempts.load(Relaxed)
    }

    /// The state of the link.
    #[must_use]
    pub fn state(&self) -> LinkState {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Its counters.
    #[must_use]
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    fn set(&self, state: LinkState) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
    }
}

/// Room for connections on their way to one side: only one is in use, and one may still be on its
/// way back.
const ROOM: usize = 4;

/// Shortest and longest time until a device that is there and cannot be used is tried again.
const TRY_AGAIN: (Duration, Duration) = (Duration::from_millis(500), Duration::from_secs(4));

/// Longest time until the keeper sees that a connection has come back, or that it must end.
const LOOK: Duration = Duration::from_millis(20);

/// The keeper before its start.
#[derive(Debug)]
pub struct Keeper {
    connector: Box<dyn Connector>,
    timing: LoopTiming,
    /// How the two motors of the device move the hand; without, it must have one.
    kinematics: Option<Kinematics>,
    monitor: LinkMonitor,
    greeted: Producer<Handover>,
    failed: Consumer<Box<dyn Connection>>,
}

/// How long a device that is there and cannot be used is left alone.
#[derive(Debug)]
struct BackOff(Duration);

impl Default for BackOff {
    fn default() -> Self {
        Self(TRY_AGAIN.0)
    }
}

impl BackOff {
    /// The pause after one more failure: twice the one before, up to the longest.
    fn next_pause(&mut self) -> Duration {
        let pause = self.0;
        self.0 = (2 * pause).min(TRY_AGAIN.1);
        pause
    }
}

/// Ends the keeper when it is dropped.
#[derive(Debug)]
pub struct RunningKeeper {
    quit: Arc<AtomicBool>,
}

impl Drop for RunningKeeper {
    fn drop(&mut self) {
        // Does not wait for the keeper: it may be greeting a slow device.
        self.quit.store(true, SeqCst);
    }
}

impl Keeper {
    /// A link through a connector, for a loop: its real-time end, its monitor,
    /// and the keeper, which the caller must start.
    #[must_use]
    pub fn new(connector: Box<dyn Connector>, timing: LoopTiming) -> (LinkDevice, LinkMonitor, Self) {
        Self::of_any(connector, timing, None)
    }

    /// The same of a device whose two motors move the hand in a plane.
    #[must_use]
    pub fn planar(
        connector: Box<dyn Connector>,
        timing: LoopTiming,
        kinematics: Kinematics,
    ) -> (PlanarLink, LinkMonitor, Self) {
        let (device, monitor, keeper) = Self::of_any(connector, timing, Some(kinematics));
        (
            PlanarLink::new(device, kinematics, monitor.homing.clone()),
            monitor,
            keeper,
        )
    }

    fn of_any(
        connector: Box<dyn Connector>,
        timing: LoopTiming,
        kinematics: Option<Kinematics>,
    ) -> (LinkDevice, LinkMonitor, Self) {
        let (greeted, to_use) = RingBuffer::new(ROOM);
        let (given_up, failed) = RingBuffer::new(ROOM);
        let device = LinkDevice::new(connector.address(), to_use, given_up);
        let monitor = LinkMonitor {
            state: Arc::new(Mutex::new(LinkState::Looking)),
            counters: Arc::new(LinkCounters::default()),
            failed_attempts: Arc::default(),
            homing: Homing::default(),
        };
        let keeper = Self {
            connector,
            timing,
            kinematics,
            monitor: monitor.clone(),
            greeted,
            failed,
        };
        (device, monitor, keeper)
    }

    /// Starts the keeper on a thread of its own with the affinity of the caller.
    ///
    /// # Errors
    /// The system has no thread left.
    pub fn start(mut self) -> std::io::Result<RunningKeeper> {
        let quit = Arc::new(AtomicBool::new(false));
        let its_quit = Arc::clone(&quit);
        std::thread::Builder::new()
            .name("link".to_owned())
            .spawn(move || self.run(&its_quit))?;
        Ok(RunningKeeper { quit })
    }

    fn run(&mut self, quit: &AtomicBool) {
        let mut nodes = NodeWatch::new(self.connector.folder());
        let mut back_off = BackOff::default();
        let counters = Arc::clone(&self.monitor.counters);
        let samples = || counters.samples.load(Relaxed);
        let mut connections = 0;
        while !quit.load(SeqCst) {
            // Every change from here on, also one while it connects, is seen below.
            nodes.clear();
            let samples_before = samples();
            let greeted = self.connector.connect(self.timing, &counters);
            let error = match greeted.and_then(|greeted| self.suited(greeted)) {
                Ok(mut greeted) => {
                    connections += 1;
                    greeted.device.connection = connections;
                    let bounds = DeviceBounds {
                        connection: connections,
                        is_linked: true,
                        resolution_m: greeted.device.resolution_m,
                        force_limit_n: greeted.device.force_limit_n,
                    };
                    let is_absolute = greeted.device.motors.is_some_and(|motors| motors.are_absolute);
                    self.monitor
                        .homing
                        .connected(connections, is_absolute || self.has_no_home());
                    // Announced before it can be used: nobody may find it in use and know only the
                    // one before.
                    self.monitor.set(LinkState::Connected(greeted.device));
                    // There is room: the last one has come back.
                    drop(self.greeted.push((greeted.connection, bounds)));
                    self.wait_for_failure(quit);
                    if samples() > samples_before {
                        back_off = BackOff::default();
                        self.monitor.set(LinkState::Looking);
                        continue;
                    }
                    ConnectError::Protocol {
                        what: self.connector.address(),
                        problem: "it answers the hello and sends no samples".to_owned(),
                    }
                }
                Err(error) => error,
            };
            let pause = match error {
                ConnectError::Absent { .. } => None,
                _ => Some(back_off.next_pause()),
            };
            self.monitor.failed_attempts.fetch_add(1, Relaxed);
            self.monitor.set(LinkState::Waiting(error));
            if pause.is_some() {
                // The end of this attempt has changed the node, too.
                nodes.clear();
            }
            if self.wait_for_node(&mut nodes, pause, quit) {
                back_off = BackOff::default();
            }
        }
    }

    /// Whether its positions need no home pose.
    fn has_no_home(&self) -> bool {
        self.kinematics.is_none_or(|kinematics| kinematics.home().is_none())
    }

    /// The device, where it has the motors that its kinematics are of, with the resolution and the limit of the hand.
    fn suited(&self, mut greeted: GreetedDevice) -> Result<GreetedDevice, ConnectError> {
        let device = &mut greeted.device;
        let problem = match (self.kinematics, device.motors) {
            (None, None) => return Ok(greeted),
            (None, Some(_)) => "the device has two axes: say how they move the hand, as in --kinematics xy".to_owned(),
            (Some(_), None) => "the device has one axis: leave --kinematics out".to_owned(),
            (Some(kinematics), Some(motors)) => {
                if kinematics.are_rotary() != motors.are_rotary {
                    let of = |are_rotary| if are_rotary { "rotary" } else { "linear" };
                    let (theirs, ours) = (of(motors.are_rotary), of(kinematics.are_rotary()));
                    format!("the device has {theirs} axes, and the kinematics {kinematics} are of {ours} ones")
                } else if kinematics.are_rotary() && kinematics.home().is_none() && !motors.are_absolute {
                    "the counts of the device are not absolute: name home_deg in the kinematics".to_owned()
                } else {
                    device.resolution_m = kinematics.coarsest_step(motors.counts).value;
                    device.force_limit_n = kinematics.force_limit_n(motors.limits);
                    return Ok(greeted);
                }
            }
        };
        Err(ConnectError::Protocol {
            what: self.connector.address(),
            problem,
        })
    }

    /// Waits for a change of the device's node, for a time at most where there is one. Returns whether it has changed.
    fn wait_for_node(&self, nodes: &mut NodeWatch, limit: Option<Duration>, quit: &AtomicBool) -> bool {
        let mut waited = Duration::ZERO;
        while !quit.load(SeqCst) && limit.is_none_or(|limit| waited < limit) {
            if nodes.changed(LOOK, |node| self.connector.concerns(node)) {
                return true;
            }
            waited += LOOK;
        }
        false
    }

    /// Returns when the connection has come back, closed.
    fn wait_for_failure(&mut self, quit: &AtomicBool) {
        while !quit.load(SeqCst) {
            if self.failed.pop().is_ok() {
                return;
            }
            std::thread::sleep(LOOK);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Device, DeviceError, Measurement, Written};
    use crate::kinematics::tests::{absolute_five_bar, five_bar};
    use crate::link::RigIdentity;
    use crate::link::connector::TwoMotors;
    use std::ffi::OsStr;
    use std::path::PathBuf;

    /// A device that answers the hello, and then nothing.
    #[derive(Debug)]
    struct OnlyGreets;

    fn greeted(motors: Option<TwoMotors>) -> GreetedDevice {
        let device = DeviceInfo {
            connection: 0,
            firmware: String::new(),
            force_limit_n: 1.0,
            sample_rate_hz: 1000.0,
            resolution_m: 1e-5,
            watchdog_ms: None,
            buttons: 0,
            rig: RigIdentity::default(),
            motors,
        };
        let connection = Box::new(OnlyGreets);
        GreetedDevice { connection, device }
    }

    impl Connector for OnlyGreets {
        fn address(&self) -> String {
            "the rig".to_owned()
        }

        fn folder(&self) -> PathBuf {
            "/".into()
        }

        fn concerns(&self, _: &OsStr) -> bool {
            false
        }

        fn connect(&mut self, _: LoopTiming, _: &Arc<LinkCounters>) -> Result<GreetedDevice, ConnectError> {
            Ok(greeted(None))
        }
    }

    impl Connection for OnlyGreets {
        fn read(&mut self, _: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
            Err(DeviceError::Disconnected)
        }

        fn write(&mut self, _: [f64; 2], _: bool, _: u64) -> Result<Written, DeviceError> {
            Err(DeviceError::Disconnected)
        }
    }

    #[test]
    fn a_device_that_only_greets_is_reported_and_left_alone() {
        let (mut device, monitor, keeper) = Keeper::new(Box::new(OnlyGreets), LoopTiming::default());
        let _running = keeper.start().expect("a thread");
        let message = loop {
            assert_eq!(device.read(0), Err(DeviceError::Disconnected));
            assert!(device.bounds().connection < 100, "it connects again and again");
            match monitor.state() {
                LinkState::Waiting(error) => break error.to_string(),
                _ => std::thread::sleep(Duration::from_millis(1)),
            }
        };
        assert_eq!(message, "the rig: it answers the hello and sends no samples");
        assert_eq!(monitor.failed_attempts(), 1);
    }

    // hazard: H36
    #[test]
    fn motors_that_the_kinematics_are_not_of_are_refused() {
        let motors = |are_rotary, are_absolute| {
            Some(TwoMotors {
                are_rotary,
                are_absolute,
                counts: [1e-5; 2],
                limits: [1.0; 2],
            })
        };
        let (relative, absolute) = (Some(five_bar(38.0)), Some(absolute_five_bar()));
        let xy = Some("xy".parse().expect("kinematics"));
        for (kinematics, motors, expected) in [
            (None, motors(false, false), Some("the device has two axes")),
            (xy, None, Some("the device has one axis")),
            (xy, motors(true, false), Some("the device has rotary axes")),
            (relative, motors(false, false), Some("the device has linear axes")),
            (absolute, motors(true, false), Some("name home_deg")),
            (None, None, None),
            (xy, motors(false, false), None),
            (relative, motors(true, false), None),
            (absolute, motors(true, true), None),
            // Count 0 is the home pose, whatever its angles are.
            (relative, motors(true, true), None),
        ] {
            let (_, _, mut keeper) = Keeper::new(Box::new(OnlyGreets), LoopTiming::default());
            keeper.kinematics = kinematics;
            let problem = keeper.suited(greeted(motors)).err().map(|error| error.to_string());
            assert_eq!(problem.is_some(), expected.is_some(), "{expected:?}: {problem:?}");
            let (problem, expected) = (problem.unwrap_or_default(), expected.unwrap_or_default());
            assert!(problem.contains(expected), "{expected}: {problem}");
        }
    }

    #[test]
    fn each_failure_doubles_the_pause_up_to_the_longest() {
        let mut back_off = BackOff::default();
        let pauses_ms: Vec<u128> = (0..6).map(|_| back_off.next_pause().as_millis()).collect();
        assert_eq!(pauses_ms, [500, 1000, 2000, 4000, 4000, 4000]);
    }
}

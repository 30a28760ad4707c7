//! What happens to the link to the rig, from the inputs of the ticks and the status of the link.

use crate::output;
use haptic_core::sample::DeviceError;
use haptic_ipc::{Event, LinkedDevice, Sample};
use haptic_recording::Mark;

/// Notices when the device fails, comes back, and is another one.
pub(super) struct LinkWatch {
    /// What the device failed with in the newest row.
    error: Option<DeviceError>,
    device: Option<LinkedDevice>,
}

impl LinkWatch {
    pub(super) fn new(device: Option<LinkedDevice>) -> Self {
        Self { error: None, device }
    }

    /// The marks to set before the rows of an event; `next_tick` is the tick after them.
    pub(super) fn marks(&mut self, event: &Event, next_tick: u64) -> Vec<Mark> {
        match event {
            Event::Samples(samples) => samples.rows.iter().filter_map(|row| self.row(row)).collect(),
            Event::Timing(timing) => {
                let found = timing.link.as_ref().and_then(|link| link.device.as_ref());
                let other = found.filter(|found| self.device.as_ref() != Some(*found));
                other
                    .map(|found| self.device_mark(found, next_tick))
                    .into_iter()
                    .collect()
            }
            _ => Vec::new(),
        }
    }

    fn row(&mut self, row: &Sample) -> Option<Mark> {
        let error = row.input_word().sample(0, 0, 0.0).err();
        if error == self.error {
            return None;
        }
        self.error = error;
        Some(Mark::Link {
            tick: row.tick,
            text: error.map_or_else(|| "the device answers again".to_owned(), |error| error.to_string()),
        })
    }

    fn device_mark(&mut self, device: &LinkedDevice, tick: u64) -> Mark {
        self.device = Some(device.clone());
        Mark::Link {
            tick,
            text: format!(
                "another device: {}, resolution {} m, force limit {} N",
                device.firmware,
                output::figure(device.resolution_m),
                output::figure(device.force_limit_n)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::servo::{Events, InputWord, Inputs};
    use haptic_ipc::{LinkStatus, SamplesEvent, Timing};

    fn rows(errors: &[Option<DeviceError>]) -> Event {
        let row = |(tick, error): (u64, &Option<DeviceError>)| {
            let inputs = Inputs {
                elapsed_ns: 0,
                sample: error.map_or_else(|| Ok(haptic_core::sample::Measurement::new(0, 0, 0.0)), Err),
                device_resolution_m: 0.0,
                device_force_limit_n: 0.0,
                events: Events::default(),
                command: None,
            };
            let word = InputWord::new(&inputs, false);
            Sample {
                tick,
                input_flags: word.flags,
                error_detail: word.detail,
                ..Sample::default()
            }
        };
        Event::Samples(SamplesEvent {
            rows: (10..).zip(errors).map(row).collect(),
            ..SamplesEvent::default()
        })
    }

    fn marks(found: Vec<Mark>) -> Vec<(u64, String)> {
        found
            .into_iter()
            .map(|mark| match mark {
                Mark::Link { tick, text } => (tick, text),
                other => panic!("{other:?}"),
            })
            .collect()
    }

    #[test]
    fn a_device_that_goes_and_comes_back_is_marked_at_its_tick() {
        let mut watch = LinkWatch::new(None);
        let gone = Some(DeviceError::Disconnected);
        assert_eq!(
            marks(watch.marks(&rows(&[None, gone, gone]), 13)),
            [(11, "the device is disconnected".to_owned())]
        );
        let off = Some(DeviceError::MotorOff { watchdog: false });
        assert_eq!(
            marks(watch.marks(&rows(&[gone, off, None, None]), 14)),
            [
                (11, "the device has its motor off".to_owned()),
                (12, "the device answers again".to_owned())
            ]
        );
    }

    #[test]
    fn another_device_is_marked_once() {
        let device = |resolution_m| LinkedDevice {
            firmware: "mine 1.0".to_owned(),
            force_limit_n: 20.0,
            sample_rate_hz: 1000.0,
            resolution_m,
            watchdog_ms: None,
            rig: None,
        };
        let timing = |device| {
            let link = LinkStatus {
                device,
                ..LinkStatus::default()
            };
            let link = Some(link);
            Event::Timing(Box::new(Timing {
                link,
                ..Timing::default()
            }))
        };
        let mut watch = LinkWatch::new(Some(device(1e-5)));
        assert_eq!(marks(watch.marks(&timing(Some(device(1e-5))), 7)), []);
        assert_eq!(marks(watch.marks(&timing(None), 7)), []);
        let found = marks(watch.marks(&timing(Some(device(1e-6))), 7));
        assert_eq!(
            found,
            [(
                7,
                "another device: mine 1.0, resolution 1e-6 m, force limit 20 N".to_owned()
            )]
        );
        assert_eq!(marks(watch.marks(&timing(Some(device(1e-6))), 8)), []);
    }
}

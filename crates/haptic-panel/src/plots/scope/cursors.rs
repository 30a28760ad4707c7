//! Two cursors on the time axis, and the differences between them.

use crate::tape::Tape;
use crate::tape::plane::Component;
use crate::tape::signal::Signal;

/// The cursors, in s on the plots' time axis.
#[derive(Debug, Default)]
pub(crate) struct Cursors {
    pub(crate) shown: bool,
    pub(crate) at_s: [f64; 2],
}

/// A signal at both cursors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reading {
    pub(crate) signal: Signal,
    pub(crate) component: Component,
    /// In the unit of the signal's quantity; `None` without a sample.
    pub(crate) values: [Option<f64>; 2],
}

impl Reading {
    /// From the first cursor to the second.
    pub(crate) fn difference(&self) -> Option<f64> {
        let [first, second] = self.values;
        Some(second? - first?)
    }
}

impl Cursors {
    /// Shows the cursors at a third and two thirds of the time seen, or hides them. Cursors out of sight
    /// are brought back instead of hidden.
    pub(crate) fn toggle(&mut self, (left_s, right_s): (f64, f64)) {
        let in_sight = self.at_s.iter().any(|at_s| (left_s..=right_s).contains(at_s));
        self.shown = !(self.shown && in_sight);
        let span_s = right_s - left_s;
        self.at_s = [left_s + span_s / 3.0, left_s + span_s * 2.0 / 3.0];
    }

    /// From the first to the second, s.
    pub(crate) fn distance_s(&self) -> f64 {
        self.at_s[1] - self.at_s[0]
    }

    /// The inverse of the distance, Hz.
    pub(crate) fn frequency_hz(&self) -> Option<f64> {
        let distance = self.distance_s().abs();
        (distance > 0.0).then(|| 1.0 / distance)
    }

    /// The cursor nearer to a time of the axis.
    pub(crate) fn nearest(&self, t_s: f64) -> usize {
        usize::from((self.at_s[1] - t_s).abs() < (self.at_s[0] - t_s).abs())
    }

    /// A component of a signal at both cursors, on a tape whose axis has its zero at `zero_s`.
    pub(crate) fn read(&self, (signal, component): (Signal, Component), tape: &Tape, zero_s: f64) -> Reading {
        let tape = tape.component(component);
        Reading {
            signal,
            component,
            values: self.at_s.map(|at_s| tape?.value_at(signal, zero_s + at_s)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;

    fn device_position() -> (Signal, Component) {
        (Signal::DEVICE_POSITION, Component::Whole)
    }

    #[test]
    fn the_cursors_read_the_samples_under_them() {
        let tape = Tape::recorded((0..100).map(|i| {
            let mut row = at(f64::from(i));
            row.device_position_m = f64::from(i);
            row
        }));
        let mut cursors = Cursors::default();
        cursors.toggle((-60.0, -30.0));
        assert_eq!(cursors.at_s, [-50.0, -40.0]);
        let reading = cursors.read(device_position(), &tape, 99.0);
        assert_eq!(reading.values, [Some(49e3), Some(59e3)]);
        assert_eq!(reading.difference(), Some(10e3));
        assert_eq!(cursors.frequency_hz(), Some(0.1));
        assert_eq!((cursors.nearest(-49.0), cursors.nearest(-44.0)), (0, 1));
        cursors.toggle((-5.0, 4.0));
        assert_eq!(
            (cursors.shown, cursors.at_s),
            (true, [-2.0, 1.0]),
            "they were out of sight"
        );
        cursors.toggle((-5.0, 4.0));
        assert!(!cursors.shown);
        cursors.at_s = [-500.0, -40.0];
        assert_eq!(cursors.read(device_position(), &tape, 99.0).difference(), None);
    }
}

//! The second axis of a rig of two: tapes of the same samples, with its numbers, or those of both axes together, in
//! the fields of a [`Sample`]. What reads a tape reads each of them.

use super::Tape;
use super::signal::{Quantity, Signal};
use haptic_ipc::{Sample, SampleY};
use std::borrow::Cow;

/// What a line shows of a signal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Component {
    /// All of it, on a rig of one axis.
    #[default]
    Whole,
    /// Along the first axis of two.
    X,
    /// Along the second.
    Y,
    /// The length of its vector.
    Length,
}

impl Component {
    const ALL: [Self; 4] = [Self::Whole, Self::X, Self::Y, Self::Length];

    /// Those that are drawn of a signal: x and y on a plane, or the length where there is one and it is wanted.
    pub(crate) fn of(signal: Signal, is_plane: bool, as_length: bool) -> &'static [Self] {
        match signal.quantity() {
            _ if !is_plane => &[Self::Whole],
            Quantity::Duration => &[Self::Whole],
            _ if as_length && has_length(signal) => &[Self::Length],
            _ => &[Self::X, Self::Y],
        }
    }

    /// Those of a signal by which a trigger may go, the first axis of two as `Whole`.
    pub(crate) fn of_trigger(signal: Signal, is_plane: bool) -> &'static [Self] {
        match Self::of(signal, is_plane, false) {
            [Self::Whole] => &[Self::Whole],
            _ if has_length(signal) => &[Self::Whole, Self::Y, Self::Length],
            _ => &[Self::Whole, Self::Y],
        }
    }

    pub(crate) fn name(self, signal: Signal) -> Cow<'static, str> {
        let name = signal.name();
        match self {
            Self::Whole => name.into(),
            Self::X => format!("{name}, x").into(),
            Self::Y => format!("{name}, y").into(),
            Self::Length => format!("{name}, length").into(),
        }
    }
}

/// Whether a signal is a vector whose length does not depend on where zero is.
pub(crate) fn has_length(signal: Signal) -> bool {
    matches!(
        signal.quantity(),
        Quantity::Force | Quantity::Velocity | Quantity::Deflection
    )
}

/// The tapes of the second axis and of the lengths, whose samples have the places of those of the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Plane {
    pub(super) y: Tape,
    pub(super) length: Tape,
}

/// A sample with the second axis in the fields of the first.
pub(super) fn second_axis(sample: &Sample, y: &SampleY) -> Sample {
    Sample {
        device_position_m: y.device_position_m,
        device_velocity_mps: y.device_velocity_mps,
        block_position_m: y.block_position_m,
        block_velocity_mps: y.block_velocity_mps,
        coupling_force_n: y.coupling_force_n,
        command_force_n: y.command_force_n,
        sample_position_m: y.sample_position_m,
        ..*sample
    }
}

/// What a sample has of a second axis, where that is in the fields of the first.
pub(crate) fn of_second_axis(y: &Sample) -> SampleY {
    SampleY {
        device_position_m: y.device_position_m,
        device_velocity_mps: y.device_velocity_mps,
        block_position_m: y.block_position_m,
        block_velocity_mps: y.block_velocity_mps,
        coupling_force_n: y.coupling_force_n,
        command_force_n: y.command_force_n,
        sample_position_m: y.sample_position_m,
    }
}

/// A sample with lengths in the fields of the first axis. The device's position is its distance from the block, at
/// zero: the length of the coupling's deflection.
pub(super) fn lengths(x: &Sample, y: &Sample) -> Sample {
    let length = |of: fn(&Sample) -> f64| of(x).hypot(of(y));
    Sample {
        device_position_m: length(|axis| axis.device_position_m - axis.block_position_m),
        device_velocity_mps: length(|axis| axis.device_velocity_mps),
        block_position_m: 0.0,
        block_velocity_mps: length(|axis| axis.block_velocity_mps),
        coupling_force_n: length(|axis| axis.coupling_force_n),
        command_force_n: length(|axis| axis.command_force_n),
        ..*x
    }
}

impl Tape {
    /// Whether its rig has two axes.
    pub(crate) fn is_plane(&self) -> bool {
        self.plane.is_some()
    }

    /// The samples of a component; `None` where the rig has one axis.
    pub(crate) fn component(&self, component: Component) -> Option<&Self> {
        match component {
            Component::Whole | Component::X => Some(self),
            Component::Y => self.plane.as_ref().map(|plane| &plane.y),
            Component::Length => self.plane.as_ref().map(|plane| &plane.length),
        }
    }

    /// The [outlines](Self::outlines) of components of signals; empty for those that the rig does not have.
    pub(crate) fn lines(&self, lines: &[(Signal, Component)], ends: (f64, f64), column_s: f64) -> Vec<Vec<[f64; 2]>> {
        let mut all = vec![Vec::new(); lines.len()];
        for component in Component::ALL {
            let of_component = |place: &usize| lines[*place].1 == component;
            let places: Vec<usize> = (0..lines.len()).filter(of_component).collect();
            let Some(tape) = self.component(component).filter(|_| !places.is_empty()) else {
                continue;
            };
            let signals: Vec<Signal> = places.iter().map(|place| lines[*place].0).collect();
            for (place, points) in places.into_iter().zip(tape.outlines(&signals, ends, column_s)) {
                all[place] = points;
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;

    fn y(force_n: f64) -> SampleY {
        SampleY {
            device_position_m: 0.004,
            block_position_m: 0.0,
            coupling_force_n: force_n,
            ..SampleY::default()
        }
    }

    /// A sample each second whose force is (3, 4) N, and whose deflection is (3, 4) mm.
    fn tape(seconds: std::ops::Range<u32>) -> Tape {
        let mut tape = Tape::default();
        let row = |second| Sample {
            device_position_m: 0.013,
            block_position_m: 0.01,
            coupling_force_n: 3.0,
            ..at(f64::from(second))
        };
        tape.extend_ticks(seconds.map(|second| (row(second), Some(y(4.0)))));
        tape
    }

    #[test]
    fn a_plane_has_x_y_and_lengths_at_the_same_places() {
        let tape = tape(0..100);
        let deflection = Signal::named("Coupling deflection").expect("a signal");
        let force = Signal::COUPLING_FORCE;
        for (signal, component, value) in [
            (force, Component::X, 3.0),
            (force, Component::Y, 4.0),
            (force, Component::Length, 5.0),
            (deflection, Component::Length, 5.0),
        ] {
            let of = tape.component(component).expect("a plane");
            assert_eq!((of.len(), of.oldest_s()), (61, Some(39.0)), "the last minute");
            let found = of.value_at(signal, 70.0).expect("a sample");
            assert!((found - value).abs() < 1e-9, "{component:?}: {found}");
            let lines = tape.lines(&[(signal, component)], (50.0, 60.0), 0.1);
            assert!(lines[0].iter().all(|[_, drawn]| (drawn - value).abs() < 1e-9));
        }
        let part = tape.part(50.0, 60.0);
        assert_eq!(part.component(Component::Y).map(Tape::len), Some(part.len()));
    }

    #[test]
    fn one_axis_has_no_second_and_two_never_mix_with_one() {
        let mut line = Tape::recorded([at(1.0)]);
        assert!(!line.is_plane() && line.component(Component::Length).is_none());
        let drawn = [(Signal::COUPLING_FORCE, Component::Y)];
        assert!(line.lines(&drawn, (0.0, 2.0), 0.1)[0].is_empty());
        line.extend_ticks([(at(2.0), Some(y(1.0)))]);
        assert_eq!((line.is_plane(), line.len()), (true, 1), "another rig");
        line.extend_ticks([(at(3.0), Some(y(f64::NAN))), (at(4.0), Some(y(2.0)))]);
        assert_eq!(line.len(), 2, "what is no number is left out of both axes");
        line.push_tick(at(5.0), None);
        assert_eq!((line.is_plane(), line.len()), (false, 1));
    }
}

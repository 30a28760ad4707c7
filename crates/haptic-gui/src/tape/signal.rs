//! The signals of a sample that plots, trigger and cursors offer: one list of descriptors.

use crate::theme::Palette;
use egui::Color32;
use haptic_ipc::Sample;

/// Positions are shown in mm and velocities in mm/s: a desktop rig moves by a few centimetres.
pub(crate) const MM_PER_M: f64 = 1e3;

/// Largest magnitude that is drawn, in the unit of the quantity. A larger value is neither a force
/// nor a position of a rig, and exceeds the digits of the axes' arithmetic.
const DRAWABLE: f64 = 1e9;

/// A vertical axis of the plots over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Force,
    Position,
    Velocity,
}

impl Quantity {
    pub(crate) const ALL: [Self; 3] = [Self::Force, Self::Position, Self::Velocity];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Force => "Force",
            Self::Position => "Position",
            Self::Velocity => "Velocity",
        }
    }

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Position => "mm",
            Self::Velocity => "mm/s",
        }
    }

    /// Smallest span of the axis: at rest, the encoder's noise must not fill the plot.
    pub(crate) const fn smallest_span(self) -> f64 {
        match self {
            Self::Force => 2.0,
            Self::Position => 1.0,
            Self::Velocity => 10.0,
        }
    }

    /// The signals on this axis, in the order of drawing.
    pub(crate) fn signals(self) -> impl Iterator<Item = Signal> {
        Signal::ALL.into_iter().filter(move |signal| signal.quantity() == self)
    }
}

/// How a signal is named, read from a sample and drawn.
#[derive(Debug)]
struct Descriptor {
    name: &'static str,
    quantity: Quantity,
    /// Value of a sample, in the unit of the quantity.
    value: fn(&Sample) -> f64,
    color: fn(&Palette) -> Color32,
    /// Width of the line, points.
    width: f32,
}

/// Width of a block's line, points. It is drawn first: where both agree, it frames the device's line.
const WIDE: f32 = 3.0;

/// Width of a device's line, points.
const NARROW: f32 = 1.4;

/// Every signal, in the order of drawing. A new signal is a new entry.
const DESCRIPTORS: [Descriptor; 6] = [
    Descriptor {
        name: "Coupling force",
        quantity: Quantity::Force,
        value: |sample| sample.coupling_force_n,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Force on the hand",
        quantity: Quantity::Force,
        value: |sample| sample.command_force_n,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Block position",
        quantity: Quantity::Position,
        value: |sample| sample.block_position_m * MM_PER_M,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Device position",
        quantity: Quantity::Position,
        value: |sample| sample.device_position_m * MM_PER_M,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Block velocity",
        quantity: Quantity::Velocity,
        value: |sample| sample.block_velocity_mps * MM_PER_M,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Device velocity",
        quantity: Quantity::Velocity,
        value: |sample| sample.device_velocity_mps * MM_PER_M,
        color: |palette| palette.device,
        width: NARROW,
    },
];

/// A signal: the index of its descriptor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Signal(usize);

impl Signal {
    pub(crate) const COUNT: usize = DESCRIPTORS.len();

    pub(crate) const ALL: [Self; Self::COUNT] = {
        let mut all = [Self(0); Self::COUNT];
        let mut index = 0;
        while index < Self::COUNT {
            all[index] = Self(index);
            index += 1;
        }
        all
    };

    pub(crate) const COUPLING_FORCE: Self = Self(0);
    pub(crate) const COMMAND_FORCE: Self = Self(1);
    pub(crate) const BLOCK_VELOCITY: Self = Self(4);

    const fn descriptor(self) -> &'static Descriptor {
        &DESCRIPTORS[self.0]
    }

    /// Index in [`Signal::ALL`].
    pub(crate) const fn index(self) -> usize {
        self.0
    }

    pub(crate) const fn name(self) -> &'static str {
        self.descriptor().name
    }

    pub(crate) const fn quantity(self) -> Quantity {
        self.descriptor().quantity
    }

    pub(crate) const fn color(self) -> fn(&Palette) -> Color32 {
        self.descriptor().color
    }

    /// Width of the line, points.
    pub(crate) const fn width(self) -> f32 {
        self.descriptor().width
    }

    /// Its value in the unit of its quantity, limited to what can be drawn.
    pub(crate) fn of(self, sample: &Sample) -> f64 {
        (self.descriptor().value)(sample).clamp(-DRAWABLE, DRAWABLE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_signals_are_those_of_the_list() {
        assert_eq!(Signal::COUPLING_FORCE.name(), "Coupling force");
        assert_eq!(Signal::BLOCK_VELOCITY.name(), "Block velocity");
        let shown: usize = Quantity::ALL.map(|quantity| quantity.signals().count()).iter().sum();
        assert_eq!(shown, Signal::COUNT, "every signal is on an axis");
    }
}

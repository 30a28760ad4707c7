//! The signals of a sample that plots, trigger and cursors offer: one list of descriptors.

use crate::theme::Palette;
use egui::Color32;
use haptic_ipc::Sample;

/// Positions are shown in mm and velocities in mm/s: a desktop rig moves by a few centimetres.
pub(crate) const MM_PER_M: f64 = 1e3;

/// The energy of a coupling is shown in mJ: at 4 N it is below 1 mJ.
const MJ_PER_J: f64 = 1e3;

const NS_PER_US: f64 = 1e3;

/// Largest magnitude that is drawn, in the unit of the quantity. A larger value is neither a force
/// nor a position of a rig, and exceeds the digits of the axes' arithmetic.
const DRAWABLE: f64 = 1e9;

/// What a signal measures, with its unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Force,
    Position,
    Velocity,
    Deflection,
    Energy,
    Acceleration,
    Power,
    Duration,
}

impl Quantity {
    pub(crate) const ALL: [Self; 8] = [
        Self::Force,
        Self::Position,
        Self::Velocity,
        Self::Deflection,
        Self::Energy,
        Self::Acceleration,
        Self::Power,
        Self::Duration,
    ];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Force => "Force",
            Self::Position => "Position",
            Self::Velocity => "Velocity",
            Self::Deflection => "Deflection",
            Self::Energy => "Energy",
            Self::Acceleration => "Acceleration",
            Self::Power => "Power",
            Self::Duration => "Duration",
        }
    }

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Position | Self::Deflection => "mm",
            Self::Velocity => "mm/s",
            Self::Energy => "mJ",
            Self::Acceleration => "m/s²",
            Self::Power => "W",
            Self::Duration => "µs",
        }
    }

    /// Smallest span of the axis: at rest, the encoder's noise must not fill the plot.
    pub(crate) const fn smallest_span(self) -> f64 {
        match self {
            Self::Force => 2.0,
            Self::Position | Self::Acceleration => 1.0,
            Self::Velocity | Self::Duration => 10.0,
            Self::Deflection | Self::Power => 0.01,
            Self::Energy => 0.1,
        }
    }

    /// The signals of this quantity, in the order of drawing.
    pub(crate) fn signals(self) -> impl Iterator<Item = Signal> {
        Signal::ALL.into_iter().filter(move |signal| signal.quantity() == self)
    }
}

/// How a signal is named, read from a sample and drawn.
#[derive(Debug)]
struct Descriptor {
    name: &'static str,
    /// How it is computed from a sample, for the hint of its name.
    definition: &'static str,
    quantity: Quantity,
    /// Value of a sample, given the sample before it, in the unit of the quantity. The first sample is
    /// given itself.
    value: fn(&Sample, &Sample) -> f64,
    color: fn(&Palette) -> Color32,
    /// Width of the line, points.
    width: f32,
}

/// Width of a block's line, points. It is drawn first: where both agree, it frames the device's line.
const WIDE: f32 = 3.0;

/// Width of a device's line, points.
const NARROW: f32 = 1.4;

/// Deflection of the coupling: device minus block, m.
fn deflection_m(sample: &Sample) -> f64 {
    sample.device_position_m - sample.block_position_m
}

/// The change of a velocity since the sample before over the time between both, m/s².
fn acceleration_mps2(before: &Sample, sample: &Sample, velocity: fn(&Sample) -> f64) -> f64 {
    let elapsed_s = sample.t_s - before.t_s;
    if elapsed_s > 0.0 {
        (velocity(sample) - velocity(before)) / elapsed_s
    } else {
        0.0
    }
}

/// A duration, us.
pub(crate) fn duration_us(ns: u64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "a duration below 2^53 ns is a hundred days")]
    let ns = ns as f64;
    ns / NS_PER_US
}

/// Every signal, in the order of drawing. A new signal is a new entry.
const DESCRIPTORS: [Descriptor; 15] = [
    Descriptor {
        name: "Coupling force",
        definition: "Force in the coupling, which drives the block",
        quantity: Quantity::Force,
        value: |_, sample| sample.coupling_force_n,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Force on the hand",
        definition: "Force commanded on the hand after ramps and limits",
        quantity: Quantity::Force,
        value: |_, sample| sample.command_force_n,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Block position",
        definition: "Position of the block",
        quantity: Quantity::Position,
        value: |_, sample| sample.block_position_m * MM_PER_M,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Device position",
        definition: "Position of the device",
        quantity: Quantity::Position,
        value: |_, sample| sample.device_position_m * MM_PER_M,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Block velocity",
        definition: "Velocity of the block",
        quantity: Quantity::Velocity,
        value: |_, sample| sample.block_velocity_mps * MM_PER_M,
        color: |palette| palette.block,
        width: WIDE,
    },
    Descriptor {
        name: "Device velocity",
        definition: "Velocity of the device as estimated",
        quantity: Quantity::Velocity,
        value: |_, sample| sample.device_velocity_mps * MM_PER_M,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Coupling deflection",
        definition: "Device position minus block position",
        quantity: Quantity::Deflection,
        value: |_, sample| deflection_m(sample) * MM_PER_M,
        color: |palette| palette.block,
        width: NARROW,
    },
    Descriptor {
        name: "Coupling energy",
        definition: "Half of coupling force times deflection: the energy of the coupling's spring, exact at rest or \
                     without damping",
        quantity: Quantity::Energy,
        value: |_, sample| 0.5 * sample.coupling_force_n * deflection_m(sample) * MJ_PER_J,
        color: |palette| palette.block,
        width: NARROW,
    },
    Descriptor {
        name: "Block acceleration",
        definition: "Change of block velocity since the sample before, over the time between both",
        quantity: Quantity::Acceleration,
        value: |before, sample| acceleration_mps2(before, sample, |sample| sample.block_velocity_mps),
        color: |palette| palette.block,
        width: NARROW,
    },
    Descriptor {
        name: "Device acceleration",
        definition: "Change of device velocity since the sample before, over the time between both",
        quantity: Quantity::Acceleration,
        value: |before, sample| acceleration_mps2(before, sample, |sample| sample.device_velocity_mps),
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Power to the block",
        definition: "Coupling force times block velocity: above zero the coupling drives the block",
        quantity: Quantity::Power,
        value: |_, sample| sample.coupling_force_n * sample.block_velocity_mps,
        color: |palette| palette.block,
        width: NARROW,
    },
    Descriptor {
        name: "Power to the hand",
        definition: "Force on the hand times device velocity: above zero the motor drives the hand",
        quantity: Quantity::Power,
        value: |_, sample| sample.command_force_n * sample.device_velocity_mps,
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Tick time",
        definition: "How long the tick took, the device's read and write included",
        quantity: Quantity::Duration,
        value: |_, sample| duration_us(sample.tick_ns),
        color: |palette| palette.block,
        width: NARROW,
    },
    Descriptor {
        name: "Round trip",
        definition: "How long the device's read and write took; 0 where the rig is in the daemon itself",
        quantity: Quantity::Duration,
        value: |_, sample| duration_us(sample.device_round_trip_ns),
        color: |palette| palette.device,
        width: NARROW,
    },
    Descriptor {
        name: "Wake-up latency",
        definition: "How long after its deadline the tick began",
        quantity: Quantity::Duration,
        value: |_, sample| duration_us(sample.wake_latency_ns),
        color: |palette| palette.law,
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
    pub(crate) const BLOCK_POSITION: Self = Self(2);
    pub(crate) const DEVICE_POSITION: Self = Self(3);
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

    /// How it is computed, for people.
    pub(crate) const fn definition(self) -> &'static str {
        self.descriptor().definition
    }

    /// Whether it has values: without a block, no signal of the block has any.
    pub(crate) fn is_there(self, has_block: bool) -> bool {
        has_block || !matches!(self.name(), "Block position" | "Block velocity" | "Block acceleration")
    }

    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|signal| signal.name() == name)
    }

    /// Its value in the unit of its quantity, limited to what can be drawn. `before` is the sample before;
    /// of the first sample, itself.
    pub(crate) fn of(self, before: &Sample, sample: &Sample) -> f64 {
        (self.descriptor().value)(before, sample).clamp(-DRAWABLE, DRAWABLE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Signs and units, on numbers that are exact in binary.
    #[test]
    fn signals_are_what_their_definitions_say() {
        let before = Sample {
            t_s: 1.0,
            device_velocity_mps: 0.5,
            block_velocity_mps: 0.25,
            ..Sample::default()
        };
        let sample = Sample {
            t_s: 1.25,
            device_position_m: 0.75,
            block_position_m: 0.5,
            device_velocity_mps: -0.5,
            block_velocity_mps: 1.25,
            coupling_force_n: 8.0,
            command_force_n: -8.0,
            tick_ns: 2500,
            device_round_trip_ns: 1500,
            wake_latency_ns: 500,
            ..Sample::default()
        };
        let values: [(&str, f64); Signal::COUNT] = [
            ("Coupling force", 8.0),
            ("Force on the hand", -8.0),
            ("Block position", 500.0),
            ("Device position", 750.0),
            ("Block velocity", 1250.0),
            ("Device velocity", -500.0),
            ("Coupling deflection", 250.0),
            ("Coupling energy", 1000.0),
            ("Block acceleration", 4.0),
            ("Device acceleration", -4.0),
            ("Power to the block", 10.0),
            ("Power to the hand", 4.0),
            ("Tick time", 2.5),
            ("Round trip", 1.5),
            ("Wake-up latency", 0.5),
        ];
        assert_eq!(
            Signal::ALL.map(|signal| (signal.name(), signal.of(&before, &sample))),
            values
        );
        let shown: usize = Quantity::ALL.map(|quantity| quantity.signals().count()).iter().sum();
        assert_eq!(shown, Signal::COUNT, "every signal is on an axis");
        let [position, velocity] = [Signal::BLOCK_POSITION, Signal::BLOCK_VELOCITY].map(Signal::name);
        assert_eq!([position, velocity], ["Block position", "Block velocity"]);
        let first = Signal::named("Block acceleration").expect("a signal");
        assert_eq!(first.of(&sample, &sample), 0.0, "nothing is before the first sample");
    }
}

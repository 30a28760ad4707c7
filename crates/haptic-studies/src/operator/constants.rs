//! What a simulated operator is like: every constant with its unit, its range and where it comes from.
//!
//! A source with `abstract` was looked up, and its abstract says what stands here. What could not be found is `not
//! confirmed`; what nobody else has said is `ours`.

/// A constant that can be set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: &'static str,
    /// Its usual value.
    pub usual: f64,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Where it comes from.
    pub source: &'static str,
}

/// Why a constant cannot be set.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConstantError {
    /// There is none of this name.
    #[error("`{name}` is not a constant of the operator; there are {known}")]
    Unknown {
        /// The name.
        name: String,
        /// Those that there are.
        known: String,
    },
    /// It is out of its range.
    #[error("{name} = {value} is out of range: {low} to {high}")]
    OutOfRange {
        /// The name.
        name: &'static str,
        /// The value.
        value: f64,
        /// Smallest permitted value.
        low: f64,
        /// Largest permitted value.
        high: f64,
    },
}

macro_rules! constants {
    ($($(#[doc = $doc:literal])+ $name:ident = $usual:literal in $low:literal..$high:literal, $source:literal;)+) => {
        /// What an operator is like. SI units, as the names say.
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Constants {
            $($(#[doc = $doc])+ pub $name: f64,)+
        }

        impl Default for Constants {
            fn default() -> Self {
                Self { $($name: $usual,)+ }
            }
        }

        impl Constants {
            /// All of them.
            pub const ALL: &[Constant] = &[$(Constant {
                name: stringify!($name),
                usual: $usual,
                low: $low,
                high: $high,
                source: $source,
            },)+];

            /// The value of a constant, by its name.
            #[must_use]
            pub fn get(&self, name: &str) -> Option<f64> {
                match name {
                    $(stringify!($name) => Some(self.$name),)+
                    _ => None,
                }
            }

            /// Sets a constant by its name.
            ///
            /// # Errors
            /// There is none of this name, or the value is out of its range.
            pub fn set(&mut self, name: &str, value: f64) -> Result<(), ConstantError> {
                let Some(constant) = Self::ALL.iter().find(|constant| constant.name == name) else {
                    let known: Vec<&str> = Self::ALL.iter().map(|constant| constant.name).collect();
                    return Err(ConstantError::Unknown { name: name.to_owned(), known: known.join(", ") });
                };
                let Constant { name, low, high, .. } = *constant;
                if !(low..=high).contains(&value) {
                    return Err(ConstantError::OutOfRange { name, value, low, high });
                }
                match name {
                    $(stringify!($name) => self.$name = value,)+
                    _ => {}
                }
                Ok(())
            }
        }
    };
}

constants! {
    /// Mass of the hand and the arm at the handle, kg.
    arm_mass_kg = 1.5 in 0.1..10.0, "ours; that a hand's inertia can be measured: Tsuji and others 1995; the range of 1 to 2 kg is not confirmed";
    /// Stiffness of the arm at the handle, N/m.
    arm_stiffness_n_per_m = 300.0 in 10.0..2000.0, "ours; measured in movements by Gomi and Kawato 1997 (abstract); the range of 100 to 800 N/m is not confirmed";
    /// Damping of the arm at the handle, N s/m.
    arm_damping_ns_per_m = 20.0 in 1.0..100.0, "ours; the range of 5 to 40 N s/m is not confirmed";
    /// Deviation of a movement's end for each m/s of its mean speed, s: 6 % of a movement of half a second.
    endpoint_noise_s = 0.03 in 0.0..0.3, "that the deviation grows in proportion to the mean speed: Meyer and others 1988 (abstract); the value is ours";
    /// Coefficient of variation of the muscles' force.
    force_noise = 0.02 in 0.0..0.3, "that noise grows with its signal: Harris and Wolpert 1998, as Guigon and others 2008 cite it (abstract); stronger muscles have a smaller share: Hamilton, Jones and Wolpert 2004 (abstract); the value is ours";
    /// Time over which that noise changes, s.
    force_noise_time_s = 0.04 in 0.002..1.0, "ours: a muscle's time constant";
    /// Time from something that is seen to a movement that follows from it, s.
    visual_delay_s = 0.15 in 0.01..1.0, "117 ms in direction, 130 to 200 ms in distance: Saunders and Knill 2005 (abstract)";
    /// Duration of the fastest movement, s.
    shortest_movement_s = 0.25 in 0.05..2.0, "ours";
    /// Duration of the slowest movement, s.
    longest_movement_s = 0.8 in 0.1..5.0, "ours";
    /// Corrections of a movement before a click that is not looked at.
    corrections = 2.0 in 0.0..10.0, "one, which is optional: Meyer and others 1988 (abstract); the second is ours";
    /// Share of a resistance that the operator has learned to overcome without feeling it first.
    learned_share = 0.8 in 0.0..1.0, "that a resistance is learned: Shadmehr and Mussa-Ivaldi 1994 (abstract); the value is ours";
    /// Deviation of the distance that is seen, m of the task.
    visual_noise_m = 0.001 in 0.0..0.1, "ours";
    /// Deviation of a sliding friction that is felt, as a share of it.
    sliding_noise = 0.07 in 0.0..1.0, "a constant force of 2.5 to 10 N is told apart by 7 %: Pang, Tan and Durlach 1991 (abstract)";
    /// Deviation of a breakaway force that is felt, as a share of it.
    breakaway_noise = 0.2 in 0.0..1.0, "ours: it lasts some milliseconds";
    /// Deviation between subjects, as a share of each constant of arm, noise and delay.
    person_spread = 0.1 in 0.0..0.3, "ours";
}

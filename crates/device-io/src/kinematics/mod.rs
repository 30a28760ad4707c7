//! How two motors move a hand in the plane, and which motor efforts give a force on the hand.
//!
//! The Jacobian is the exact derivative of the forward kinematics, from the same function, and the efforts are its
//! transpose times the force. Then the motors give the power of the force on the hand whatever the geometry: wrong
//! lengths or a wrong home distort a surface, and cannot make it drive the hand.
//!
//! Motor positions and efforts are m and N of linear motors, rad and N m of rotary ones. A force is the one on the
//! hand.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

mod dual;
mod file;
mod five_bar;
mod geometry;
mod jacobian;
mod workspace;

use geometry::{Geometry, Linear};
use haptic_core::planar::Plane;
pub use haptic_core::planar::Workspace;
pub use jacobian::Jacobian;
use std::fmt;
use std::str::FromStr;
use workspace::Survey;
pub use workspace::Worst;

/// The geometry of a rig, its workspace, and its home pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kinematics {
    geometry: Geometry,
    workspace: Option<Workspace>,
    survey: Survey,
    home: Option<[f64; 2]>,
}

/// A position of the hand, and how it moves with the motors there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the hand, m.
    pub position: Plane,
    /// Its derivatives.
    pub jacobian: Jacobian,
}

/// What the positions of the motors say about the hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// The hand's position.
    Position(Pose),
    /// The hand's position, where the motors do not hold it firmly in every direction: they get no effort.
    Singular(Pose),
    /// No position: the links cannot close.
    CannotClose,
}

impl Reading {
    /// The hand's position, not a number where there is none, and its derivatives where the motors may be driven.
    #[must_use]
    pub fn parts(self) -> (Plane, Option<Jacobian>) {
        match self {
            Self::Position(pose) => (pose.position, Some(pose.jacobian)),
            Self::Singular(pose) => (pose.position, None),
            Self::CannotClose => (Plane::new(f64::NAN, f64::NAN), None),
        }
    }

    /// The hand's position, also where the motors may not be driven.
    #[must_use]
    pub fn pose(self) -> Option<Pose> {
        match self {
            Self::Position(pose) | Self::Singular(pose) => Some(pose),
            Self::CannotClose => None,
        }
    }
}

/// Efforts that no motor's limit cuts: where one is beyond its limit, both shrink by one factor, so that the force on
/// the hand keeps its direction. Says whether they shrank.
#[must_use]
pub fn within_limits(efforts: [f64; 2], limits: [f64; 2]) -> ([f64; 2], bool) {
    let share = |motor: usize| limits[motor] / efforts[motor].abs();
    // Without effort the share is infinite, or not a number, and shrinks nothing.
    let least = 1.0_f64.min(share(0)).min(share(1));
    (efforts.map(|effort| effort * least), least < 1.0)
}

impl Kinematics {
    fn new(geometry: Geometry, workspace: Option<Workspace>, home: Option<[f64; 2]>) -> Result<Self, String> {
        let surveyed = workspace.unwrap_or(workspace::ORIGIN);
        if let Some(home) = home
            && !geometry.closes(home, surveyed.middle())
        {
            let [first, second] = home.map(f64::to_degrees);
            return Err(format!(
                "home_deg = [{first}, {second}] deg: the links do not close there with the elbows outside and the hand \
                 on the side of the workspace"
            ));
        }
        Ok(Self {
            survey: Survey::of(&geometry, &surveyed)?,
            geometry,
            workspace,
            home,
        })
    }

    /// Reads the text of a file.
    ///
    /// # Errors
    /// It is not such a file, a value is out of range, or the workspace has a place where the linkage does not close or
    /// is singular.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        file::read(text)
    }

    /// Whether the motors are rotary: positions in rad and efforts in N m, and otherwise in m and N.
    #[must_use]
    pub fn are_rotary(&self) -> bool {
        self.geometry.are_rotary()
    }

    /// Positions of the motors in the home pose; `None` where they are to be known from the counts themselves.
    #[must_use]
    pub fn home(&self) -> Option<[f64; 2]> {
        self.home
    }

    /// Where force may flow; `None` for everywhere.
    #[must_use]
    pub fn workspace(&self) -> Option<&Workspace> {
        self.workspace.as_ref()
    }

    /// The middle of the workspace, m; the origin without one.
    #[must_use]
    pub fn middle(&self) -> Plane {
        self.workspace().map_or(Plane::ZERO, Workspace::middle)
    }

    /// Whether force may flow at a position of the hand, m.
    #[must_use]
    pub fn inside(&self, position: Plane) -> bool {
        self.workspace.is_none_or(|workspace| workspace.contains(position))
    }

    /// The hand at two positions of the motors.
    #[must_use]
    pub fn reading(&self, motors: [f64; 2]) -> Reading {
        self.geometry.reading(motors)
    }

    /// Positions of the motors for a position of the hand, m; angles are from -pi to 2 pi. `None` out of reach.
    #[must_use]
    pub fn motors(&self, hand: Plane) -> Option<[f64; 2]> {
        self.geometry.motors(hand)
    }

    /// The force on the hand, N, that motors with these efforts, N or N m, give in every direction everywhere in the
    /// workspace, and where and in which direction it is no more: along that of a motor only that motor works. With the
    /// efforts of their Coulomb friction it is the least force that moves the hand.
    #[must_use]
    pub fn least_force(&self, efforts: [f64; 2]) -> Worst {
        let [first, second] = self.survey.by_motor(|motor, travel| efforts[motor] / travel);
        if second.value < first.value { second } else { first }
    }

    /// The same force alone, of motors with these limits.
    #[must_use]
    pub fn force_limit_n(&self, limits: [f64; 2]) -> f64 {
        self.least_force(limits).value
    }

    /// Largest distance between two positions of the hand, m, one count of a motor apart, anywhere in the workspace, by
    /// the distance of two counts of each motor, m or rad.
    #[must_use]
    pub fn coarsest_step(&self, counts: [f64; 2]) -> Worst {
        let [first, second] = self.survey.by_motor(|motor, travel| counts[motor] * travel);
        if second.value > first.value { second } else { first }
    }

    /// The lightest and the heaviest mass, kg, that inertias of the motors alone, kg or kg m^2, are to the hand in any
    /// direction anywhere in the workspace. It is reckoned on the whole grid, which takes milliseconds.
    #[must_use]
    pub fn masses_kg(&self, inertias: [f64; 2]) -> [Worst; 2] {
        workspace::masses_kg(&self.geometry, self.surveyed(), inertias)
    }

    /// Where the geometry is surveyed.
    fn surveyed(&self) -> &Workspace {
        self.workspace.as_ref().unwrap_or(&workspace::ORIGIN)
    }
}

impl FromStr for Kinematics {
    /// Why the choice cannot be used.
    type Err = String;

    /// `xy`, `h-belt`, or the path of a file.
    fn from_str(choice: &str) -> Result<Self, String> {
        let read = || match choice {
            "xy" => Self::new(Geometry::Linear(Linear::Xy), None, None),
            "h-belt" => Self::new(Geometry::Linear(Linear::HBelt), None, None),
            path => std::fs::read_to_string(path)
                .map_err(|error| format!("neither xy nor h-belt, and as a file it cannot be read: {error}"))
                .and_then(|text| Self::from_toml(&text)),
        };
        read().map_err(|problem| format!("kinematics {choice}: {problem}"))
    }
}

impl fmt::Display for Kinematics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.geometry {
            Geometry::Linear(Linear::Xy) => f.write_str("xy"),
            Geometry::Linear(Linear::HBelt) => f.write_str("h-belt"),
            Geometry::FiveBar(five_bar) => write!(
                f,
                "five-bar of {} and {} mm on a base of {} mm",
                five_bar.proximal_m * 1e3,
                five_bar.distal_m * 1e3,
                five_bar.base_m * 1e3
            ),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
mod wiring_tests;

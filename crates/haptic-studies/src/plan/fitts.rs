//! The plan of a targeting task.

use super::super::order::Order;
use super::Task;
use super::check::{PlanError, names, one_of, within};
use haptic_core::friction::{Friction, Viscous};
use haptic_core::{Directional, Scene};
use serde::{Deserialize, Serialize};

/// Largest ratio of the cursor's motion to the handle's.
const MAX_GAIN: f64 = 100.0;

/// A targeting task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FittsPlan {
    /// Always [`Task::Fitts`].
    pub task: Task,
    /// What people call it.
    pub name: String,
    /// Segments of practice.
    pub practice_segments: u32,
    /// Valid clicks of a segment.
    pub trials_per_segment: u32,
    /// Segments between two breaks.
    pub rest_every_segments: u32,
    /// Length of a break, s.
    pub rest_s: f64,
    /// The resistance that the study begins with.
    pub baseline: String,
    /// Order of the resistances after that.
    #[serde(default)]
    pub order: Order,
    /// The cursor.
    pub cursor: Cursor,
    /// How the handle moves the cursor.
    pub rig: RigMapping,
    /// Pairs of amplitude and width.
    pub conditions: Vec<Condition>,
    /// What the handle feels like.
    pub resistances: Vec<Resistance>,
}

/// The cursor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cursor {
    /// Its diameter, m of the task (>= 0).
    pub diameter_m: f64,
}

/// How the handle moves the cursor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RigMapping {
    /// Metres of the task for a metre of the handle (> 0).
    pub gain: f64,
    /// Position of the handle in the middle of the task, m.
    pub center_m: f64,
    /// Smallest and largest position that the handle reaches, m.
    pub range_m: [f64; 2],
}

impl RigMapping {
    /// Position in the task, m, of a position of the handle, m.
    #[must_use]
    pub fn task_m(&self, rig_m: f64) -> f64 {
        self.gain * (rig_m - self.center_m)
    }

    /// Position of the handle, m, for a position in the task, m.
    #[must_use]
    pub fn rig_m(&self, task_m: f64) -> f64 {
        self.center_m + task_m / self.gain
    }
}

/// A pair of amplitude and width.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Distance between the targets' centres, m of the task (> 0).
    pub amplitude_m: f64,
    /// Width of the targets, m of the task (> the cursor's diameter).
    pub width_m: f64,
}

/// What the handle feels like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resistance {
    /// Its name.
    pub name: String,
    /// The scene that the motor renders.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scene: Option<Scene>,
    /// A real block that a person mounts; the motor gives no force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mounted: Option<MountedBlock>,
}

impl Resistance {
    /// What the motor renders: without force where a real block is mounted.
    #[must_use]
    pub fn rendered(&self) -> Scene {
        let without_force = || Scene {
            name: String::new(),
            block: None,
            coupling: None,
            friction: Friction::Viscous(Viscous {
                viscous: Directional::both(0.0),
            }),
        };
        let scene = self.scene.clone().unwrap_or_else(without_force);
        Scene {
            name: self.name.clone(),
            ..scene
        }
    }
}

/// A real block on a real surface, mounted on the handle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MountedBlock {
    /// Mass of the block, kg (>= 0).
    pub mass_kg: f64,
    /// Force that sets it in motion, N (>= the dynamic force).
    #[serde(rename = "static_force_N")]
    pub static_force_n: f64,
    /// Friction of its motion, N (>= 0).
    #[serde(rename = "dynamic_force_N")]
    pub dynamic_force_n: f64,
}

impl FittsPlan {
    /// The resistances' names.
    #[must_use]
    pub fn resistance_names(&self) -> Vec<String> {
        self.resistances.iter().map(|one| one.name.clone()).collect()
    }

    /// Checks the values.
    ///
    /// # Errors
    /// One is out of range, a name stands twice, a scene cannot be rendered, or the handle does not reach a target.
    pub(super) fn check(&self) -> Result<(), PlanError> {
        within("practice_segments", f64::from(self.practice_segments), 0.0, 100.0, "")?;
        within("trials_per_segment", f64::from(self.trials_per_segment), 1.0, 100.0, "")?;
        within(
            "rest_every_segments",
            f64::from(self.rest_every_segments),
            1.0,
            1000.0,
            "",
        )?;
        within("rest_s", self.rest_s, 0.0, 3600.0, " s")?;
        names(
            "conditions",
            self.conditions.iter().map(|condition| condition.name.as_str()),
        )?;
        let known: Vec<&str> = self.resistances.iter().map(|one| one.name.as_str()).collect();
        names("resistances", known.iter().copied())?;
        if !known.contains(&self.baseline.as_str()) {
            return Err(PlanError(format!(
                "baseline = `{}` is not the name of a resistance; there are {}",
                self.baseline,
                known.join(", ")
            )));
        }
        within("rig.gain", self.rig.gain, 0.01, MAX_GAIN, "")?;
        let [low, high] = self.rig.range_m;
        within("rig.range_m[0]", low, -10.0, 10.0, " m")?;
        within("rig.range_m[1]", high, low, 10.0, " m")?;
        within("rig.center_m", self.rig.center_m, low, high, " m")?;
        let narrowest_m = self
            .conditions
            .iter()
            .map(|condition| condition.width_m)
            .fold(f64::INFINITY, f64::min);
        for condition in &self.conditions {
            check_condition(condition)?;
        }
        let whole_m = |condition: &Condition| condition.amplitude_m + condition.width_m;
        let widest = self.conditions.iter().max_by(|a, b| whole_m(a).total_cmp(&whole_m(b)));
        widest.map_or(Ok(()), |condition| self.check_reach(condition))?;
        // A cursor as wide as a target cannot be wholly inside; 1 mm is left to hit.
        within(
            "cursor.diameter_m",
            self.cursor.diameter_m,
            0.0,
            ((narrowest_m - 1e-3) * 1e6).round() / 1e6,
            " m",
        )?;
        self.resistances.iter().try_for_each(check_resistance)
    }

    /// Checks that the handle reaches every target of a condition.
    fn check_reach(&self, condition: &Condition) -> Result<(), PlanError> {
        let [low, high] = self.rig.range_m;
        let has_m = (self.rig.center_m - low).min(high - self.rig.center_m);
        let half_m = 0.5 * (condition.amplitude_m + condition.width_m);
        let needs_m = half_m / self.rig.gain;
        // A range that was computed from the targets is not too small by rounding.
        if needs_m > has_m + 1e-9 {
            // Infinite where the centre is an end of the range.
            let gain = (half_m / has_m * 1e3).ceil() / 1e3;
            let instead = if gain > MAX_GAIN {
                "move rig.center_m towards the middle of rig.range_m".to_owned()
            } else {
                format!("raise rig.gain to {gain} or more")
            };
            return Err(PlanError(format!(
                "conditions.{}: its targets take {} m of the handle to either side of rig.center_m, and rig.range_m \
                 leaves {has_m} m: {instead}",
                condition.name,
                (needs_m * 1e6).round() / 1e6
            )));
        }
        Ok(())
    }
}

fn check_condition(condition: &Condition) -> Result<(), PlanError> {
    let field = |name| format!("conditions.{}.{name}", condition.name);
    within(field("amplitude_m"), condition.amplitude_m, 1e-3, 10.0, " m")?;
    within(field("width_m"), condition.width_m, 1e-3, condition.amplitude_m, " m")?;
    Ok(())
}

fn check_resistance(resistance: &Resistance) -> Result<(), PlanError> {
    let place = format!("resistances.{}", resistance.name);
    match (&resistance.scene, resistance.mounted) {
        (Some(scene), None) => {
            let wrong = |error| PlanError(format!("{place}: {error}"));
            scene.validate().map_err(wrong)
        }
        (None, Some(mounted)) => {
            let field = |name| format!("{place}.mounted.{name}");
            within(field("mass_kg"), mounted.mass_kg, 0.0, 100.0, " kg")?;
            within(field("dynamic_force_N"), mounted.dynamic_force_n, 0.0, 1000.0, " N")?;
            let low = mounted.dynamic_force_n;
            within(field("static_force_N"), mounted.static_force_n, low, 1000.0, " N")
        }
        _ => Err(one_of(&place, "scene", "mounted")),
    }
}

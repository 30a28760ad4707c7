//! The file that describes a rig's geometry, in TOML.

use super::Kinematics;
use super::five_bar::FiveBar;
use super::geometry::{Geometry, Linear};
use haptic_core::BoundError;
use haptic_core::planar::Workspace;
use serde::Deserialize;

/// Lengths of links, m.
const LINK_M: (f64, f64) = (0.005, 1.0);
/// Farthest end of a workspace from the origin, m.
const FARTHEST_M: f64 = 1.0;
/// Shortest side of a workspace, m.
const MIN_SIDE_M: f64 = 0.002;
/// Largest angle of the home pose, degrees.
const HOME_DEG: f64 = 360.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    kinematics: KinematicsKind,
    base_m: Option<f64>,
    proximal_m: Option<f64>,
    distal_m: Option<f64>,
    home_deg: Option<[f64; 2]>,
    workspace_m: Option<WorkspaceSides>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum KinematicsKind {
    Xy,
    HBelt,
    FiveBar,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WorkspaceSides {
    x: [f64; 2],
    y: [f64; 2],
}

/// Reads the text of a file.
pub(super) fn read(text: &str) -> Result<Kinematics, String> {
    let file: File = toml::from_str(text).map_err(|error| error.to_string().trim_end().to_owned())?;
    let geometry = file.geometry()?;
    let workspace = file.workspace()?;
    if geometry.are_rotary() && workspace.is_none() {
        return Err(missing("workspace_m"));
    }
    Kinematics::new(geometry, workspace, file.home_deg.map(|home| home.map(f64::to_radians)))
}

impl File {
    fn geometry(&self) -> Result<Geometry, String> {
        let linear = match self.kinematics {
            KinematicsKind::Xy => Linear::Xy,
            KinematicsKind::HBelt => Linear::HBelt,
            KinematicsKind::FiveBar => {
                let base_m = within("base_m", self.base_m, 0.0, LINK_M.1)?;
                let proximal_m = within("proximal_m", self.proximal_m, LINK_M.0, LINK_M.1)?;
                let distal_m = within("distal_m", self.distal_m, LINK_M.0, LINK_M.1)?;
                for angle_deg in self.home_deg.into_iter().flatten() {
                    check("home_deg", angle_deg, -HOME_DEG, HOME_DEG, "deg")?;
                }
                return Ok(Geometry::FiveBar(FiveBar {
                    base_m,
                    proximal_m,
                    distal_m,
                }));
            }
        };
        let of_links = [
            ("base_m", self.base_m.is_some()),
            ("proximal_m", self.proximal_m.is_some()),
            ("distal_m", self.distal_m.is_some()),
            ("home_deg", self.home_deg.is_some()),
        ];
        match of_links.into_iter().find(|(_, is_there)| *is_there) {
            Some((field, _)) => Err(format!("`{field}` belongs to a five-bar")),
            None => Ok(Geometry::Linear(linear)),
        }
    }

    fn workspace(&self) -> Result<Option<Workspace>, String> {
        let Some(WorkspaceSides { x, y }) = self.workspace_m else {
            return Ok(None);
        };
        for (field, [low, high]) in [("workspace_m.x", x), ("workspace_m.y", y)] {
            for end in [low, high] {
                check(field, end, -FARTHEST_M, FARTHEST_M, "m")?;
            }
            if high - low < MIN_SIDE_M {
                return Err(format!(
                    "{field} = [{low}, {high}] m: the second end must be at least {MIN_SIDE_M} m beyond the first"
                ));
            }
        }
        Ok(Some(Workspace { x_m: x, y_m: y }))
    }
}

/// A field of a five-bar, which must be there and within its limits, m.
fn within(field: &'static str, value: Option<f64>, min: f64, max: f64) -> Result<f64, String> {
    let value = value.ok_or_else(|| missing(field))?;
    check(field, value, min, max, "m")?;
    Ok(value)
}

fn check(field: &'static str, value: f64, min: f64, max: f64, unit: &'static str) -> Result<(), String> {
    BoundError::check(field, value, min, max, unit).map_err(|error| error.to_string())
}

fn missing(field: &str) -> String {
    format!("`{field}` is missing: a five-bar needs it")
}

//! A file that describes a rig's kinematics.

use super::{FiveBar, Kinematics, Workspace};
use thiserror::Error;

/// Why a geometry cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum KinematicsError {
    /// A place of the workspace that the handle does not come to.
    #[error(
        "workspace_m: the handle cannot come to x {:.0} mm, y {:.0} mm: make the workspace smaller or mend the lengths",
        1e3 * x_m, 1e3 * y_m
    )]
    OutOfReach {
        /// m.
        x_m: f64,
        /// m.
        y_m: f64,
    },
    /// A place of the workspace where the motors hardly move the handle one way.
    #[error(
        "workspace_m: at x {:.0} mm, y {:.0} mm the linkage is too near a singularity: its smallest singular value is \
         {share:.2} of the larger of its largest one and the proximal link, at least 0.25 is needed: make the workspace \
         smaller",
        1e3 * x_m, 1e3 * y_m
    )]
    Singular {
        /// m.
        x_m: f64,
        /// m.
        y_m: f64,
        /// The smallest singular value, as a part of what it is compared with.
        share: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::super::tests::haply;
    use super::*;

    #[test]
    fn haplys_workspace_is_accepted_and_a_larger_one_is_not() {
        let workspace = Workspace {
            x_m: [-0.06, 0.06],
            y_m: [0.06, 0.13],
        };
        for base_m in [0.0, 0.038] {
            let reach = workspace.check(&Kinematics::FiveBar(haply(base_m))).expect("a workspace");
            let force_n = reach.force_n(1.0);
            assert!((10.0..20.0).contains(&force_n), "{force_n} N a N m");
        }
        let linkage = Kinematics::FiveBar(haply(0.038));
        let larger = Workspace {
            y_m: [0.01, 0.13],
            ..workspace
        };
        assert!(matches!(larger.check(&linkage), Err(KinematicsError::Singular { .. })));
        let farther = Workspace {
            y_m: [0.06, 0.2],
            ..workspace
        };
        assert!(matches!(farther.check(&linkage), Err(KinematicsError::OutOfReach { .. })));
        let _ = FiveBar { base_m: 0.0, proximal_m: 0.1, distal_m: 0.1 };
    }
}

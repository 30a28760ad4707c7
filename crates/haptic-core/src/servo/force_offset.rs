//! A step of force, taken back at once and let in slowly.

use crate::snapshot::Archive;

/// Time in which the step takes effect, s.
const FADE_S: f64 = 0.05;

/// A step of force that a new scene would have caused, taken back and then let in over 50 ms.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForceOffset {
    /// What was taken back when the fade began, N.
    force: f64,
    left_s: f64,
}

impl ForceOffset {
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("step_N", &mut self.force);
        archive.number("left_s", &mut self.left_s);
    }

    /// Takes back a step, N; what is left of the last one is taken back with it.
    pub(super) fn add(&mut self, step: f64) {
        if step != 0.0 {
            self.force = self.now() + step;
            self.left_s = FADE_S;
        }
    }

    fn now(&self) -> f64 {
        self.force * (self.left_s / FADE_S)
    }

    /// What is taken back after a time, N.
    pub(super) fn fade(&mut self, elapsed_s: f64) -> f64 {
        if self.left_s <= 0.0 {
            return 0.0;
        }
        self.left_s = (self.left_s - elapsed_s).max(0.0);
        self.now()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_offset_fades_evenly_and_later_steps_add_up() {
        let mut offset = ForceOffset::default();
        assert_eq!(offset.fade(0.01), 0.0, "nothing was taken back");
        offset.add(2.0);
        assert!((offset.fade(0.025) - 1.0).abs() < 1e-12);
        offset.add(0.0);
        assert!((offset.fade(0.0125) - 0.5).abs() < 1e-12, "no step changes nothing");
        offset.add(-1.5);
        assert!((offset.fade(0.0) + 1.0).abs() < 1e-12);
        assert_eq!([offset.fade(0.06), offset.fade(0.01)], [0.0, 0.0]);
    }
}

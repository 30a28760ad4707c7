//! What would have been felt along a recording's motion.

use crate::tape::Tape;
use haptic_core::scene::SceneFile;
use haptic_lab::replay::{Alternative, Summary, WhatIf};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Entries after which a rendering looks whether it is still wanted: a few milliseconds.
const ENTRIES_A_LOOK: usize = 1000;

/// Another scene, rendered along a recording's motion.
#[derive(Clone, Debug, PartialEq)]
pub struct WhatIfTape {
    pub(crate) tape: Tape,
    /// `None` for those of the recording.
    pub(crate) scene: Option<String>,
    pub(crate) summary: Summary,
}

impl WhatIfTape {
    /// Renders a scene, or those of the recording, along the motion of a recording's file, until `is_over`.
    ///
    /// # Errors
    /// Why it cannot be read or rendered, with the name of the file.
    pub fn render(path: &Path, scene: Option<SceneFile>, is_over: &AtomicBool) -> Result<Self, String> {
        let failed = |error: &dyn std::fmt::Display| format!("what if along {}: {error}", path.display());
        let mut reader = haptic_recording::open_any(path).map_err(|error| failed(&error))?;
        let name = scene.as_ref().map(|scene| scene.name.clone());
        let alternative = Alternative {
            scene,
            ..Alternative::default()
        };
        let metadata = reader.metadata().clone();
        let mut what_if = WhatIf::new(&metadata, alternative).map_err(|error| failed(&error))?;
        let mut tape = Tape::default();
        for (count, entry) in reader.by_ref().enumerate() {
            if count.is_multiple_of(ENTRIES_A_LOOK) && is_over.load(Ordering::Acquire) {
                return Err("the rendering was given up".to_owned());
            }
            let entry = entry.map_err(|error| failed(&error))?;
            let felt = what_if.entry(&entry).map_err(|error| failed(&error))?;
            if let Some(row) = felt.and_then(|felt| felt.what_if) {
                tape.push_tick(row.sample, row.y.as_ref());
            }
        }
        Ok(Self {
            tape,
            scene: name,
            summary: what_if.summary(),
        })
    }

    pub(crate) fn line(&self) -> String {
        let Summary { recorded, what_if, .. } = &self.summary;
        let Some(scene) = &self.scene else {
            return self.line_of_replay();
        };
        format!(
            "The hand does not react to the other force. What if {scene}: {:.2} N rms instead of {:.2} N, {:.2} N peak \
             instead of {:.2} N, {} breakaways instead of {}",
            what_if.rms_force_n(),
            recorded.rms_force_n(),
            what_if.peak_force_n,
            recorded.peak_force_n,
            what_if.breakaways,
            recorded.breakaways,
        )
    }

    /// How the force that was computed again differs from that in the file.
    fn line_of_replay(&self) -> String {
        let Summary {
            ticks,
            not_computed,
            largest_difference,
            ..
        } = &self.summary;
        let differs = largest_difference.as_ref().map_or_else(
            || "the force differs nowhere".to_owned(),
            |largest| {
                format!(
                    "the force differs by up to {:.3} N, at {:.3} s",
                    largest.size_n(),
                    largest.t_s
                )
            },
        );
        let mut text = format!("Replay of {ticks} ticks: {differs}");
        if *not_computed > 0 {
            text += &format!("; nothing follows from {not_computed} of them");
        }
        text
    }
}

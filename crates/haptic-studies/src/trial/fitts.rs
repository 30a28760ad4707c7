//! A trial of the targeting task.

use super::row::{Column, Operator, OutOfRange, Trial, check, first_session, length, named, not_negative};
use serde::{Deserialize, Serialize};

/// A valid click of the Fitts task, and the invalid ones before it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FittsTrial {
    /// Who did it; a file from elsewhere need not say so.
    pub operator: Option<Operator>,
    /// Code of the subject.
    pub subject: String,
    /// Session of the subject, from 1.
    #[serde(default = "first_session")]
    pub session: u32,
    /// Segment of the subject's study, from 1.
    pub block: u32,
    /// Name of the resistance.
    pub resistance: String,
    /// Name of the condition: a pair of amplitude and width.
    pub condition: String,
    /// Trial of the segment, from 1.
    pub trial: u32,
    /// Direction of the movement along the rig's axis, +1 or -1.
    pub direction: Option<i8>,
    /// Distance between the targets' centres, m (> 0, at most 10).
    pub amplitude_m: f64,
    /// Width of the target, m (> 0, at most 10).
    pub width_m: f64,
    /// Diameter of the cursor, m (>= 0, below the width).
    pub cursor_diameter_m: Option<f64>,
    /// Cursor's centre at the valid click, from the target's centre, m (-10 to 10): positive is overshoot, whichever
    /// way the movement went.
    pub end_error_m: f64,
    /// From the valid click before to this one, s (> 0, at most 150: the longest trial is 120 s).
    pub movement_time_s: f64,
    /// Invalid clicks before the valid one.
    pub errors: u32,
    /// Sizes of the invalid clicks added up, m (>= 0): each is how far the cursor's edge was outside the target's.
    pub error_size_m: Option<f64>,
    /// Tick at which the target became active.
    pub start_tick: Option<u64>,
    /// Tick of the valid click.
    pub end_tick: Option<u64>,
    /// Revision of the scene that was rendered.
    pub scene_revision: Option<u64>,
    /// Attempts at this trial that were voided before it.
    #[serde(default)]
    pub voided: u32,
    /// From the sample on the device to the end of the frame that shows it, s: the median of the trial's frames. A
    /// simulated operator has no screen.
    pub cursor_latency_s: Option<f64>,
    /// The same of the slowest twentieth of the frames: the 95th percentile, s.
    pub cursor_latency_p95_s: Option<f64>,
    /// Frames a second of the subject's screen, by the median time between two of the trial.
    pub frame_rate_hz: Option<f64>,
    /// Recording of the trial, a path from the study's folder.
    pub recording: Option<String>,
}

impl Trial for FittsTrial {
    const COLUMNS: &'static [Column] = &[
        Column::optional("operator"),
        Column::required("subject"),
        Column::optional("session"),
        Column::required("block"),
        Column::required("resistance"),
        Column::required("condition"),
        Column::required("trial"),
        Column::optional("direction"),
        Column::required("amplitude_m"),
        Column::required("width_m"),
        Column::optional("cursor_diameter_m"),
        Column::required("end_error_m"),
        Column::required("movement_time_s"),
        Column::required("errors"),
        Column::optional("error_size_m"),
        Column::optional("start_tick"),
        Column::optional("end_tick"),
        Column::optional("scene_revision"),
        Column::optional("voided"),
        Column::optional("cursor_latency_s"),
        Column::optional("cursor_latency_p95_s"),
        Column::optional("frame_rate_hz"),
        Column::optional("recording"),
    ];

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        named("resistance", &self.resistance)?;
        named("condition", &self.condition)?;
        length("amplitude_m", self.amplitude_m)?;
        length("width_m", self.width_m)?;
        let (time_s, error_m) = (self.movement_time_s, self.end_error_m);
        let (is_time, limit) = (
            time_s > 0.0 && time_s <= 150.0,
            "it must be above 0 s, and at most 150 s",
        );
        check(is_time, "movement_time_s", time_s, " s", limit)?;
        let is_error = error_m.abs() <= 10.0;
        check(is_error, "end_error_m", error_m, " m", "it must be -10 m to 10 m")?;
        if let Some(direction) = self.direction {
            check(direction.abs() == 1, "direction", direction, "", "it must be 1 or -1")?;
        }
        if let Some(diameter) = self.cursor_diameter_m {
            let (column, limit) = ("cursor_diameter_m", "it must be below width_m");
            not_negative(column, diameter, " m")?;
            check(diameter < self.width_m, column, diameter, " m", limit)?;
        }
        for (column, value, unit) in [
            ("error_size_m", self.error_size_m, " m"),
            ("cursor_latency_s", self.cursor_latency_s, " s"),
            ("cursor_latency_p95_s", self.cursor_latency_p95_s, " s"),
            ("frame_rate_hz", self.frame_rate_hz, " Hz"),
        ] {
            value.map_or(Ok(()), |value| not_negative(column, value, unit))?;
        }
        Ok(())
    }
}

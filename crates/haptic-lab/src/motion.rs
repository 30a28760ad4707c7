//! A device's motion, from a file in any of the formats of [`haptic_motion`].

use haptic_core::velocity::AlphaBetaGamma;
pub use haptic_motion::MotionError;
use haptic_motion::table::TableOptions;
use haptic_motion::{Row, Rows, median};
use std::path::Path;

/// One sample of the device.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceSample {
    /// Time, s.
    pub t_s: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_mps: f64,
}

/// A total over a motion as a number a tick.
#[must_use]
pub fn per_tick(total: u64, motion: &[DeviceSample]) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    let (total, ticks) = (total as f64, (motion.len() - 1) as f64);
    total / ticks
}

/// Samples read at a time: memory does not grow with the motion.
const STRETCH: usize = 10_000;

/// A motion file, read one stretch after another.
///
/// Without velocities they are estimated from the positions, as the daemon does.
#[expect(missing_debug_implementations, reason = "the file's reader has none")]
pub struct MotionReader {
    rows: Rows,
    /// What comes next, as the first stretch is read at once.
    stretch: Vec<DeviceSample>,
    period_s: f64,
    /// Where the file has no velocities.
    estimator: Option<AlphaBetaGamma>,
    /// The last sample that the estimator took.
    last_s: Option<f64>,
}

impl MotionReader {
    /// Opens a file and reads its first stretch. `table` says how a table of another program is read.
    ///
    /// # Errors
    /// The file is not a motion; the error names the line or row.
    pub fn open(path: &Path, table: &TableOptions) -> Result<Self, MotionError> {
        let mut rows = Rows::open_with(path, table)?;
        let stretch = read_stretch(&mut rows)?;
        if stretch.is_empty() {
            return Err(MotionError::Empty {
                path: path.to_path_buf(),
            });
        }
        let period_s = median_period_s(&stretch);
        let mut motion = Self {
            estimator: (!rows.has_velocity()).then(|| AlphaBetaGamma::new(period_s)),
            rows,
            stretch: Vec::new(),
            period_s,
            last_s: None,
        };
        motion.stretch = motion.with_velocities(stretch);
        Ok(motion)
    }

    /// The median time between the samples of the first stretch, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// What was read of a table of another program, and what was left out.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        self.rows.notes()
    }

    /// The first sample of the stretch that comes next.
    #[must_use]
    pub fn first(&self) -> DeviceSample {
        self.stretch.first().copied().unwrap_or_default()
    }

    /// The next stretch; an empty one at the end.
    ///
    /// # Errors
    /// A row is not one of a motion; the error names it.
    pub fn next_stretch(&mut self) -> Result<Vec<DeviceSample>, MotionError> {
        if !self.stretch.is_empty() {
            return Ok(std::mem::take(&mut self.stretch));
        }
        let stretch = read_stretch(&mut self.rows)?;
        Ok(self.with_velocities(stretch))
    }

    fn with_velocities(&mut self, mut samples: Vec<DeviceSample>) -> Vec<DeviceSample> {
        if let Some(estimator) = &mut self.estimator {
            for sample in &mut samples {
                let last_s = self.last_s.unwrap_or(sample.t_s);
                sample.velocity_mps = estimator.update(sample.t_s - last_s, sample.position_m);
                self.last_s = Some(sample.t_s);
            }
        }
        samples
    }
}

fn read_stretch(rows: &mut Rows) -> Result<Vec<DeviceSample>, MotionError> {
    let sample = |row: Row| DeviceSample {
        t_s: row.t_s,
        position_m: row.position_m,
        velocity_mps: row.velocity_mps.unwrap_or_default(),
    };
    rows.take(STRETCH).map(|row| row.map(sample)).collect()
}

/// Reads a motion and keeps nothing of it.
///
/// # Errors
/// As those of [`MotionReader`].
pub fn check(path: &Path, table: &TableOptions) -> Result<(), MotionError> {
    let mut motion = MotionReader::open(path, table)?;
    while !motion.next_stretch()?.is_empty() {}
    Ok(())
}

/// Reads the whole of a motion.
///
/// # Errors
/// As those of [`MotionReader`].
pub fn read(path: &Path) -> Result<Vec<DeviceSample>, MotionError> {
    let mut motion = MotionReader::open(path, &TableOptions::default())?;
    let mut samples = Vec::new();
    loop {
        let stretch = motion.next_stretch()?;
        if stretch.is_empty() {
            return Ok(samples);
        }
        samples.extend(stretch);
    }
}

/// The median time between samples, s; 1 ms where there is none.
#[must_use]
pub fn median_period_s(motion: &[DeviceSample]) -> f64 {
    median::median_period_s(motion.iter().map(|sample| sample.t_s))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<Vec<DeviceSample>, MotionError> {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("motion.csv");
        std::fs::write(&path, text).expect("written");
        read(&path)
    }

    #[test]
    fn columns_are_found_by_name_and_velocity_is_estimated() {
        let samples = read_text("x,device_velocity_mps,t_s,device_position_m\n9,0.5,1,2\n").expect("a motion");
        assert_eq!(
            samples,
            [DeviceSample {
                t_s: 1.0,
                position_m: 2.0,
                velocity_mps: 0.5
            }]
        );
        let rows: String = (0..100)
            .map(|k| format!("{},{}\n", f64::from(k) * 1e-3, f64::from(k) * 2e-4))
            .collect();
        let samples = read_text(&format!("t_s,device_position_m\n{rows}")).expect("a motion");
        assert!((samples[99].velocity_mps - 0.2).abs() < 1e-6, "{:?}", samples[99]);
    }

    #[test]
    fn a_motion_of_several_stretches_is_that_of_one_file() {
        let count = 2 * STRETCH + 5;
        let rows: String = (0..count)
            .map(|k| format!("{},{}\n", k as f64 * 1e-3, (k as f64 * 1e-3).sin()))
            .collect();
        let text = format!("t_s,device_position_m\n{rows}");
        let samples = read_text(&text).expect("a motion");
        assert_eq!(samples.len(), count);
        // Estimated by one tracker from the first sample to the last.
        let mut estimator = AlphaBetaGamma::new(median_period_s(&samples[..STRETCH]));
        let mut last_s = 0.0;
        for sample in &samples {
            assert_eq!(
                sample.velocity_mps.to_bits(),
                estimator.update(sample.t_s - last_s, sample.position_m).to_bits()
            );
            last_s = sample.t_s;
        }
        // Time must grow from one stretch of a recording to the next as well.
        for velocity in [",0.5", ""] {
            let rows: String = (0..=STRETCH)
                .map(|k| format!("{},1{velocity}\n", if k == STRETCH { 0.5 } else { k as f64 }))
                .collect();
            let column = if velocity.is_empty() {
                ""
            } else {
                ",device_velocity_mps"
            };
            let text = format!("# hapticd recording 1\nt_s,device_position_m{column}\n{rows}");
            let message = read_text(&text).map(|_| ()).expect_err("time goes back").to_string();
            assert!(message.contains(&format!("line {}", STRETCH + 3)), "{message}");
        }
    }
}

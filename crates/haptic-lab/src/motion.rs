//! A device's motion, from a file in any of the formats of [`haptic_motion`].

use haptic_core::Vector;
use haptic_core::planar::Plane;
use haptic_core::velocity::AlphaBetaGamma;
pub use haptic_motion::MotionError;
use haptic_motion::table::TableOptions;
use haptic_motion::{MotionRow, Rows, median};
use std::path::Path;

/// One sample of the device, on a line or in the plane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DeviceSample<V = f64> {
    /// Time, s.
    pub t_s: f64,
    /// Position, m.
    pub position_m: V,
    /// Velocity, m/s.
    pub velocity_mps: V,
}

/// A total over a motion as a number a tick.
#[must_use]
pub fn per_tick<V>(total: u64, motion: &[DeviceSample<V>]) -> f64 {
    total as f64 / (motion.len() - 1) as f64
}

/// Samples read at a time: memory does not grow with the motion.
const STRETCH: usize = 10_000;

/// A motion file of one axis or two.
pub enum MotionFile {
    /// On a line.
    Line(MotionReader),
    /// In the plane.
    Plane(MotionReader<Plane>),
}

impl MotionFile {
    /// Opens a file and reads its first stretch. `table` says how a table of another program is read.
    ///
    /// # Errors
    /// The file is not a motion; the error names the line or row.
    pub fn open(path: &Path, table: &TableOptions) -> Result<Self, MotionError> {
        let rows = Rows::open_any(path, table)?;
        Ok(if rows.has_second_axis() {
            Self::Plane(MotionReader::new(path, rows)?)
        } else {
            Self::Line(MotionReader::new(path, rows)?)
        })
    }
}

/// A motion file, read one stretch after another.
///
/// Without velocities they are estimated from the positions, as the daemon does.
pub struct MotionReader<V = f64> {
    rows: Rows,
    /// What comes next, as the first stretch is read at once.
    stretch: Vec<DeviceSample<V>>,
    period_s: f64,
    /// One for each axis, where the file has no velocities.
    estimators: [Option<AlphaBetaGamma>; 2],
    /// The last sample that the estimators took.
    last_s: Option<f64>,
}

impl<V: Vector> MotionReader<V> {
    fn new(path: &Path, mut rows: Rows) -> Result<Self, MotionError> {
        let stretch = read_stretch(&mut rows)?;
        let Some(first) = stretch.first() else {
            return Err(MotionError::new(path, "the file has no sample"));
        };
        let period_s = median::median_period_s(stretch.iter().map(|row| row.t_s));
        let has_velocity = [first.velocity_mps, first.velocity_y_mps].map(|velocity| velocity.is_some());
        let mut motion = Self {
            rows,
            stretch: Vec::new(),
            period_s,
            estimators: has_velocity.map(|has| (!has).then(|| AlphaBetaGamma::new(period_s))),
            last_s: None,
        };
        motion.stretch = motion.samples(&stretch);
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
    pub fn first(&self) -> DeviceSample<V> {
        self.stretch.first().copied().unwrap_or_default()
    }

    /// The next stretch; an empty one at the end.
    ///
    /// # Errors
    /// A row is not one of a motion; the error names it.
    pub fn next_stretch(&mut self) -> Result<Vec<DeviceSample<V>>, MotionError> {
        if !self.stretch.is_empty() {
            return Ok(std::mem::take(&mut self.stretch));
        }
        let stretch = read_stretch(&mut self.rows)?;
        Ok(self.samples(&stretch))
    }

    fn samples(&mut self, rows: &[MotionRow]) -> Vec<DeviceSample<V>> {
        let sample = |row: &MotionRow| {
            let elapsed_s = row.t_s - self.last_s.replace(row.t_s).unwrap_or(row.t_s);
            let read = [
                (row.position_m, row.velocity_mps),
                (row.position_y_m.unwrap_or_default(), row.velocity_y_mps),
            ];
            let mut sample = DeviceSample {
                t_s: row.t_s,
                position_m: V::ZERO,
                velocity_mps: V::ZERO,
            };
            let parts = sample.position_m.parts().zip(sample.velocity_mps.parts());
            for (((position, velocity), read), estimator) in parts.zip(read).zip(&mut self.estimators) {
                *position = read.0;
                *velocity = match estimator {
                    Some(estimator) => estimator.update(elapsed_s, read.0),
                    None => read.1.unwrap_or_default(),
                };
            }
            sample
        };
        rows.iter().map(sample).collect()
    }
}

fn read_stretch(rows: &mut Rows) -> Result<Vec<MotionRow>, MotionError> {
    rows.take(STRETCH).collect()
}

/// Reads a motion and keeps nothing of it.
///
/// # Errors
/// As those of [`MotionFile::open`].
pub fn check(path: &Path, table: &TableOptions) -> Result<(), MotionError> {
    fn rest<V: Vector>(mut motion: MotionReader<V>) -> Result<(), MotionError> {
        while !motion.next_stretch()?.is_empty() {}
        Ok(())
    }
    match MotionFile::open(path, table)? {
        MotionFile::Line(motion) => rest(motion),
        MotionFile::Plane(motion) => rest(motion),
    }
}

/// Reads the whole of a motion of one axis.
///
/// # Errors
/// As those of [`MotionFile::open`]; it is one in the plane.
pub fn read(path: &Path) -> Result<Vec<DeviceSample>, MotionError> {
    let mut motion = MotionReader::<f64>::new(path, Rows::open(path)?)?;
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
pub fn median_period_s<V>(motion: &[DeviceSample<V>]) -> f64 {
    median::median_period_s(motion.iter().map(|sample| sample.t_s))
}

/// Where each of some times, each later than the one before, lies among at least two samples at `t_s`: the sample before
/// it, and the share of the interval to the next one. A time beyond the ends has the place of the nearest end.
pub(crate) fn places(t_s: &[f64], times: impl Iterator<Item = f64>) -> impl Iterator<Item = (usize, f64)> {
    let mut left = 0;
    times.map(move |at| {
        while left + 2 < t_s.len() && t_s[left + 1] <= at {
            left += 1;
        }
        let share = (at - t_s[left]) / (t_s[left + 1] - t_s[left]);
        (left, share.clamp(0.0, 1.0))
    })
}

/// The value at a place between a sample and the next one.
pub(crate) fn between(values: &[f64], (left, share): (usize, f64)) -> f64 {
    values[left] + share * (values[left + 1] - values[left])
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

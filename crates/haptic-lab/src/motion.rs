//! A device's motion, from a CSV file.

use haptic_core::velocity::AlphaBetaGamma;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// One sample of the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceSample {
    /// Time, s.
    pub t_s: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_mps: f64,
}

/// Largest time (s), position (m) or velocity (m/s) taken: beyond it the products that forces are
/// made of leave the range of numbers.
const LARGEST: f64 = 1e12;

/// Why a motion file cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened, or is no CSV.
    #[error("{}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What went wrong.
        source: csv::Error,
    },
    /// A column is missing.
    #[error("{}: there is no column `{column}`; a motion has t_s, device_position_m and, if it was measured, device_velocity_mps; this one has `{header}`", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The header found.
        header: String,
    },
    /// A cell is not a number that can be worked with.
    #[error("{}, line {line}: {column} = `{value}` is not a number from -{LARGEST:e} to {LARGEST:e}", .path.display())]
    NotANumber {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// The cell.
        value: String,
    },
    /// Time does not grow.
    #[error("{}, line {line}: t_s = {t_s} s does not come after {before} s in the line before", .path.display())]
    TimeNotIncreasing {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// Time in that line, s.
        t_s: f64,
        /// Time in the line before, s.
        before: f64,
    },
    /// There is no sample.
    #[error("{}: there is no sample below the header", .path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
}

/// Reads a motion with the columns `t_s` and `device_position_m`, and `device_velocity_mps` where
/// it is there; others are ignored. Without velocities they are estimated from the positions, as
/// the daemon does. Times may be irregular, but must grow.
///
/// # Errors
/// The file is not such a file; the error names the line.
pub fn read(path: &Path) -> Result<Vec<DeviceSample>, MotionError> {
    let failed = |source| MotionError::Read {
        path: path.to_path_buf(),
        source,
    };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(failed)?;
    let header = reader.headers().map_err(failed)?.clone();
    let find = |column: &str| header.iter().position(|name| name == column);
    let required = |column: &'static str| {
        find(column).ok_or_else(|| MotionError::MissingColumn {
            path: path.to_path_buf(),
            column,
            header: header.iter().collect::<Vec<_>>().join(","),
        })
    };
    let (time_column, position_column) = (required("t_s")?, required("device_position_m")?);
    let velocity_column = find("device_velocity_mps");
    let mut samples: Vec<DeviceSample> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(failed)?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |index: usize, column| {
            let text = record.get(index).unwrap_or_default();
            text.parse::<f64>()
                .ok()
                .filter(|value| value.abs() <= LARGEST)
                .ok_or_else(|| MotionError::NotANumber {
                    path: path.to_path_buf(),
                    line,
                    column,
                    value: text.to_owned(),
                })
        };
        let t_s = number(time_column, "t_s")?;
        let position_m = number(position_column, "device_position_m")?;
        let before = samples.last().map(|sample| sample.t_s);
        if let Some(before) = before.filter(|&before| t_s <= before) {
            return Err(MotionError::TimeNotIncreasing {
                path: path.to_path_buf(),
                line,
                t_s,
                before,
            });
        }
        let velocity_mps = match velocity_column {
            Some(index) => number(index, "device_velocity_mps")?,
            None => 0.0,
        };
        samples.push(DeviceSample {
            t_s,
            position_m,
            velocity_mps,
        });
    }
    if samples.is_empty() {
        return Err(MotionError::Empty {
            path: path.to_path_buf(),
        });
    }
    if velocity_column.is_none() {
        estimate_velocities(&mut samples);
    }
    Ok(samples)
}

fn estimate_velocities(samples: &mut [DeviceSample]) {
    let mut estimator = AlphaBetaGamma::new(usual_period_s(samples));
    let mut last_s = samples[0].t_s;
    for sample in samples {
        sample.velocity_mps = estimator.update(sample.t_s - last_s, sample.position_m);
        last_s = sample.t_s;
    }
}

/// The median time between samples, s; 1 ms where there is none.
#[must_use]
pub fn usual_period_s(motion: &[DeviceSample]) -> f64 {
    let mut periods: Vec<f64> = motion.windows(2).map(|pair| pair[1].t_s - pair[0].t_s).collect();
    periods.sort_unstable_by(f64::total_cmp);
    periods.get(periods.len() / 2).copied().unwrap_or(1e-3)
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
    fn columns_are_found_by_name_and_velocities_estimated_where_absent() {
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
    fn a_bad_file_is_refused_by_its_line() {
        for (text, parts) in [
            ("t_s,position_m\n0,0\n", vec!["device_position_m", "t_s,position_m"]),
            (
                "t_s,device_position_m\n0,0\n1,one\n",
                vec!["line 3", "device_position_m", "one"],
            ),
            (
                "t_s,device_position_m,device_velocity_mps\n0,0,inf\n",
                vec!["line 2", "device_velocity_mps", "inf"],
            ),
            ("t_s,device_position_m\n0,0\n0,1\n", vec!["line 3", "t_s = 0 s"]),
            ("t_s,device_position_m\n", vec!["no sample"]),
        ] {
            let message = read_text(text).expect_err(text).to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
    }
}

//! A device's motion, from a CSV file.

use haptic_core::velocity::AlphaBetaGamma;
use std::fs::File;
use std::path::{Path, PathBuf};
use thiserror::Error;

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
    /// A column is there twice.
    #[error("{}: there are {count} columns `{column}`, and which one is meant cannot be said", .path.display())]
    DoubledColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// How often it is there.
        count: usize,
    },
    /// A row ends before a column.
    #[error("{}, line {line}: the row has {cells} of {columns} cells, and none for {missing}", .path.display())]
    ShortRow {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
        /// The columns without a cell.
        missing: String,
    },
    /// A row goes on after the last column.
    #[error("{}, line {line}: the row has {cells} cells, and the header {columns} columns", .path.display())]
    LongRow {
        /// The file.
        path: PathBuf,
        /// Line in the file, from 1.
        line: u64,
        /// Cells in the row.
        cells: usize,
        /// Columns in the header.
        columns: usize,
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

/// Samples read at a time: memory does not grow with the motion.
const STRETCH: usize = 10_000;

/// A motion file, read one stretch after another.
///
/// It has the columns `t_s` and `device_position_m`, and `device_velocity_mps` where it is there;
/// others are ignored. Without velocities they are estimated from the positions, as the daemon does.
/// Times may be irregular, but must grow.
#[expect(missing_debug_implementations, reason = "csv's iterator has none")]
pub struct MotionReader {
    path: PathBuf,
    rows: csv::StringRecordsIntoIter<File>,
    header: csv::StringRecord,
    time_column: usize,
    position_column: usize,
    velocity_column: Option<usize>,
    /// What comes next, as the first stretch is read at once.
    stretch: Vec<DeviceSample>,
    last_s: Option<f64>,
    period_s: f64,
    estimator: Option<AlphaBetaGamma>,
}

impl MotionReader {
    /// Opens a file and reads its first stretch.
    ///
    /// # Errors
    /// The file is not such a file; the error names the line.
    pub fn open(path: &Path) -> Result<Self, MotionError> {
        let failed = |source| MotionError::Read {
            path: path.to_path_buf(),
            source,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .flexible(true)
            .from_path(path)
            .map_err(failed)?;
        let header = reader.headers().map_err(failed)?.clone();
        let find = |column: &'static str| {
            let mut places = header.iter().enumerate().filter(|(_, name)| *name == column);
            let first = places.next().map(|(place, _)| place);
            match places.count() {
                0 => Ok(first),
                more => Err(MotionError::DoubledColumn {
                    path: path.to_path_buf(),
                    column,
                    count: 1 + more,
                }),
            }
        };
        let required = |column: &'static str| {
            find(column)?.ok_or_else(|| MotionError::MissingColumn {
                path: path.to_path_buf(),
                column,
                header: header.iter().collect::<Vec<_>>().join(","),
            })
        };
        let (time_column, position_column) = (required("t_s")?, required("device_position_m")?);
        let velocity_column = find("device_velocity_mps")?;
        let mut motion = Self {
            path: path.to_path_buf(),
            rows: reader.into_records(),
            header,
            time_column,
            position_column,
            velocity_column,
            stretch: Vec::new(),
            last_s: None,
            period_s: 0.0,
            estimator: None,
        };
        motion.stretch = motion.read_stretch()?;
        if motion.stretch.is_empty() {
            return Err(MotionError::Empty { path: motion.path });
        }
        motion.period_s = usual_period_s(&motion.stretch);
        if motion.velocity_column.is_none() {
            motion.estimator = Some(AlphaBetaGamma::new(motion.period_s));
            motion.last_s = None;
            let mut first = std::mem::take(&mut motion.stretch);
            motion.estimate_velocities(&mut first);
            motion.stretch = first;
        }
        Ok(motion)
    }

    /// The median time between the samples of the first stretch, s.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// The first sample of the stretch that comes next.
    #[must_use]
    pub fn first(&self) -> DeviceSample {
        self.stretch.first().copied().unwrap_or_default()
    }

    /// The next stretch; an empty one at the end.
    ///
    /// # Errors
    /// A row is not one of a motion; the error names the line.
    pub fn next_stretch(&mut self) -> Result<Vec<DeviceSample>, MotionError> {
        if !self.stretch.is_empty() {
            return Ok(std::mem::take(&mut self.stretch));
        }
        let mut stretch = self.read_stretch()?;
        self.estimate_velocities(&mut stretch);
        Ok(stretch)
    }

    fn read_stretch(&mut self) -> Result<Vec<DeviceSample>, MotionError> {
        let mut samples = Vec::with_capacity(STRETCH);
        let mut last_s = self.last_s;
        while samples.len() < STRETCH
            && let Some(record) = self.rows.next()
        {
            let record = record.map_err(|source| MotionError::Read {
                path: self.path.clone(),
                source,
            })?;
            let line = record.position().map_or(0, csv::Position::line);
            let sample = self.sample(&record, line)?;
            if let Some(before) = last_s.filter(|&before| sample.t_s <= before) {
                return Err(MotionError::TimeNotIncreasing {
                    path: self.path.clone(),
                    line,
                    t_s: sample.t_s,
                    before,
                });
            }
            last_s = Some(sample.t_s);
            samples.push(sample);
        }
        if self.velocity_column.is_some() {
            self.last_s = last_s;
        }
        Ok(samples)
    }

    fn sample(&self, record: &csv::StringRecord, line: u64) -> Result<DeviceSample, MotionError> {
        let (cells, columns) = (record.len(), self.header.len());
        if cells < columns {
            let missing: Vec<&str> = self.header.iter().skip(cells).collect();
            return Err(MotionError::ShortRow {
                path: self.path.clone(),
                line,
                cells,
                columns,
                missing: missing.join(", "),
            });
        }
        if cells > columns {
            return Err(MotionError::LongRow {
                path: self.path.clone(),
                line,
                cells,
                columns,
            });
        }
        let number = |index: usize, column| {
            let text = record.get(index).unwrap_or_default();
            text.parse::<f64>()
                .ok()
                .filter(|value| value.abs() <= LARGEST)
                .ok_or_else(|| MotionError::NotANumber {
                    path: self.path.clone(),
                    line,
                    column,
                    value: text.to_owned(),
                })
        };
        Ok(DeviceSample {
            t_s: number(self.time_column, "t_s")?,
            position_m: number(self.position_column, "device_position_m")?,
            velocity_mps: match self.velocity_column {
                Some(index) => number(index, "device_velocity_mps")?,
                None => 0.0,
            },
        })
    }

    fn estimate_velocities(&mut self, samples: &mut [DeviceSample]) {
        let Some(estimator) = &mut self.estimator else { return };
        for sample in samples {
            let last_s = self.last_s.unwrap_or(sample.t_s);
            sample.velocity_mps = estimator.update(sample.t_s - last_s, sample.position_m);
            self.last_s = Some(sample.t_s);
        }
    }
}

/// Reads a motion and keeps nothing of it.
///
/// # Errors
/// As those of [`MotionReader`].
pub fn check(path: &Path) -> Result<(), MotionError> {
    let mut motion = MotionReader::open(path)?;
    while !motion.next_stretch()?.is_empty() {}
    Ok(())
}

/// Reads the whole of a motion.
///
/// # Errors
/// As those of [`MotionReader`].
pub fn read(path: &Path) -> Result<Vec<DeviceSample>, MotionError> {
    let mut motion = MotionReader::open(path)?;
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
            (
                "t_s,device_position_m,force_N,device_velocity_mps\n0,0,1,0\n1,0\n",
                vec!["line 3", "2 of 4 cells", "none for force_N, device_velocity_mps"],
            ),
            ("t_s,device_position_m\n0,0,7\n", vec!["line 2", "3 cells", "2 columns"]),
            ("t_s,device_position_m,t_s\n0,0,1\n", vec!["2 columns `t_s`"]),
            (
                "t_s,device_velocity_mps,device_position_m,device_velocity_mps\n0,0,1,1\n",
                vec!["2 columns `device_velocity_mps`"],
            ),
        ] {
            let message = read_text(text).expect_err(text).to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
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
        let mut estimator = AlphaBetaGamma::new(usual_period_s(&samples[..STRETCH]));
        let mut last_s = 0.0;
        for sample in &samples {
            assert_eq!(
                sample.velocity_mps.to_bits(),
                estimator.update(sample.t_s - last_s, sample.position_m).to_bits()
            );
            last_s = sample.t_s;
        }
        // Time must grow from one stretch to the next as well.
        for velocity in [",0.5", ""] {
            let rows: String = (0..=STRETCH)
                .map(|k| format!("{},1{velocity}\n", if k == STRETCH { 0.5 } else { k as f64 }))
                .collect();
            let column = if velocity.is_empty() {
                ""
            } else {
                ",device_velocity_mps"
            };
            let message = read_text(&format!("t_s,device_position_m{column}\n{rows}"))
                .expect_err("time goes back")
                .to_string();
            assert!(message.contains(&format!("line {}", STRETCH + 2)), "{message}");
        }
    }
}

//! The motion of a hand: a sinusoid, or a recording.

use std::f64::consts::TAU;
use std::fmt;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// A motion: position and velocity for every time.
#[derive(Clone, Debug)]
pub enum Motion {
    /// `-amplitude cos(2 pi frequency t)`: it begins at rest, at one end.
    Sine {
        /// Half the stroke, m.
        amplitude_m: f64,
        /// Turns a second, Hz.
        frequency_hz: f64,
    },
    /// A motion from a file.
    Recorded(Arc<Recording>),
}

impl Motion {
    /// Position (m) and velocity (m/s) at `t_s` >= 0.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (f64, f64) {
        match self {
            Self::Sine {
                amplitude_m,
                frequency_hz,
            } => {
                let omega = TAU * frequency_hz;
                let (sin, cos) = (omega * t_s).sin_cos();
                (-amplitude_m * cos, amplitude_m * omega * sin)
            }
            Self::Recorded(recording) => recording.at(t_s),
        }
    }
}

impl fmt::Display for Motion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sine {
                amplitude_m,
                frequency_hz,
            } => write!(f, "sine of {} mm at {frequency_hz} Hz", amplitude_m * 1e3),
            Self::Recorded(recording) => write!(
                f,
                "{} ({} samples, {:.3} s, {})",
                recording.path.display(),
                recording.samples.len(),
                recording.duration(),
                match recording.after_end {
                    AfterEnd::Hold => "then held",
                    AfterEnd::Loop => "looped",
                }
            ),
        }
    }
}

/// What a recorded motion does after its last sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterEnd {
    /// It stays there.
    Hold,
    /// It goes back to the beginning within [`RETURN_S`] seconds, smoothly, and starts again.
    Loop,
}

/// Duration of the way back in a loop, s.
pub const RETURN_S: f64 = 1.0;

/// A recorded motion. Between samples it is a cubic through both, with slopes from their
/// neighbours, so that its velocity has no steps.
#[derive(Clone, Debug)]
pub struct Recording {
    path: PathBuf,
    samples: Vec<Sample>,
    after_end: AfterEnd,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    t_s: f64,
    position_m: f64,
    velocity_mps: f64,
}

/// Largest time (s) or position (m) taken.
const LARGEST: f64 = 1e6;

/// Why a motion file cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The file cannot be opened, or is not CSV.
    #[error("{}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error.
        source: csv::Error,
    },
    /// A column is missing.
    #[error("{}: there is no column `{column}`; the header must name t_s and position_m, it is `{header}`", .path.display())]
    MissingColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// The header found.
        header: String,
    },
    /// A cell is not a number, or is too large.
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
    /// There are too few samples.
    #[error("{}: a motion needs at least 2 samples, this one has {samples}", .path.display())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// Samples found.
        samples: usize,
    },
}

impl Recording {
    /// Reads a CSV file with the columns `t_s` and `position_m`; others are ignored. Positions are
    /// multiplied by `scale`, and times counted from the first sample.
    ///
    /// # Errors
    /// The file is not such a file; the error names the line.
    pub fn read(path: &Path, scale: f64, after_end: AfterEnd) -> Result<Self, MotionError> {
        Self::read_opened(path, File::open(path), scale, after_end)
    }

    /// The same for a file that the caller has opened, or failed to open; `path` is its name.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_opened(
        path: &Path,
        file: io::Result<File>,
        scale: f64,
        after_end: AfterEnd,
    ) -> Result<Self, MotionError> {
        let failed = |source| MotionError::Read {
            path: path.to_path_buf(),
            source,
        };
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(file.map_err(|error| failed(error.into()))?);
        let header = reader.headers().map_err(failed)?.clone();
        let column = |column: &'static str| {
            header
                .iter()
                .position(|name| name == column)
                .ok_or_else(|| MotionError::MissingColumn {
                    path: path.to_path_buf(),
                    column,
                    header: header.iter().collect::<Vec<_>>().join(","),
                })
        };
        let (time_column, position_column) = (column("t_s")?, column("position_m")?);
        let mut samples: Vec<Sample> = Vec::new();
        let mut begin = 0.0;
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
            let (t_s, position_m) = (number(time_column, "t_s")?, number(position_column, "position_m")?);
            match samples.last() {
                None => begin = t_s,
                Some(last) if t_s - begin <= last.t_s => {
                    return Err(MotionError::TimeNotIncreasing {
                        path: path.to_path_buf(),
                        line,
                        t_s,
                        before: last.t_s + begin,
                    });
                }
                Some(_) => {}
            }
            samples.push(Sample {
                t_s: t_s - begin,
                position_m: position_m * scale,
                velocity_mps: 0.0,
            });
        }
        if samples.len() < 2 {
            return Err(MotionError::TooShort {
                path: path.to_path_buf(),
                samples: samples.len(),
            });
        }
        set_slopes(&mut samples);
        Ok(Self {
            path: path.to_path_buf(),
            samples,
            after_end,
        })
    }

    /// Time of the last sample, s after the first.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.t_s)
    }

    fn at(&self, t_s: f64) -> (f64, f64) {
        let (first, last) = (self.samples[0], self.samples[self.samples.len() - 1]);
        let mut t = t_s.max(0.0);
        if t >= last.t_s {
            if self.after_end == AfterEnd::Hold {
                return (last.position_m, 0.0);
            }
            t %= last.t_s + RETURN_S;
            if t >= last.t_s {
                let back = Sample {
                    t_s: last.t_s + RETURN_S,
                    ..first
                };
                return between(last, back, t);
            }
        }
        let after = self.samples.partition_point(|sample| sample.t_s <= t).max(1);
        between(self.samples[after - 1], self.samples[after], t)
    }
}

/// Sets the velocities: the slope of the parabola through a sample and its neighbours; the ends are
/// at rest.
fn set_slopes(samples: &mut [Sample]) {
    for index in 1..samples.len() - 1 {
        let [a, b, c] = [samples[index - 1], samples[index], samples[index + 1]];
        let (before, after) = (b.t_s - a.t_s, c.t_s - b.t_s);
        let (rise, next) = (
            (b.position_m - a.position_m) / before,
            (c.position_m - b.position_m) / after,
        );
        // No steeper than thrice either side, and level at a turn: then the cubics do not
        // overshoot (Fritsch and Carlson 1980).
        let steepest = if rise * next > 0.0 {
            3.0 * rise.abs().min(next.abs())
        } else {
            0.0
        };
        let slope = (rise * after + next * before) / (before + after);
        samples[index].velocity_mps = slope.clamp(-steepest, steepest);
    }
}

/// The cubic through two samples with their slopes (Hermite).
fn between(a: Sample, b: Sample, t_s: f64) -> (f64, f64) {
    let width = b.t_s - a.t_s;
    let u = (t_s - a.t_s) / width;
    let rise = b.position_m - a.position_m;
    let (left, right) = (a.velocity_mps * width - rise, rise - b.velocity_mps * width);
    let position = a.position_m + u * rise + u * (1.0 - u) * (left * (1.0 - u) + right * u);
    let slope = rise + (1.0 - 2.0 * u) * (left * (1.0 - u) + right * u) + u * (1.0 - u) * (right - left);
    (position, slope / width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn read(text: &str, scale: f64, after_end: AfterEnd) -> Result<Recording, MotionError> {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(text.as_bytes()).expect("written");
        Recording::read(file.path(), scale, after_end)
    }

    #[test]
    fn a_recording_is_followed_scaled_and_held() {
        let text = "extra,t_s,position_m\nx,10.0,0.0\nx,10.1,0.1\nx,10.3,0.3\nx,10.4,0.4\n";
        let recording = read(text, 0.5, AfterEnd::Hold).expect("a motion");
        for (t, want) in [(0.0, 0.0), (0.1, 0.05), (0.2, 0.1), (0.3, 0.15), (0.4, 0.2), (9.0, 0.2)] {
            let (position, _) = recording.at(t);
            assert!((position - want).abs() < 1e-12, "{t}: {position} for {want}");
        }
        // In the middle of a straight line the slope is the line's.
        assert!((recording.at(0.2).1 - 0.5).abs() < 1e-9);
        assert_eq!(recording.at(9.0).1, 0.0);
    }

    #[test]
    fn position_and_velocity_agree_and_a_loop_has_no_jump() {
        let text = "t_s,position_m\n0,0\n0.2,0.02\n0.5,0.01\n1,0.05\n";
        let recording = read(text, 1.0, AfterEnd::Loop).expect("a motion");
        let h = 1e-5;
        let mut t = h;
        while t < 5.0 {
            let ((before, _), (here, velocity), (after, _)) =
                (recording.at(t - h), recording.at(t), recording.at(t + h));
            assert!((after - before).abs() < 1e-4, "a jump at {t} s");
            assert!(
                ((after - before) / (2.0 * h) - velocity).abs() < 1e-3,
                "at {t} s: {velocity}"
            );
            assert!(here.is_finite());
            t += 0.0137;
        }
    }

    #[test]
    fn uneven_samples_are_not_overshot() {
        let text = "t_s,position_m\n0,0\n1,0\n1.001,0.05\n3,0.05\n";
        let recording = read(text, 1.0, AfterEnd::Hold).expect("a motion");
        for k in 0..3000 {
            let (position, _) = recording.at(f64::from(k) * 1e-3);
            assert!((0.0..=0.05 + 1e-12).contains(&position), "{position} m at {k} ms");
        }
    }

    #[test]
    fn a_bad_file_is_refused_by_its_line() {
        for (text, parts) in [
            ("t_s,position\n0,0\n1,1\n", vec!["position_m", "t_s,position"]),
            ("t_s,position_m\n0,0\n1,one\n", vec!["line 3", "position_m", "one"]),
            ("t_s,position_m\n0,0\n1,NaN\n", vec!["line 3", "NaN"]),
            ("t_s,position_m\n0,0\n1,0\n1,0\n", vec!["line 4", "1 s"]),
            ("t_s,position_m\n0,0\n", vec!["at least 2"]),
            ("t_s,position_m\n0,0\n1\n", vec!["line"]),
        ] {
            let message = read(text, 1.0, AfterEnd::Hold).expect_err(text).to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
        let missing = Recording::read(Path::new("/nowhere.csv"), 1.0, AfterEnd::Hold).expect_err("no file");
        assert!(missing.to_string().contains("/nowhere.csv"), "{missing}");
    }
}

//! The path of a hand in the plane.

use super::hand::{HandMotion, Recording};
use haptic_core::planar::Plane;
use std::f64::consts::TAU;
use std::fmt;
use std::path::Path as FilePath;
use std::sync::Arc;

/// Time in which the lines of a zigzag climb from the bottom to the top, in turns of the hand.
const ZIGZAG_CLIMB: f64 = 4.0;

/// The figure that a hand draws again and again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Figure {
    /// Round and round, to the left.
    Circle,
    /// A lying eight, half as high as wide.
    Eight,
    /// To and fro in straight lines, slowly up and down.
    Zigzag,
}

/// A figure, or a motion from a file.
#[derive(Clone, Debug)]
pub enum Path {
    /// A figure around a place.
    Figure {
        /// Which.
        figure: Figure,
        /// Its middle, m.
        middle: Plane,
        /// Half its width, m.
        amplitude_m: f64,
        /// Turns a second, Hz.
        frequency_hz: f64,
    },
    /// A motion for each axis, from a file.
    Recorded {
        /// Along x.
        x: HandMotion,
        /// Along y.
        y: HandMotion,
    },
}

impl Path {
    /// Reads a motion from a file with the columns `t_s,x,y` (s and m); it repeats.
    ///
    /// # Errors
    /// The file cannot be read; or a line of it, by its number.
    pub fn open(file: &FilePath) -> Result<Self, String> {
        let rows = rows_of(file, "t_s,x,y")?;
        let motion = |axis: usize| recorded(file, rows.iter().map(|row: &[f64; 3]| (row[0], row[axis])));
        Ok(Self::Recorded {
            x: motion(1)?,
            y: motion(2)?,
        })
    }

    /// Position, m, and velocity, m/s, at a time, s.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (Plane, Plane) {
        match self {
            Self::Figure {
                figure,
                middle,
                amplitude_m,
                frequency_hz,
            } => {
                let (shape, slope) = figure.at(frequency_hz * t_s);
                (*middle + shape * *amplitude_m, slope * (*amplitude_m * frequency_hz))
            }
            Self::Recorded { x, y } => {
                let ((x, x_slope), (y, y_slope)) = (x.at(t_s), y.at(t_s));
                (Plane::new(x, y), Plane::new(x_slope, y_slope))
            }
        }
    }
}

impl Figure {
    /// The place after so many turns, half a width from the middle at most, and its slope by the turns.
    fn at(self, turns: f64) -> (Plane, Plane) {
        // Of `libm`, the same on every machine.
        let (sin, cos) = libm::sincos(TAU * turns);
        match self {
            Self::Circle => (Plane::new(cos, sin), Plane::new(-sin, cos) * TAU),
            Self::Eight => (Plane::new(sin, sin * cos), Plane::new(cos, cos * cos - sin * sin) * TAU),
            Self::Zigzag => {
                let ((x, x_slope), (y, y_slope)) = (triangle(turns), triangle(turns / (2.0 * ZIGZAG_CLIMB)));
                (Plane::new(x, y), Plane::new(x_slope, y_slope / (2.0 * ZIGZAG_CLIMB)))
            }
        }
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Figure {
                figure,
                amplitude_m,
                frequency_hz,
                ..
            } => write!(
                f,
                "{} of {} mm at {frequency_hz} Hz",
                match figure {
                    Figure::Circle => "circle",
                    Figure::Eight => "eight",
                    Figure::Zigzag => "zigzag",
                },
                amplitude_m * 1e3
            ),
            Self::Recorded { x, .. } => x.fmt(f),
        }
    }
}

/// A wave of straight lines between -1 and 1 after so many turns, and its slope; from -1 up.
fn triangle(turns: f64) -> (f64, f64) {
    let within = turns - turns.floor();
    if within < 0.5 {
        (4.0 * within - 1.0, 4.0)
    } else {
        (3.0 - 4.0 * within, -4.0)
    }
}

/// Reads a motion on a line from a file with the columns `t_s,position_m` (s and m); it repeats.
///
/// # Errors
/// The file cannot be read; or a line of it, by its number.
pub(super) fn motion_of(file: &FilePath) -> Result<HandMotion, String> {
    recorded(
        file,
        rows_of(file, "t_s,position_m")?
            .iter()
            .map(|[t_s, position_m]| (*t_s, *position_m)),
    )
}

fn recorded(file: &FilePath, samples: impl Iterator<Item = (f64, f64)>) -> Result<HandMotion, String> {
    Ok(HandMotion::Recorded(Arc::new(Recording::new(file, samples)?)))
}

/// The rows of a file with these columns: times, s, that grow, and positions, m.
fn rows_of<const N: usize>(file: &FilePath, columns: &str) -> Result<Vec<[f64; N]>, String> {
    let named = |why: &dyn fmt::Display| format!("{}: {why}", file.display());
    rows(&std::fs::read_to_string(file).map_err(|error| named(&error))?, columns).map_err(|why| named(&why))
}

fn rows<const N: usize>(text: &str, columns: &str) -> Result<Vec<[f64; N]>, String> {
    let mut lines = (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty());
    let header = lines.next().map_or("", |(_, line)| line.trim());
    if header != columns {
        return Err(format!(
            "its columns are `{header}`, and must be `{columns}`, in s and m"
        ));
    }
    let mut rows: Vec<[f64; N]> = Vec::new();
    for (number, line) in lines {
        let values: Vec<f64> = line.split(',').map_while(|cell| cell.trim().parse().ok()).collect();
        let row = <[f64; N]>::try_from(values)
            .ok()
            .filter(|row| row.iter().all(|value| value.is_finite()) && line.split(',').count() == N)
            .ok_or_else(|| format!("line {number}: `{line}` must be {N} numbers, in s and m"))?;
        if let Some(last) = rows.last().filter(|last| row[0] <= last[0]) {
            return Err(format!(
                "line {number}: t_s = {} s must be more than {} s before it",
                row[0], last[0]
            ));
        }
        rows.push(row);
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn velocity_is_the_slope_of_every_figure() {
        const STEP_S: f64 = 1e-6;
        for figure in [Figure::Circle, Figure::Eight, Figure::Zigzag] {
            let path = Path::Figure {
                figure,
                middle: Plane::new(0.01, 0.1),
                amplitude_m: 0.03,
                frequency_hz: 0.7,
            };
            for k in 0..1000 {
                let t_s = 0.0171 * f64::from(k) + 0.003;
                let ((before, _), (at, velocity), (after, _)) =
                    (path.at(t_s - STEP_S), path.at(t_s), path.at(t_s + STEP_S));
                let difference = (after - before) * (0.5 / STEP_S);
                assert!((difference - velocity).length() < 1e-6, "{path} at {t_s} s");
                let away = at - Plane::new(0.01, 0.1);
                assert!(
                    away.x.abs() <= 0.03 + 1e-12 && away.y.abs() <= 0.03 + 1e-12,
                    "{path}: {away:?}"
                );
            }
        }
    }

    #[test]
    fn a_file_is_followed_and_a_bad_one_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("hand.csv");
        std::fs::write(&file, "t_s,x,y\n0,0,0.1\n\n1,0.02,0.1\n2,0.04,0.1\n3,0.06,0.1\n").expect("written");
        let (at, velocity) = Path::open(&file).expect("a motion").at(1.5);
        assert!((at - Plane::new(0.03, 0.1)).length() < 1e-12 && (velocity - Plane::new(0.02, 0.0)).length() < 1e-9);
        for (text, expected) in [
            (
                "t,x,y\n0,0,0\n",
                "its columns are `t,x,y`, and must be `t_s,x,y`, in s and m",
            ),
            ("t_s,x,y\n0,0,0\n1,0\n", "line 3: `1,0` must be 3 numbers, in s and m"),
            (
                "t_s,x,y\n0,0,0\n1,0,nan\n",
                "line 3: `1,0,nan` must be 3 numbers, in s and m",
            ),
            ("t_s,x,y\n0,0,0,7\n", "line 2: `0,0,0,7` must be 3 numbers, in s and m"),
            (
                "t_s,x,y\n1,0,0\n1,0,0\n",
                "line 3: t_s = 1 s must be more than 1 s before it",
            ),
            ("t_s,x,y\n1,0,0\n", "a motion needs at least 2 samples, this one has 1"),
            ("t_s,x,y\n", "a motion needs at least 2 samples, this one has 0"),
        ] {
            std::fs::write(&file, text).expect("written");
            let error = Path::open(&file).expect_err(text);
            assert!(error.ends_with(expected), "{error}");
        }
    }
}

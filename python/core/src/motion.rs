//! A motion of the device, from arrays.

use crate::refused;
use haptic_core::velocity::AlphaBetaGamma;
use haptic_lab::motion::{DeviceSample, median_period_s};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

/// A motion of the device: times, s; positions, m; velocities, m/s, which are estimated from the positions as the
/// daemon does where there are none.
#[pyclass(frozen, module = "hapticd_core._native")]
pub(crate) struct Motion(pub(crate) Vec<DeviceSample>);

#[pymethods]
impl Motion {
    #[new]
    fn new(
        t_s: PyReadonlyArray1<'_, f64>,
        position_m: PyReadonlyArray1<'_, f64>,
        velocity_mps: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Self> {
        let (times, positions) = (t_s.as_array(), position_m.as_array());
        let velocities = velocity_mps.as_ref().map(PyReadonlyArray1::as_array);
        let lengths = [
            ("position_m", Some(positions.len())),
            ("velocity_mps", velocities.map(|array| array.len())),
        ];
        for (name, length) in lengths {
            if length.is_some_and(|length| length != times.len()) {
                let length = length.unwrap_or_default();
                return Err(refused(format!(
                    "{name} has {length} values, and t_s has {}",
                    times.len()
                )));
            }
        }
        let mut samples: Vec<DeviceSample> = times
            .iter()
            .zip(positions)
            .map(|(&t_s, &position_m)| DeviceSample {
                t_s,
                position_m,
                velocity_mps: 0.0,
            })
            .collect();
        match velocities {
            Some(velocities) => {
                for (sample, velocity_mps) in samples.iter_mut().zip(velocities) {
                    sample.velocity_mps = *velocity_mps;
                }
            }
            None => estimate_velocities(&mut samples),
        }
        check(&samples)?;
        Ok(Self(samples))
    }
}

fn estimate_velocities(samples: &mut [DeviceSample]) {
    let mut estimator = AlphaBetaGamma::new(median_period_s(samples));
    let mut last_s = samples.first().map_or(0.0, |first| first.t_s);
    for sample in samples {
        sample.velocity_mps = estimator.update(sample.t_s - last_s, sample.position_m);
        last_s = sample.t_s;
    }
}

fn check(samples: &[DeviceSample]) -> PyResult<()> {
    if samples.is_empty() {
        return Err(refused("the motion has no samples"));
    }
    let mut last_s = f64::NEG_INFINITY;
    for (index, sample) in samples.iter().enumerate() {
        for (name, value) in [
            ("t_s", sample.t_s),
            ("position_m", sample.position_m),
            ("velocity_mps", sample.velocity_mps),
        ] {
            if !value.is_finite() {
                return Err(refused(format!("{name}[{index}] = {value} is not a finite number")));
            }
        }
        if sample.t_s <= last_s {
            return Err(refused(format!(
                "t_s[{index}] = {} s does not follow {last_s} s",
                sample.t_s
            )));
        }
        last_s = sample.t_s;
    }
    Ok(())
}

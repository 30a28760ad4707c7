//! A simulation, as arrays.

use haptic_lab::simulate::{SimulatedRow, Simulation as LabSimulation};
use numpy::PyArray1;
use pyo3::prelude::*;

/// A scene rendered along a motion.
#[pyclass(frozen, module = "hapticd_core._native")]
pub(crate) struct Simulation(pub(crate) LabSimulation);

type Numbers<'py> = Bound<'py, PyArray1<f64>>;
type Contacts<'py> = Bound<'py, PyArray1<i8>>;

#[pymethods]
impl Simulation {
    /// The columns of numbers, in the order of `hapticd_core.Simulation`.
    fn numbers<'py>(&self, py: Python<'py>) -> Vec<Numbers<'py>> {
        let columns: [fn(&SimulatedRow) -> f64; 6] = [
            |row| row.device.t_s,
            |row| row.device.position_m,
            |row| row.device.velocity_mps,
            |row| row.block_position_m,
            |row| row.block_velocity_mps,
            |row| row.coupling_force_n,
        ];
        columns
            .map(|column| PyArray1::from_iter(py, self.0.rows.iter().map(column)))
            .into()
    }

    /// Contacts: 0 stuck, 1 and -1 sliding.
    fn contacts<'py>(&self, py: Python<'py>) -> Contacts<'py> {
        PyArray1::from_iter(py, self.0.rows.iter().map(|row| row.contact.as_number()))
    }

    /// Changes of contact: times, s; from; to.
    fn changes<'py>(&self, py: Python<'py>) -> (Numbers<'py>, Contacts<'py>, Contacts<'py>) {
        let events = &self.0.events;
        (
            PyArray1::from_iter(py, events.iter().map(|event| event.t_s)),
            PyArray1::from_iter(py, events.iter().map(|event| event.from.as_number())),
            PyArray1::from_iter(py, events.iter().map(|event| event.to.as_number())),
        )
    }

    /// Energy that friction put into the block, J.
    #[getter]
    fn energy_created_j(&self) -> f64 {
        self.0.energy_created_j
    }

    /// Ticks whose bounded work ran out.
    #[getter]
    fn exhausted_ticks(&self) -> u64 {
        self.0.exhausted_ticks
    }
}

//! What was found out about a rig.

use crate::failure::Failure;
use crate::output;
use haptic_ipc::CommissionReply;
use serde::Serialize;

/// A step of the encoder that is a count, to the last digits that travel.
const SAME_STEP: f64 = 1e-3;

/// One value for each direction, where it is known.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Pair {
    positive: Option<f64>,
    negative: Option<f64>,
}

impl Pair {
    pub(super) fn of(&self, sign: f64) -> Option<f64> {
        if sign > 0.0 { self.positive } else { self.negative }
    }

    pub(super) fn of_mut(&mut self, sign: f64) -> &mut Option<f64> {
        if sign > 0.0 {
            &mut self.positive
        } else {
            &mut self.negative
        }
    }

    fn shown(&self) -> String {
        let newtons =
            |value: Option<f64>| value.map_or_else(|| "not known".to_owned(), |value| format!("{value:.2} N"));
        format!("+ {}, - {}", newtons(self.positive), newtons(self.negative))
    }
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Findings {
    pub(super) rig: String,
    pub(super) firmware: String,
    /// 1: a positive force moves the handle in the positive direction. With another nothing comes
    /// so far.
    sign: i8,
    /// The force of the first pulse that moved the handle, N.
    #[serde(rename = "breakaway_N")]
    pub(super) breakaway_n: Pair,
    #[serde(rename = "friction_N")]
    pub(super) friction_n: Pair,
    pub(super) range_m: Option<f64>,
    /// Between two counts, as the device says, m.
    resolution_m: f64,
    /// As it was seen, m.
    pub(super) step_m: Option<f64>,
    pub(super) pulses: u64,
    /// Where the daemon keeps it.
    pub(super) path: Option<String>,
}

impl Findings {
    pub(super) fn new(begun: &CommissionReply) -> Self {
        Self {
            rig: begun.rig.clone(),
            firmware: begun.firmware.clone(),
            sign: 1,
            breakaway_n: Pair::default(),
            friction_n: Pair::default(),
            range_m: None,
            resolution_m: begun.resolution_m,
            step_m: None,
            pulses: 0,
            path: None,
        }
    }

    /// Of both directions, as far as they are known, N.
    pub(super) fn mean_friction_n(&self) -> Option<f64> {
        let known: Vec<f64> = [self.friction_n.positive, self.friction_n.negative]
            .into_iter()
            .flatten()
            .collect();
        mean(&known)
    }

    pub(super) fn table(&self) -> String {
        let range = self
            .range_m
            .map_or_else(|| "not known".to_owned(), |range_m| format!("{:.1} mm", mm(range_m)));
        let said_um = self.resolution_m * 1e6;
        let step = match self.step_m {
            None => format!("not seen; the device says {said_um:.3} um"),
            Some(step_m) if (step_m - self.resolution_m).abs() <= SAME_STEP * self.resolution_m => {
                format!("{said_um:.3} um, as the device says")
            }
            Some(step_m) => format!(
                "{:.3} um, where the device says {said_um:.3} um: is counts_per_metre in its hello right?",
                step_m * 1e6
            ),
        };
        let rows = [
            (
                "direction",
                "right: a positive force moves the handle in the positive direction".to_owned(),
            ),
            ("first moved at", self.breakaway_n.shown()),
            ("friction", self.friction_n.shown()),
            ("range", range),
            ("encoder step", step),
        ];
        let rows: Vec<Vec<String>> = rows
            .into_iter()
            .map(|(name, value)| vec![format!("  {name}"), value])
            .collect();
        output::table(&rows)
    }

    pub(super) fn show(&self, json: bool) -> Result<(), Failure> {
        if json {
            return output::json(self);
        }
        let mut text = format!("{} is commissioned\n{}", self.rig, self.table());
        if let Some(path) = &self.path {
            text.push_str(&format!("\nkept in {path}"));
        }
        if let Some(friction_n) = self.mean_friction_n() {
            text.push_str(&format!(
                "\nTo have the daemon allow for its friction: `rig-friction-n = {friction_n:.2}` in its configuration"
            ));
        }
        output::line(&text)
    }
}

pub(super) fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// Of some numbers; nothing of none.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "a few values")]
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

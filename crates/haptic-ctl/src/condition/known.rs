//! Whether a condition holds, by the events so far.

use super::comparison::{Comparison, Condition};
use super::field::{COUNTS, Field};
use haptic_core::Directional;
use haptic_ipc::{Event, RigState, Sample, SampleY, StateEvent, TimingWindow, Topic};

/// The newest state, sample and counts, from the events so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Observations {
    pub(crate) state: Option<StateEvent>,
    sample: Option<Sample>,
    sample_y: Option<SampleY>,
    counts: Option<TimingWindow>,
}

impl Observations {
    /// Takes in an event; says whether the condition holds after it, or after any sample in it. A
    /// comparison with an unknown field does not hold.
    pub(crate) fn take(&mut self, event: Event, condition: &Condition) -> bool {
        match event {
            Event::State(state) => self.state = Some(state),
            Event::Timing(timing) => self.counts = Some(timing.since_start),
            Event::Samples(samples) => {
                return samples.ticks().any(|(row, y)| {
                    (self.sample, self.sample_y) = (Some(*row), y.copied());
                    self.fulfils(condition)
                });
            }
            Event::Servo(_) | Event::Snapshot(_) | Event::Log(_) | Event::Unknown => return false,
        }
        self.fulfils(condition)
    }

    /// Whether all fields of the condition are known, and the rig's state.
    pub(crate) fn is_enough_for(&self, condition: &Condition) -> bool {
        self.state.is_some()
            && condition.topics().iter().all(|topic| match topic {
                Topic::Samples => self.sample.is_some(),
                Topic::Timing => self.counts.is_some(),
                Topic::State | Topic::Log | Topic::Snapshot => true,
            })
    }

    /// Why the condition cannot hold before somebody resets the rig: it is stopped or faulted, and no sample from
    /// before that is still on its way.
    pub(crate) fn halt(&self, condition: &Condition) -> Option<&StateEvent> {
        let state = self.state.as_ref()?;
        let is_halted = matches!(state.state, RigState::Stopped | RigState::Faulted);
        let is_newest = self.sample.is_none_or(|sample| sample.tick >= state.tick);
        let is_known = is_newest && self.is_enough_for(condition);
        (is_halted && is_known && condition.is_ruled_out_by(state.state)).then_some(state)
    }

    /// The newest tick that is known.
    pub(crate) fn tick(&self) -> Option<u64> {
        let of_state = self.state.as_ref().map(|state| state.tick);
        of_state.max(self.sample.map(|sample| sample.tick))
    }

    fn fulfils(&self, condition: &Condition) -> bool {
        condition
            .comparisons
            .iter()
            .all(|comparison| self.holds(comparison).unwrap_or(false))
    }

    fn holds(&self, comparison: &Comparison) -> Option<bool> {
        let state = self.state.as_ref();
        match comparison.field {
            // A sample's state and revision are those of its own tick, so that a condition is
            // judged at one moment.
            Field::State => {
                let found = self
                    .sample
                    .map(|sample| sample.state)
                    .or(state.map(|state| state.state))?;
                Some(comparison.matches_word(&found.to_string()))
            }
            Field::Sample("revision") if self.sample.is_none() => {
                #[expect(clippy::cast_precision_loss, reason = "a count below 2^53")]
                let revision = state?.revision as f64;
                Some(comparison.number_holds(revision))
            }
            Field::Scene => Some(comparison.matches_word(&state?.scene)),
            Field::Law => Some(comparison.matches_word(&state?.law)),
            Field::Sample(column) => {
                let found = self.sample?.to_object().get(column)?.as_f64()?;
                Some(comparison.number_holds(found))
            }
            Field::SecondAxis(column) => {
                let (_, found) = self.sample_y?.named().find(|(name, _)| *name == column)?;
                Some(comparison.number_holds(found))
            }
            Field::Count(count) => Some(comparison.number_holds(COUNTS[count].1(self.counts.as_ref()?))),
            Field::Parameter(key) => {
                let found: &Directional = state?.params.get(key.parameter.info().name)?;
                Some(match key.direction {
                    Some(direction) => comparison.number_holds(found.get(direction)),
                    None => comparison.number_holds(found.positive) && comparison.number_holds(found.negative),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::comparison::tests::condition;
    use super::*;
    use haptic_ipc::SamplesEvent;

    fn state(state: RigState, revision: u64) -> Event {
        let mut scene = haptic_core::Scene::paper();
        scene.name = "steel and ice".into();
        Event::State(StateEvent {
            state,
            tick: 5,
            revision,
            scene: scene.name.clone(),
            law: "karnopp".into(),
            params: haptic_ipc::params_of(&scene),
            ..StateEvent::default()
        })
    }

    fn sample(position: f64, contact: i8) -> Sample {
        Sample {
            t_s: 0.009,
            state: RigState::Engaged,
            contact,
            device_position_m: position,
            ..Sample::default()
        }
    }

    fn batch(rows: &[Sample], rows_y: &[SampleY]) -> Event {
        Event::Samples(SamplesEvent {
            rows: rows.to_vec(),
            rows_y: rows_y.to_vec(),
            ..SamplesEvent::default()
        })
    }

    #[test]
    fn a_condition_holds_when_all_of_it_does() {
        let after = |event: Event, text: &str| Observations::default().take(event, &condition(text));
        for (text, holds) in [
            ("state=engaged", true),
            ("state == engaged", true),
            ("state!=engaged", false),
            ("state=engaged and revision>=42", true),
            ("state=engaged and revision>42", false),
            ("state = engaged and revision <= 42 and revision < 43", true),
            ("scene='steel and ice'", true),
            ("scene=\"steel and ice\" and law=karnopp", true),
            ("scene!='steel and ice'", false),
            ("mass=0.5", true),
            ("mass=500g and M<1", true),
            ("Fs>=4 and Fs+=4N", true),
            ("Fs->4", false),
            ("stribeck_velocity>=0", true),
            ("contact_stiffness>0", false),
        ] {
            assert_eq!(after(state(RigState::Engaged, 42), text), holds, "{text}");
        }
    }

    #[test]
    fn fault_ends_wait_for_force_after_all_samples_before_it() {
        let force = condition("command_force_N>1N");
        let row = |tick| Sample {
            tick,
            ..Sample::default()
        };
        let mut known = Observations::default();
        assert!(!known.take(state(RigState::Faulted, 1), &force));
        assert_eq!(known.halt(&force), None, "no sample is known");
        known.take(batch(&[row(4)], &[]), &force);
        assert_eq!(known.halt(&force), None, "the sample is older than the fault");
        known.take(batch(&[row(5)], &[]), &force);
        assert!(known.halt(&force).is_some());
        assert_eq!(
            known.halt(&condition("device_position_m>1cm")),
            None,
            "a hand may still move it"
        );
        known.take(state(RigState::Idle, 1), &force);
        assert_eq!(known.halt(&force), None, "somebody may engage it");
    }

    #[test]
    fn any_sample_of_a_batch_fulfils_it() {
        let rows = [sample(0.0, 0), sample(0.02, 1), sample(0.0, -1)];
        for (text, holds) in [
            ("device_position_m>0.01", true),
            ("device_position_m>0.01 and contact=1", true),
            ("device_position_m>0.01 and contact=0", false),
            ("contact=-1", true),
            ("device_position_m>1cm and contact='slides +'", true),
            ("device_position_m>=20mm", true),
            ("device_position_m>3cm", false),
            ("t_s<10ms and contact!=stuck", true),
            ("state=engaged and contact=-1", true),
            ("overruns=0", false),
        ] {
            assert_eq!(
                Observations::default().take(batch(&rows, &[]), &condition(text)),
                holds,
                "{text}"
            );
        }
    }

    #[test]
    fn second_axis_is_compared_where_there_is_one() {
        let y = SampleY {
            device_position_m: 0.03,
            command_force_n: -2.0,
            ..SampleY::default()
        };
        let rows = [sample(0.0, 0)];
        for (text, holds) in [
            ("device_position_y_m>2cm and contact=0", true),
            ("device_position_y_m>=30mm and command_force_y_N<-1N", true),
            ("device_position_y_m>4cm", false),
            ("block_velocity_y_mps>0", false),
        ] {
            let condition = condition(text);
            let of_plane = Observations::default().take(batch(&rows, &[y]), &condition);
            assert_eq!(of_plane, holds, "{text}");
            assert!(!Observations::default().take(batch(&rows, &[]), &condition), "{text}");
            assert!(condition.check_axes(2).is_ok(), "{text}");
            let refusal = condition.check_axes(1).expect_err(text);
            assert!(refusal.contains("_y_") && refusal.contains("one axis"), "{refusal}");
        }
        assert!(condition("device_position_m>0").check_axes(1).is_ok());
    }
}

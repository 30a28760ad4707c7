//! A stuck spring on the device itself: breakaway and the end of a slide where they happen on a
//! leg.

use super::stribeck_flow::TWELVE;
use super::{DeviceContact, EnergyMeter};
use crate::contact::leg::Leg;
use crate::contact::level::Level;
use crate::contact::spring::{SpringContact, SpringState};
use crate::contact::state::StaticLimit;
use crate::contact::yielding::YieldingContact;
use crate::directional::Direction;
use crate::math::flush;
use crate::series::{halve, root_between};

/// Most slides that begin and end on a leg one by one. Where there are more, the spring is found
/// somewhere between the friction of a slide and its limit.
const MAX_SLIDES: u32 = 512;
/// A rising limit is met to this, N.
const CLOSE: f64 = 1e-13;
/// Halvings that find an extreme of the load over its limit.
const HALVINGS: u32 = 50;

impl<L: Level, R: StaticLimit> SpringContact<L, R> {
    /// The force along a direction after a distance, N: unloaded first, then loaded, each with its
    /// own stiffness.
    fn loaded(&self, direction: Direction, along: f64, distance: f64) -> f64 {
        let loading = self.stiffness.get(direction);
        if along >= 0.0 {
            return along + loading * distance;
        }
        let unloading = self.stiffness.get(opposite(direction));
        let unloaded = along + unloading * distance;
        if unloaded <= 0.0 {
            unloaded
        } else {
            loading * (unloaded / unloading)
        }
    }

    /// The distance at which a stuck spring breaks loose on a leg, if it does.
    fn breakaway(&self, along: f64, leg: &Leg) -> Option<f64> {
        let direction = leg.direction;
        let limit = self.limit(direction);
        if along >= limit {
            return (leg.distance > 0.0).then_some(0.0);
        }
        if self.static_limit.dwell_s().is_finite() {
            if self.loaded(direction, along, leg.distance) < limit {
                return None;
            }
            return self.breakaway_under_rising_limit(along, leg);
        }
        let unloading = (-along).max(0.0) / self.stiffness.get(opposite(direction));
        let distance = unloading + (limit - along.max(0.0)) / self.stiffness.get(direction);
        (distance <= leg.distance).then_some(distance)
    }

    /// The same where the limit grows with time: the load comes to it on a rise of their
    /// difference, of which there is one at most, because the speed is a straight line over time
    /// and the limit's rate a decaying exponential.
    fn breakaway_under_rising_limit(&self, along: f64, leg: &Leg) -> Option<f64> {
        let beyond = |share: f64| {
            let mut rested = *self;
            rested.static_limit.rest(share * leg.duration_s);
            self.loaded(leg.direction, along, leg.distance_after(share)) - rested.limit(leg.direction)
        };
        // Where the difference is greatest: at the end, or where a slowing leg turns it down.
        let step = 1e-6;
        let falls = |share: f64| beyond(share + step) < beyond(share);
        let mut top = 1.0;
        if leg.to_speed < leg.from_speed && falls(1.0 - step) {
            top = halve(0.0, 1.0 - step, HALVINGS, |share| !falls(share)).1;
        }
        if beyond(top) < 0.0 {
            return None;
        }
        let share = root_between(0.0, top, CLOSE, beyond);
        Some(leg.distance_after(share).min(leg.distance))
    }

    /// Goes on as a stuck spring; returns what is left of the leg after it broke loose.
    fn advance_stuck<E: EnergyMeter>(&mut self, force: f64, leg: &Leg, meter: &mut E) -> Option<Leg> {
        let direction = leg.direction;
        let sign = direction.sign();
        let along = sign * force;
        let Some(distance) = self.breakaway(along, leg) else {
            self.static_limit.rest(leg.duration_s);
            let after = self.loaded(direction, along, leg.distance);
            self.state = SpringState::Stuck {
                force: flush(sign * after),
            };
            return None;
        };
        let (held, rest) = leg.split(distance);
        self.static_limit.rest(held.duration_s);
        let limit = self.limit(direction).max(along);
        self.state = SpringState::Stuck { force: sign * limit };
        let before = self.stored_energy();
        self.level.set_off(direction, limit);
        self.state = SpringState::Sliding {
            direction,
            armed: rest.to_speed > self.velocity_threshold,
        };
        if E::LISTENS {
            meter.take(before - self.stored_energy());
        }
        Some(rest)
    }

    /// Goes on faster than the threshold, where a slide lasts.
    fn advance_fast<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) {
        let sliding = match self.state {
            SpringState::Stuck { force } => self.advance_stuck(force, leg, meter),
            SpringState::Sliding { .. } => Some(*leg),
        };
        if let Some(leg) = sliding
            && E::LISTENS
        {
            meter.take(self.work_of_slide(&leg));
        }
    }

    /// Goes on slower than the threshold, where each slide ends as it begins. Returns whether the
    /// bounded work ran out.
    fn advance_slowly<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        let mut left = *leg;
        for slide in 0..=MAX_SLIDES {
            if let SpringState::Sliding { direction, .. } = self.state {
                self.end_slide(direction, left.from_speed, meter);
                left = self.skip_slides(&left, slide == MAX_SLIDES, meter);
            }
            let SpringState::Stuck { force } = self.state else {
                return false;
            };
            if left.distance > 0.0 && self.reached(leg.direction, force) {
                // What a slide would hold is the limit already.
                if E::LISTENS {
                    meter.take(leg.direction.sign() * force * left.distance);
                }
                return false;
            }
            let Some(rest) = self.advance_stuck(force, &left, meter) else {
                return slide == MAX_SLIDES;
            };
            left = rest;
        }
        true
    }

    /// A slide ends at a speed.
    fn end_slide<E: EnergyMeter>(&mut self, direction: Direction, speed: f64, meter: &mut E) {
        let before = self.stored_energy();
        let friction = self.level.at(direction, speed) + self.viscous.get(direction) * speed;
        self.stick(direction.sign() * friction);
        if E::LISTENS {
            meter.take(before - self.stored_energy());
        }
    }

    /// Work of a slide's friction without drag, J.
    fn work_of_slide(&self, leg: &Leg) -> f64 {
        if !L::VARIES {
            return leg.distance * self.level.at(leg.direction, leg.to_speed);
        }
        let at = |node: f64| self.level.at(leg.direction, leg.speed_at(node * leg.distance));
        leg.distance * TWELVE.iter().map(|&(node, weight)| weight * at(node)).sum::<f64>()
    }

    /// Below the threshold the spring goes from the friction of a slide to the limit over and over:
    /// leaves out whole rounds, where one is like the next, or counts as such (`anyway`).
    fn skip_slides<E: EnergyMeter>(&mut self, leg: &Leg, anyway: bool, meter: &mut E) -> Leg {
        let SpringState::Stuck { force } = self.state else {
            return *leg;
        };
        let direction = leg.direction;
        let along = direction.sign() * force;
        let alike = !L::VARIES && self.viscous.get(direction) == 0.0 && self.static_limit.dwell_s().is_infinite();
        let round = (self.limit(direction) - along) / self.stiffness.get(direction);
        if !(alike || anyway) || along < 0.0 || round <= 0.0 || leg.distance < round {
            return *leg;
        }
        let rest = leg.split(leg.distance - leg.distance % round).1;
        if E::LISTENS {
            meter.take(0.5 * (self.limit(direction) + along) * (leg.distance - rest.distance));
        }
        rest
    }
}

fn opposite(direction: Direction) -> Direction {
    Direction::of(-direction.sign())
}

impl<L: Level, R: StaticLimit> DeviceContact for SpringContact<L, R> {
    #[inline]
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        if let SpringState::Sliding { direction, .. } = self.state
            && direction != leg.direction
        {
            // It turned round: the slide ended at rest, and what follows unloads the spring.
            self.end_slide(direction, 0.0, meter);
        }
        let threshold = self.velocity_threshold;
        if threshold == 0.0 {
            self.advance_fast(leg, meter);
            return false;
        }
        let Some(distance) = leg.passes(threshold) else {
            return if leg.to_speed < threshold {
                self.advance_slowly(leg, meter)
            } else {
                self.advance_fast(leg, meter);
                false
            };
        };
        let (first, last) = leg.split(distance);
        if leg.to_speed < threshold {
            self.advance_fast(&first, meter);
            self.advance_slowly(&last, meter)
        } else {
            let ran_out = self.advance_slowly(&first, meter);
            self.advance_fast(&last, meter);
            ran_out
        }
    }

    fn friction(&self, velocity: f64) -> f64 {
        YieldingContact::friction(self, velocity)
    }
}

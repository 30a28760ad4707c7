//! A bristle on its master path: Hayward and Armstrong's contact, and the elasto-plastic one
//! without Stribeck's fall.

use super::master_path::{FARTHEST, MasterLaw, MasterPath};
use super::{DeviceContact, EnergyMeter};
use crate::contact::leg::Leg;
use crate::contact::state::{Contact, ContactMemory, LawContact};
use crate::contact::yielding::by_elastic_share;
use crate::directional::{Direction, Directional};
use crate::math::flush;
use crate::series::halve;
use crate::snapshot::Archive;
use alloc::sync::Arc;

/// A place on the path.
#[derive(Clone, Copy, Debug)]
struct PathPlace {
    direction: Direction,
    /// `X`.
    at: f64,
    cell: usize,
}

/// The contact.
#[derive(Clone, Debug)]
pub(crate) struct PathBristle<M> {
    law: M,
    path: Arc<MasterPath>,
    /// `Fd`, N.
    limit: Directional,
    /// `sigma0`, N/m.
    stiffness: f64,
    /// `sigma1`, N s/m.
    damping: f64,
    /// `b`, N s/m.
    viscous: Directional,
    /// `u` at which half of a motion is elastic.
    half_elastic: f64,
    /// `sigma0 z`, N, signed.
    force: f64,
    /// Where it is on the path, once it moves on it; that says more than the force does, which
    /// hardly changes near the end.
    place: Option<PathPlace>,
}

impl<M: MasterLaw> PathBristle<M> {
    /// `limit` is `Fd`, N, `stiffness` `sigma0`, N/m, `damping` `sigma1` and `viscous` `b`, N s/m.
    pub(crate) fn new(law: M, limit: Directional, stiffness: f64, damping: f64, viscous: Directional) -> Self {
        let start = law.elastic_up_to().unwrap_or_else(|| {
            // After a turn the deflection is that of the other direction.
            let most = if limit.least() > 0.0 {
                limit.greatest() / limit.least()
            } else {
                1.0
            };
            -most.min(FARTHEST)
        });
        Self {
            law,
            path: Arc::new(MasterPath::new(&law, start)),
            limit,
            stiffness,
            damping,
            viscous,
            half_elastic: halve(0.0, 1.0, 60, |u| law.rate(u) >= 0.5).0,
            force: 0.0,
            place: None,
        }
    }

    /// Moves on where nothing holds. A deflection the other way vanishes at once, or as a spring's
    /// does.
    fn advance_unheld(&mut self, leg: &Leg, meter: &mut impl EnergyMeter) {
        let along = leg.direction.sign() * self.force;
        let after = if M::UNLOADS_ELASTICALLY && along < 0.0 {
            (along + self.stiffness * leg.distance).min(0.0)
        } else {
            0.0
        };
        if !M::UNLOADS_ELASTICALLY {
            meter.take(0.5 * along * along / self.stiffness);
        }
        self.force = flush(leg.direction.sign() * after);
        self.place = None;
    }

    /// Whether at least half of a motion in a direction is elastic.
    fn is_elastic(&self, direction: Direction) -> bool {
        let along = direction.sign() * self.force;
        let limit = self.limit.get(direction);
        if limit > 0.0 {
            along <= self.half_elastic * limit
        } else {
            M::UNLOADS_ELASTICALLY && along < 0.0
        }
    }
}

impl<M: MasterLaw> LawContact for PathBristle<M> {
    fn force_at_rest(&self) -> f64 {
        self.force
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.force = memory.held(|direction| self.limit.get(direction));
        self.place = None;
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("force_N", &mut self.force);
        let blank = PathPlace {
            direction: Direction::Positive,
            at: 0.0,
            cell: 0,
        };
        let most = self.path.last_cell();
        archive.option("path", &mut self.place, blank, |archive, place| {
            archive.choice("path_direction", &mut place.direction, &Direction::BOTH);
            archive.number("path_at", &mut place.at);
            archive.place("path_cell", &mut place.cell, most);
        });
    }

    fn contact(&self, direction: Direction, _speed: f64) -> Contact {
        by_elastic_share(f64::from(u8::from(self.is_elastic(direction))), direction)
    }
}

impl<M: MasterLaw> DeviceContact for PathBristle<M> {
    #[inline]
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        let (direction, sign) = (leg.direction, leg.direction.sign());
        let limit = self.limit.get(direction);
        if limit <= 0.0 {
            self.advance_unheld(leg, meter);
            return false;
        }
        let mut distance = leg.distance;
        let mut place = match self.place {
            Some(place) if place.direction == direction => place,
            _ => {
                let along = sign * self.force;
                if let Some(end) = self.law.elastic_up_to()
                    && along < end * limit
                {
                    let elastic = (end * limit - along) / self.stiffness;
                    if distance <= elastic {
                        self.force = flush(sign * (along + self.stiffness * distance));
                        self.place = None;
                        return false;
                    }
                    distance -= elastic;
                    self.force = sign * end * limit;
                }
                let (at, cell) = self.path.find(sign * self.force / limit);
                PathPlace { direction, at, cell }
            }
        };
        let from = place;
        place.at += distance * (self.stiffness / limit);
        let at_end = place.at;
        let u = self.path.at(&mut place.at, &mut place.cell);
        if E::LISTENS {
            let work = self.path.work(at_end, place.cell) - self.path.work(from.at, from.cell);
            let before = sign * self.force / limit;
            let stored = 0.5 * (u - before) * (u + before);
            meter.take(limit * limit / self.stiffness * (work - stored));
        }
        self.force = flush(sign * limit * u);
        self.place = Some(place);
        false
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        let limit = self.limit.get(direction);
        // Without a limit this way, whatever the bristle held is gone at once.
        let force = if limit > 0.0 || M::UNLOADS_ELASTICALLY {
            self.force
        } else {
            0.0
        };
        let damping = if self.damping > 0.0 {
            let share = if limit > 0.0 {
                self.law.rate(direction.sign() * self.force / limit)
            } else {
                f64::from(u8::from(self.is_elastic(direction)))
            };
            self.damping * share
        } else {
            0.0
        };
        force + (damping + self.viscous.get(direction)) * velocity
    }
}

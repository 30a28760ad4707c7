//! What the connected rig is known to be: by its link, by the options, and by the files of what was found of it. They
//! are read when the rig is plugged in, and kept until another one is. The loop gets its part with each command to
//! engage.

use crate::control::advise::BrokenBounds;
use crate::control::facts::Facts;
use crate::control::history::FIRST_REVISION;
use crate::control::judge::Verdicts;
use crate::control::rig::both_motors::WorstPlaces;
use crate::control::rig::commission_record::{Findings, Records};
use crate::control::rig::friction_record::{KnownFriction, RigFrictions};
use crate::control::trial::{LIGHT_RIG_KG, TrialRig};
use crate::control::{RigHandle, change};
use crate::rt::inbox::RigSetup;
use crate::threads::Workers;
use crate::timers::every;
use device_io::kinematics::Worst;
use device_io::link::DeviceInfo;
use haptic_core::Directional;
use haptic_core::adviser::RigFacts;
use haptic_core::compensation::Compensation;
use haptic_core::passivity::RigLosses;
use haptic_core::rig_friction::RigFriction;
use haptic_core::scene::{Coupling, SceneFile};
use haptic_core::servo::Settings;
use haptic_ipc::{AdviceBasis, LossSource, RigFrictionStatus, WorstPlace};
use std::cell::RefCell;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Time between two looks for another rig.
const WATCH_PERIOD: Duration = Duration::from_millis(50);

/// Time after which the delay of a new link is known.
const SETTLING: Duration = Duration::from_millis(300);

/// Time after which a file that could not be read is tried again.
const RETRY_PERIOD: Duration = Duration::from_millis(500);

/// In parts of a period a delay counts as the next longer one.
const DELAY_GRAIN: f64 = 0.25;

/// Threads that search for devices.
const MAX_SEARCHES: usize = 4;

/// The connected rig, as far as it is known.
#[derive(Debug)]
pub(in crate::control) struct KnownRig {
    pub(in crate::control) facts: Rc<Facts>,
    pub(in crate::control) records: Records,
    pub(in crate::control) frictions: RigFrictions,
    /// Whether scenes chatter on it, as far as they were tried.
    pub(in crate::control) verdicts: Verdicts,
    /// The bounds that the active scene broke, as they were last reckoned.
    pub(in crate::control) broken_bounds: BrokenBounds,
    /// The newest scene whose coupling is the rig's.
    pub(in crate::control) suited: RefCell<Option<Suited>>,
    /// Workers that search for devices.
    pub(in crate::control) searches: Workers,
}

/// The rig that gives a coupling.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::control) struct CouplingOwner {
    /// The rig, if there is one.
    key: Option<String>,
    /// Whether its commissioning found the coupling.
    pub(in crate::control) is_commissioned: bool,
}

/// A scene that has the coupling of a rig.
#[derive(Clone, Debug)]
pub(in crate::control) struct Suited {
    /// What it was before.
    pub(in crate::control) file: SceneFile,
    pub(in crate::control) revision: u64,
    /// Whose it is.
    pub(in crate::control) of: CouplingOwner,
}

/// A rig as a trial takes it.
#[derive(Clone, Copy, Debug)]
pub(in crate::control) struct TrialBasis {
    pub(in crate::control) rig: TrialRig,
    /// The mass that it has for want of a known one, kg.
    pub(in crate::control) assumed_mass_kg: Option<f64>,
    pub(in crate::control) is_plane: bool,
    /// Where a rig of two axes has the mass that it has.
    pub(in crate::control) lightest_at: Option<WorstPlace>,
}

impl TrialBasis {
    /// It with each mass that it may have, as far as that is not known.
    pub(in crate::control) fn of_every_mass(&self) -> Vec<TrialRig> {
        match self.assumed_mass_kg {
            None => vec![self.rig],
            Some(_) => self.rig.of_every_mass().to_vec(),
        }
    }
}

/// What a rig takes up of a motion, where that is known from, and what of it is compensated.
#[derive(Clone, Copy, Debug)]
struct OwnFriction {
    losses: RigLosses,
    damping_from: LossSource,
    friction_from: LossSource,
    identified: Option<RigFriction>,
    compensation: Option<Compensation>,
    /// Mass of the moving part, kg, where it is known: of the rig in this process, else as it was identified, else as
    /// its commissioning found it.
    mass_kg: Option<f64>,
    /// Of a rig of two axes where that friction and that mass are so, as far as they are as its commissioning found
    /// them.
    worst: WorstPlaces,
}

impl OwnFriction {
    fn compensated_share(&self) -> Option<f64> {
        self.compensation.map(|compensation| compensation.share)
    }
}

impl KnownRig {
    pub(super) fn new(facts: Rc<Facts>) -> Self {
        let first = |file| Suited {
            file,
            revision: FIRST_REVISION,
            of: CouplingOwner::default(),
        };
        Self {
            records: Records::new(&facts.state_dir, facts.kinematics),
            frictions: RigFrictions::new(&facts.state_dir),
            suited: RefCell::new(facts.first_scene.clone().map(first)),
            facts,
            verdicts: Verdicts::default(),
            broken_bounds: BrokenBounds::default(),
            searches: Workers::new("devices", MAX_SEARCHES),
        }
    }

    /// Which coupling [`Self::coupling`] is now.
    pub(in crate::control) fn coupling_owner(&self) -> CouplingOwner {
        CouplingOwner {
            key: self.facts.connected_device().map(|device| device.rig.key),
            is_commissioned: self.commissioned_coupling().is_some(),
        }
    }

    /// The number of the connection to the device; 0 without a device.
    pub(super) fn connection(&self) -> u64 {
        self.facts.connected_device().map_or(0, |device| device.connection)
    }

    /// What its commissioning found, as far as its record was read.
    fn commissioned(&self) -> Option<(Findings, Option<Coupling>)> {
        self.records.newest(self.facts.connected_device()?.connection)
    }

    /// The coupling that it bears: as its commissioning found it, else a soft one where its link is late.
    pub(in crate::control) fn coupling(&self) -> Option<Coupling> {
        let calm = || Coupling::calm_behind(self.facts.steady_delay_s());
        self.commissioned_coupling().or_else(calm)
    }

    /// The coupling that it bears, where its commissioning found one.
    pub(in crate::control) fn commissioned_coupling(&self) -> Option<Coupling> {
        self.commissioned()?.1
    }

    /// What is known of its friction, as far as its file was read.
    fn friction(&self) -> KnownFriction {
        let known = self
            .facts
            .connected_device()
            .and_then(|device| self.frictions.known(device.connection));
        known.unwrap_or_default()
    }

    /// What it takes up: by an option, else as it was identified, else as its commissioning found it, else the default.
    /// `found` is what its commissioning has just found, where it has.
    fn own_friction(&self, found: Option<Findings>) -> OwnFriction {
        let identified = self.friction().identified();
        let commissioned = || self.commissioned().map(|(findings, _)| findings);
        let found = found.or_else(commissioned).unwrap_or_default();
        let (options, default) = (self.facts.friction, self.facts.servo.get().losses);
        let losses = identified.map(|friction| friction.losses());
        let choose = |option: Option<f64>, identified: Option<f64>, found: Option<f64>, default| {
            let sources = [
                (option, LossSource::Option),
                (identified, LossSource::Identified),
                (found, LossSource::Commissioned),
            ];
            let known = sources.into_iter().find_map(|(value, source)| Some((value?, source)));
            known.unwrap_or((default, LossSource::Default))
        };
        let (damping, damping_from) = choose(
            options.damping_ns_per_m,
            losses.map(|losses| losses.damping),
            None,
            default.damping,
        );
        let (friction, friction_from) = choose(
            options.friction_n,
            losses.map(|losses| losses.friction),
            found.friction_n,
            default.friction,
        );
        let compensated = options.compensate.zip(identified);
        let mass_kg = self.facts.rig.mass.or(identified.map(|friction| friction.mass));
        let is_mass_found = mass_kg.is_none();
        let worst = WorstPlaces {
            friction_n: found
                .worst
                .friction_n
                .filter(|_| friction_from == LossSource::Commissioned),
            lightest_kg: found.worst.lightest_kg.filter(|_| is_mass_found),
            heaviest_kg: found.worst.heaviest_kg.filter(|_| is_mass_found),
        };
        OwnFriction {
            losses: RigLosses { damping, friction },
            damping_from,
            friction_from,
            identified,
            compensation: compensated.map(|(share, friction)| Compensation { share, friction }),
            mass_kg: mass_kg.or(found.mass_kg),
            worst,
        }
    }

    /// What the loop gets to know of it.
    pub(in crate::control) fn setup(&self) -> RigSetup {
        let own = self.own_friction(None);
        RigSetup {
            losses: own.losses,
            compensation: own.compensation,
        }
    }

    /// The adviser's facts: what is compensated is not taken up. With them, where they come from, for people: the
    /// link's are measured, and change from one look to the next.
    pub(in crate::control) fn advice_basis(&self) -> (RigFacts, AdviceBasis) {
        let own = self.own_friction(None);
        let left = own
            .compensation
            .map_or(own.losses, |compensation| compensation.left_of(own.losses));
        let facts = RigFacts {
            mass: own.mass_kg,
            damping: left.damping,
            friction: left.friction,
            ..self.facts.linked_facts()
        };
        let basis = AdviceBasis {
            period_us: facts.period_s * 1e6,
            sample_period_us: (facts.sample_period_s > 0.0).then_some(facts.sample_period_s * 1e6),
            delay_us: facts.delay_s * 1e6,
            delay_measured: self.facts.is_delay_measured(),
            mass_kg: facts.mass,
            damping_ns_per_m: facts.damping,
            friction_n: facts.friction,
            damping_from: own.damping_from,
            friction_from: own.friction_from,
            compensated_share: own.compensated_share(),
            resolution_m: facts.resolution,
            heaviest_mass_kg: own.worst.heaviest_kg.map(|worst| worst.value),
            mass_at: own.worst.lightest_kg.and_then(|worst| self.place(worst)),
            friction_at: own.worst.friction_n.and_then(|worst| self.place(worst)),
            resolution_at: self.coarsest_step().and_then(|worst| self.place(worst)),
        };
        (facts, basis)
    }

    /// Where one count of an encoder moves the hand farthest, on a rig of two axes.
    fn coarsest_step(&self) -> Option<Worst> {
        let kinematics = self.facts.kinematics?;
        let counts = match &self.facts.link {
            Some(_) => self.facts.linked_device()?.motors?.counts,
            // Both motors of a rig in this process count alike.
            None => [1.0; 2],
        };
        Some(kinematics.coarsest_step(counts))
    }

    /// It for people; the place is left out where it is so everywhere.
    fn place(&self, worst: Worst) -> Option<WorstPlace> {
        let is_somewhere = self.facts.kinematics?.are_rotary();
        let at = |metres: f64| is_somewhere.then_some(metres);
        Some(WorstPlace {
            x_m: at(worst.position.x),
            y_m: at(worst.position.y),
            // A direction and its opposite are one.
            direction_deg: (worst.direction.y / worst.direction.x).atan().to_degrees(),
        })
    }

    /// It for a trial of a scene: its own friction stays, and what is compensated of it is given back. `found` is what
    /// its commissioning has just found, where it has.
    pub(in crate::control) fn trial_basis(&self, found: Option<Findings>) -> TrialBasis {
        let own = self.own_friction(found);
        let friction_n = match own.identified {
            Some(friction) if own.friction_from == LossSource::Identified => friction.dynamic_force,
            _ => Directional::both(own.losses.friction),
        };
        let link = self.facts.linked_facts();
        // A round trip that is measured anew each time is no other rig.
        let grain_s = DELAY_GRAIN * link.effective_period_s();
        TrialBasis {
            rig: TrialRig {
                settings: Settings {
                    losses: own.losses,
                    compensation: own.compensation,
                    ..self.facts.servo.get()
                },
                scheme: self.facts.scheme,
                force_limit_n: self.facts.force_limit().0,
                sample_period_s: link.sample_period_s,
                delay_s: (self.facts.steady_delay_s() / grain_s).ceil() * grain_s,
                resolution_m: link.resolution,
                mass_kg: own.mass_kg.unwrap_or(LIGHT_RIG_KG),
                friction_n,
                damping_ns_per_m: own.losses.damping,
            },
            assumed_mass_kg: own.mass_kg.is_none().then_some(LIGHT_RIG_KG),
            is_plane: self.facts.is_plane(),
            lightest_at: own.worst.lightest_kg.and_then(|worst| self.place(worst)),
        }
    }

    /// What is known of its friction, and what is done with it.
    pub(in crate::control) fn friction_status(&self) -> RigFrictionStatus {
        let own = self.own_friction(None);
        RigFrictionStatus {
            friction_n: own.losses.friction,
            friction_from: own.friction_from,
            damping_ns_per_m: own.losses.damping,
            damping_from: own.damping_from,
            identified: own.identified,
            compensated_share: own.compensated_share(),
            problem: self.friction().problem().map(str::to_owned),
        }
    }

    /// Reads what the files have of a device.
    async fn read(&self, device: &DeviceInfo) {
        let before = self.frictions.known(device.connection);
        // What its commissioning found is used as well.
        drop(self.records.known(device, true).await);
        let known = self.frictions.of(device).await;
        if let Some(why) = known.problem()
            && before.as_ref() != Some(&known)
        {
            crate::say(&format!("the rig's own friction is not used: {why}"));
        }
    }
}

/// Reads what is known of each rig that is plugged in, and has a scene suit it that leaves its coupling to the rig.
pub(crate) async fn watch(rig: &RigHandle) {
    let mut pause = every(WATCH_PERIOD);
    let mut connected: Option<(u64, Instant)> = None;
    loop {
        pause.tick().await;
        let Some(device) = rig.facts.connected_device() else {
            continue;
        };
        match connected {
            Some((connection, since)) if connection == device.connection => {
                if since.elapsed() >= SETTLING {
                    change::suit_the_rig(rig);
                }
            }
            _ => connected = Some((device.connection, Instant::now())),
        }
        match rig.known.frictions.known(device.connection) {
            None => {}
            Some(KnownFriction::Unread(_)) => tokio::time::sleep(RETRY_PERIOD).await,
            Some(_) => continue,
        }
        rig.known.read(&device).await;
    }
}

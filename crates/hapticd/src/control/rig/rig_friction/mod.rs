//! The friction of the connected rig itself, as far as it was identified: read when the rig is
//! plugged in, and kept until another one is. The loop gets it with each command to engage.

mod losses;
pub(in crate::control) mod record;

pub(crate) use losses::watch;
pub(in crate::control) use losses::{
    TrialBasis, advice_basis, commissioned_coupling, coupling, rig_facts, setup, status, trial_basis,
};

//! Default values that several laws share: the paper's forces, and those of the ready scenes.

/// `Fs`, N.
pub(super) const STATIC_FORCE: f64 = 4.0;

/// `Fd`, N.
pub(super) const DYNAMIC_FORCE: f64 = 3.5;

/// `Kp`, N/m: as stiff as small rigs render without buzzing. On the device Karnopp's law has it
/// unless a scene says otherwise.
pub const DEFAULT_CONTACT_STIFFNESS: f64 = 5000.0;

/// `sigma1`, N s/m: as much as keeps a bristle of this stiffness from ringing under half a
/// kilogram.
pub(super) const CONTACT_DAMPING: f64 = 10.0;

/// `ws`, m/s: that of the ready scene with LuGre friction.
pub(super) const STRIBECK_VELOCITY_MPS: f64 = 0.01;

/// `zba` and `zs`.
pub(super) const ELASTIC_FRACTION: f64 = 0.7;

/// [`ELASTIC_FRACTION`], as serde asks for a default.
#[cfg(feature = "serde")]
pub(super) fn elastic_fraction() -> f64 {
    ELASTIC_FRACTION
}

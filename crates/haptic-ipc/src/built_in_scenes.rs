//! The scenes that every library has.

/// The scenes that every library has: names, and the TOML of each.
pub const BUILT_IN_SCENES: &[(&str, &str)] = &[
    (
        "simulated-friction",
        include_str!("../../../scenes/simulated-friction.toml"),
    ),
    ("no-friction", include_str!("../../../scenes/no-friction.toml")),
    ("high-stiction", include_str!("../../../scenes/high-stiction.toml")),
    ("viscous-drag", include_str!("../../../scenes/viscous-drag.toml")),
    (
        "aluminium-on-teflon",
        include_str!("../../../scenes/aluminium-on-teflon.toml"),
    ),
    (
        "stuck-spring-on-the-device",
        include_str!("../../../scenes/stuck-spring-on-the-device.toml"),
    ),
    (
        "asymmetric-with-memory",
        include_str!("../../../scenes/asymmetric-with-memory.toml"),
    ),
    ("lugre", include_str!("../../../scenes/lugre.toml")),
    ("light-block", include_str!("../../../scenes/light-block.toml")),
];

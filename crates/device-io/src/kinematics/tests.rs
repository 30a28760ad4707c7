use super::*;
use proptest::prelude::*;
use std::sync::LazyLock;

/// The linkage of Haply's 2DIY, without a base as in its first generation, or with one, mm, in the largest usual
/// workspace.
fn haply(base_mm: f64) -> String {
    format!(
        "kinematics = 'five-bar'\nbase_m = {}\nproximal_m = 0.070\ndistal_m = 0.090\nhome_deg = [180.0, 0.0]\n\
         workspace_m = {{ x = [-0.06, 0.06], y = [0.06, 0.13] }}\n",
        base_mm * 1e-3
    )
}

pub(crate) fn five_bar(base_mm: f64) -> Kinematics {
    Kinematics::from_toml(&haply(base_mm)).expect("a linkage")
}

/// One whose counts are its angles.
pub(crate) fn absolute_five_bar() -> Kinematics {
    Kinematics::from_toml(&haply(38.0).replace("home_deg = [180.0, 0.0]", "")).expect("a linkage")
}

/// The linear ones, and both linkages, which are surveyed once.
static ALL: LazyLock<[Kinematics; 4]> = LazyLock::new(|| {
    let linear = ["xy", "h-belt"].map(|name| name.parse().expect("kinematics"));
    [linear[0], linear[1], five_bar(0.0), five_bar(38.0)]
});

pub(super) fn pose(kinematics: &Kinematics, motors: [f64; 2]) -> Pose {
    match kinematics.reading(motors) {
        Reading::Position(pose) => pose,
        other => panic!("{kinematics} at {motors:?}: {other:?}"),
    }
}

fn refusal(text: &str) -> String {
    Kinematics::from_toml(text).expect_err(text).to_string()
}

fn plane(reach: std::ops::Range<f64>) -> impl Strategy<Value = Plane> {
    (reach.clone(), reach).prop_map(|(x, y)| Plane::new(x, y))
}

fn workspace() -> impl Strategy<Value = Plane> {
    (-0.06..0.06, 0.06..0.13).prop_map(|(x, y)| Plane::new(x, y))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn inverse_gives_the_motors_of_a_position(hand in workspace()) {
        for kinematics in *ALL {
            let motors = kinematics.motors(hand).expect("within reach");
            let there = pose(&kinematics, motors).position;
            prop_assert!((there - hand).length() < 1e-12, "{}: {:?} for {:?}", kinematics, there, hand);
            let again = kinematics.motors(there).expect("within reach");
            prop_assert!((0..2).all(|motor| (again[motor] - motors[motor]).abs() < 1e-9));
        }
    }

    // hazard: H38
    #[test]
    fn jacobian_is_the_derivative_of_the_position(hand in workspace(), rates in any::<[bool; 2]>()) {
        const STEP: f64 = 1e-6;
        let rates = rates.map(|forward| if forward { 1.0 } else { -0.3 });
        for kinematics in *ALL {
            let motors = kinematics.motors(hand).expect("within reach");
            let moved = |steps: f64| [0, 1].map(|motor| motors[motor] + steps * STEP * rates[motor]);
            let at = |steps: f64| pose(&kinematics, moved(steps)).position;
            let difference = (at(1.0) - at(-1.0)) * (0.5 / STEP);
            let velocity = pose(&kinematics, motors).jacobian.velocity(rates);
            // Rounding of a metre over the step, and its square.
            let apart = (difference - velocity).length();
            prop_assert!(apart < 1e-9, "{}: {:?} for {:?}", kinematics, velocity, difference);
        }
    }

    // hazard: H38
    #[test]
    fn motors_give_the_power_of_the_force(
        hand in workspace(),
        force in plane(-20.0..20.0),
        rates in plane(-10.0..10.0),
    ) {
        for kinematics in *ALL {
            let jacobian = pose(&kinematics, kinematics.motors(hand).expect("within reach")).jacobian;
            let efforts = jacobian.efforts(force);
            prop_assert!((jacobian.force(efforts) - force).length() < 1e-9, "{}", kinematics);
            let motor_power = efforts[0] * rates.x + efforts[1] * rates.y;
            let hand_power = force.dot(jacobian.velocity([rates.x, rates.y]));
            let error = (motor_power - hand_power).abs() / (force.length() * rates.length());
            prop_assert!(error <= 1e-12, "{}: {} W for {} W", kinematics, motor_power, hand_power);
        }
    }

    #[test]
    fn motors_give_the_least_force_everywhere(
        hand in workspace(),
        turn in 0.0..6.3_f64,
        limits in (0.1..2.0, 0.1..2.0),
    ) {
        for kinematics in *ALL {
            let limits: [f64; 2] = limits.into();
            let force_n = kinematics.force_limit_n(limits);
            let jacobian = pose(&kinematics, kinematics.motors(hand).expect("within reach")).jacobian;
            let efforts = jacobian.efforts(Plane::new(turn.cos(), turn.sin()) * force_n);
            // Between two places of the grid a motor may be asked for a little more.
            let is_given = (0..2).all(|motor| efforts[motor].abs() <= 1.01 * limits[motor]);
            prop_assert!(is_given, "{}: {:?}", kinematics, efforts);
        }
    }

    #[test]
    fn masses_lie_between_the_surveyed_ones_everywhere(hand in workspace(), inertias in (0.1..2.0, 0.1..2.0_f64)) {
        for kinematics in *ALL {
            let inertias = inertias.into();
            let [lightest, heaviest] = kinematics.masses_kg(inertias).map(|worst| worst.value);
            let jacobian = pose(&kinematics, kinematics.motors(hand).expect("within reach")).jacobian;
            let ([light, heavy], _) = jacobian.masses_kg(inertias);
            // Between two places of the grid a mass may lie a little beyond.
            let is_between = light >= 0.99 * lightest && heavy <= 1.01 * heaviest;
            prop_assert!(is_between, "{}: {} to {} of {} to {}", kinematics, light, heavy, lightest, heaviest);
        }
    }

    // hazard: H31
    #[test]
    fn cut_efforts_keep_the_direction_of_the_force(hand in workspace(), force in plane(-50.0..50.0)) {
        let limits = [0.3, 0.2];
        for kinematics in *ALL {
            let jacobian = pose(&kinematics, kinematics.motors(hand).expect("within reach")).jacobian;
            let wanted = jacobian.efforts(force);
            let (given, are_cut) = within_limits(wanted, limits);
            let is_beyond = (0..2).any(|motor| wanted[motor].abs() > limits[motor]);
            prop_assert_eq!(are_cut, is_beyond);
            prop_assert!((0..2).all(|motor| given[motor].abs() <= limits[motor] * (1.0 + f64::EPSILON)));
            prop_assert!((given[0] * wanted[1] - given[1] * wanted[0]).abs() < 1e-9);
            prop_assert!(given[0] * wanted[0] >= 0.0 && given[1] * wanted[1] >= 0.0);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn masses_turn_and_scale_with_the_linkage(
        first in plane(-1.0..1.0),
        second in plane(-1.0..1.0),
        turn in 0.0..6.3_f64,
        scale in 0.1..10.0_f64,
        inertias in (0.01..10.0, 0.01..10.0_f64),
        direction in 0.0..6.3_f64,
    ) {
        let jacobian = Jacobian { columns: [first, second] };
        let (least, largest) = jacobian.gains();
        prop_assume!(least > 0.05 * largest && largest > 0.1);
        let inertias = inertias.into();
        let ([lightest, heaviest], along) = jacobian.masses_kg(inertias);
        let (sin, cos) = turn.sin_cos();
        let turned = |vector: Plane| vector * cos + vector.turned_left() * sin;
        let other = Jacobian { columns: [first, second].map(|column| turned(column) * scale) };
        let (masses, there) = other.masses_kg(inertias);
        for (one, other) in [lightest, heaviest].into_iter().zip(masses) {
            prop_assert!((other * scale * scale / one - 1.0).abs() < 1e-9, "{} {}", one, other);
        }
        if heaviest > 1.01 * lightest {
            prop_assert!(there.cross(turned(along)).abs() < 1e-6, "{:?} {:?}", there, along);
        }
        // No direction is beyond both, and the lightest is one: the energy of the motors is that of the hand.
        let mass = |direction: Plane| {
            let travels = [0, 1].map(|motor| jacobian.force_of_motor(motor).dot(direction));
            inertias[0] * travels[0] * travels[0] + inertias[1] * travels[1] * travels[1]
        };
        let any = mass(Plane::new(direction.cos(), direction.sin()));
        prop_assert!(any > lightest * (1.0 - 1e-9) && any < heaviest * (1.0 + 1e-9), "{}", any);
        prop_assert!((mass(along) / lightest - 1.0).abs() < 1e-6, "{} {}", mass(along), lightest);
    }
}

#[test]
fn worst_place_is_on_the_edge_that_the_hand_reaches_farthest() {
    let kinematics = five_bar(38.0);
    let [friction, step] = [
        kinematics.least_force([0.01, 0.02]),
        kinematics.coarsest_step([1e-3, 2e-3]),
    ];
    // The motors mirror each other, so the one that counts for more is worst where the other would be mirrored.
    assert!((friction.value - 0.01 * kinematics.force_limit_n([1.0; 2])).abs() < 1e-12);
    assert!((step.value * friction.value - 2e-3 * 0.01).abs() < 1e-12);
    assert!(
        (friction.position.x + step.position.x).abs() < 1e-9 && (friction.position.y - step.position.y).abs() < 1e-9
    );
    for (worst, motor) in [(friction, 0), (step, 1)] {
        let jacobian = pose(&kinematics, kinematics.motors(worst.position).expect("within reach")).jacobian;
        let along = jacobian.column(motor) * (1.0 / jacobian.column(motor).length());
        assert!((along - worst.direction).length() < 1e-12, "{worst:?}");
    }
}

#[test]
fn belt_adds_and_subtracts_its_motors() {
    let belt: Kinematics = "h-belt".parse().expect("kinematics");
    let pose = pose(&belt, [0.03, 0.01]);
    assert!((pose.position - Plane::new(0.02, 0.01)).length() < 1e-15);
    assert_eq!(pose.jacobian.efforts(Plane::new(2.0, 1.0)), [1.5, 0.5]);
    assert!(!belt.are_rotary() && belt.home().is_none() && belt.inside(Plane::new(9.0, 9.0)));
    // One motor alone gives 1 N along its own diagonal with 0.707 N.
    assert!((belt.force_limit_n([1.0, 1.0]) - std::f64::consts::SQRT_2).abs() < 1e-12);
}

/// The figures of the design, which an independent program found too.
#[test]
fn haplys_workspace_is_held_firmly() {
    for (base_mm, condition, least, force_n) in [(0.0, 2.341, 0.0424, 12.85), (38.0, 2.521, 0.0371, 13.37)] {
        let kinematics = five_bar(base_mm);
        let gains = workspace::grid(kinematics.surveyed()).map(|hand| {
            let motors = kinematics.motors(hand).expect("within reach");
            pose(&kinematics, motors).jacobian.gains()
        });
        let (worst, smallest) = gains.fold((1.0_f64, f64::INFINITY), |(worst, smallest), (least, largest)| {
            (worst.max(largest / least), smallest.min(least))
        });
        let is_firm = (worst - condition).abs() < 1e-3 && (smallest - least).abs() < 1e-4;
        assert!(is_firm, "{worst} {smallest}");
        let limit_n = kinematics.force_limit_n([1.0, 1.0]);
        assert!((limit_n - force_n).abs() < 0.01, "{kinematics}");
        // One of 4096 counts a turn, in the coarser of its motors.
        let count_rad = std::f64::consts::TAU / 4096.0;
        assert!((kinematics.coarsest_step([0.0, count_rad]).value - count_rad / force_n).abs() < 1e-7);
        assert!(kinematics.inside(Plane::new(0.06, 0.13)) && !kinematics.inside(Plane::new(0.06, 0.1301)));
        assert_eq!(kinematics.home(), Some([std::f64::consts::PI, 0.0]));
    }
}

// hazard: H37
#[test]
fn links_that_cannot_close_have_no_position() {
    // Both elbows outside, on a base of 60 mm: 200 mm apart, and the distal links reach 180 mm.
    let wide = haply(60.0)
        .replace("home_deg = [180.0, 0.0]", "")
        .replace("y = [0.06,", "y = [0.07,");
    let kinematics = Kinematics::from_toml(&wide).expect("a linkage");
    assert_eq!(kinematics.reading([std::f64::consts::PI, 0.0]), Reading::CannotClose);
    assert_eq!(kinematics.reading([f64::NAN, 0.0]), Reading::CannotClose);
    // Both elbows at one point.
    assert_eq!(five_bar(0.0).reading([1.0, 1.0]), Reading::CannotClose);
    assert_eq!(kinematics.motors(Plane::new(0.0, 0.2)), None, "too far");
}

#[test]
fn a_singular_pose_is_named_as_one() {
    let kinematics = five_bar(38.0);
    // The home pose: the distal links are nearly stretched.
    let Reading::Singular(pose) = kinematics.reading([std::f64::consts::PI, 0.0]) else {
        panic!("it is regular");
    };
    let height_m = (0.09_f64.powi(2) - 0.089_f64.powi(2)).sqrt();
    assert!((pose.position - Plane::new(0.0, height_m)).length() < 1e-12, "{pose:?}");
}

// hazard: H37
#[test]
fn a_singular_workspace_is_refused_with_the_worst_place() {
    for (base_mm, y, at, gain, least) in [
        (38.0, "[0.02, 0.13]", "0.0180 m, y = 0.0200 m", 0.9, 17.5),
        (0.0, "[0.06, 0.146]", "0.0600 m, y = 0.1460 m", 16.3, 27.9),
    ] {
        let error = refusal(&haply(base_mm).replace("[0.06, 0.13]", y));
        let moves = format!("{gain} mm/rad in the worst direction and must move at least {least} mm/rad");
        assert!(error.contains(&format!("{at}: the hand moves {moves}")), "{error}");
    }
    let error = refusal(&haply(0.0).replace("y = [0.06, 0.13]", "y = [0.06, 0.2]"));
    assert!(error.contains("do not reach x = -0.0600 m"), "{error}");
}

#[test]
fn a_wrong_file_is_refused_by_field_value_and_limit() {
    let text = haply(38.0);
    // In the place of the line of the same field, or without that.
    let with = |line: &str| {
        let field = line.split(' ').next().expect("a field");
        let others = text.lines().filter(|other| !other.starts_with(field));
        let lines: Vec<&str> = others.chain(line.contains('=').then_some(line)).collect();
        refusal(&lines.join("\n"))
    };
    for (line, expected) in [
        (
            "kinematics = 'six-bar'",
            "unknown variant `six-bar`, expected one of `xy`, `h-belt`, `five-bar`",
        ),
        (
            "base_m = 1.5",
            "base_m = 1.5 m is out of range: it must be from 0 to 1 m",
        ),
        (
            "proximal_m = 0",
            "proximal_m = 0 m is out of range: it must be from 0.005 to 1 m",
        ),
        ("distal_m = nan", "distal_m = NaN m is out of range"),
        ("distal_m", "`distal_m` is missing"),
        ("home_deg = [180.0, 400.0]", "home_deg = 400 deg is out of range"),
        ("home_deg = [180.0]", "home_deg"),
        (
            "home_deg = [0.0, 180.0]",
            "home_deg = [0, 180] deg: the links do not close there with the elbows outside",
        ),
        ("home_deg = [0.0, 90.0]", "[0, 90] deg: the links do not close"),
        (
            "workspace_m = { x = [-0.06, 0.06], y = [0.13, 0.06] }",
            "workspace_m.y = [0.13, 0.06] m: the second end must be at least 0.002 m",
        ),
        (
            "workspace_m = { x = [-6, 0.06], y = [0.06, 0.13] }",
            "workspace_m.x = -6 m is out of range: it must be from -1 to 1 m",
        ),
        ("bass_m = 0.038", "unknown field `bass_m`"),
    ] {
        let error = with(line);
        assert!(error.contains(expected), "{line}: {error}");
    }
    assert_eq!(
        refusal("kinematics = 'xy'\nbase_m = 0.1"),
        "`base_m` belongs to a five-bar"
    );
    let text = haply(0.0);
    let (lengths, _) = text.split_once("workspace_m").expect("it is there");
    assert_eq!(refusal(lengths), "`workspace_m` is missing: a five-bar needs it");
}

#[test]
fn the_pages_example_is_a_linkage() {
    let page = include_str!("../../../../docs/reference/kinematics.md");
    let (_, rest) = page.split_once("```toml\n").expect("its place");
    let (example, _) = rest.split_once("```").expect("its end");
    assert_eq!(Kinematics::from_toml(example), Ok(five_bar(38.0)));
}

#[test]
fn a_choice_is_a_name_or_a_file() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("haply.toml");
    std::fs::write(&path, haply(38.0)).expect("written");
    let choice = path.to_str().expect("a path");
    assert_eq!(choice.parse(), Ok(five_bar(38.0)));
    let text = "kinematics = 'xy'\nworkspace_m = { x = [-0.1, 0.1], y = [0, 0.1] }";
    std::fs::write(&path, text).expect("written");
    let gantry: Kinematics = choice.parse().expect("kinematics");
    assert!(!gantry.inside(Plane::new(0.0, -0.01)) && gantry.inside(Plane::new(0.0, 0.05)));
    let error = "five-bar".parse::<Kinematics>().expect_err("no file");
    let begin = "kinematics five-bar: neither xy nor h-belt, and as a file it cannot be read";
    assert!(error.starts_with(begin), "{error}");
}

//! The advice: warnings beside the parameters, their fixes, and the table of all checks.

use crate::bench::{Hands as _, Panel, answer, asked, connected, hear, press, refuse, set, value_of};
use crate::scene::informed;
use egui_kittest::kittest::Queryable;
use haptic_core::Scene;
use haptic_core::adviser::stick_slip;
use haptic_ipc::{Advice, AdviceReply, ChangeReply, ErrorCode, Finding, RigState};
use haptic_panel::{Answer, Update};

/// A check of the stiffness, of 25000 N/m in the paper's scene; broken when the bound is below that.
pub(crate) fn check(name: &str, bound: f64, mending: Option<f64>) -> Advice {
    let passes = bound >= 25_000.0;
    let finding = Finding {
        check: name.into(),
        passes,
        value: Some(25_000.0),
        bound: Some(bound),
        unit: "N/m".into(),
        margin: Some(bound / 25_000.0),
        mending: mending.filter(|_| !passes),
    };
    Advice {
        param: "stiffness".into(),
        message: format!("25000 N/m is held against {bound} N/m"),
        finding: Some(finding),
    }
}

pub(crate) fn advised(revision: u64, advice: Vec<Advice>) -> Update {
    Update::Advised(Ok(AdviceReply {
        revision,
        advice,
        basis: None,
    }))
}

#[test]
fn a_broken_bound_is_shown_and_fixed_by_a_button() {
    let mut panel = connected(RigState::Engaged);
    let advice = vec![
        check("friction", 16_000.0, Some(16_000.0)),
        check("encoder", 160_000.0, None),
    ];
    let before = panel.get_by_label("mass value").rect();
    hear(&mut panel, advised(1, advice));
    let line = panel.get_by_label("Stability: 1 of 2 bounds broken").rect();
    assert!(line.bottom() < before.top(), "above the list that scrolls");
    assert_eq!(panel.get_by_label("mass value").rect(), before, "and it moves nothing");
    press(&mut panel, "Friction: stiffness 25000, bound 16000 N/m");
    panel.get_by_label("25000 N/m is held against 16000 N/m");
    assert!(
        panel.query_by_label_contains("160000").is_none(),
        "a bound that is kept is no warning"
    );
    press(&mut panel, "set stiffness to 16000 N/m");
    assert_eq!(asked(&mut panel), [set("stiffness", 16_000.0)]);
    assert_eq!(value_of(&panel, "stiffness value"), "16000", "wanted, not active yet");

    let refusal = "stiffness = 16000 N/m is refused";
    refuse(&mut panel, set("stiffness", 16_000.0), ErrorCode::OutOfRange, refusal);
    panel.get_by_label(refusal);
    assert_eq!(value_of(&panel, "stiffness value"), "25000");
}

#[test]
fn several_broken_bounds_are_one_line_that_opens() {
    let mut panel = connected(RigState::Engaged);
    let advice = vec![
        check("passivity", 100.0, None),
        check("linear_stability", 20_000.0, Some(20_000.0)),
        check("friction", 16_000.0, Some(16_000.0)),
    ];
    hear(&mut panel, advised(1, advice));
    assert!(panel.query_by_label_contains("is held against").is_none());
    panel.get_by_label("set stiffness to 16000 N/m");
    assert!(
        panel.query_by_label("set stiffness to 20000 N/m").is_none(),
        "the strictest one only"
    );
    press(&mut panel, "3 bounds broken");
    assert_eq!(panel.get_all_by_label_contains("is held against").count(), 3);
    press(&mut panel, "set stiffness to 20000 N/m");
    assert_eq!(asked(&mut panel), [set("stiffness", 20_000.0)]);
}

#[test]
fn a_remark_on_a_change_is_shown_beside_its_parameter() {
    let mut panel = connected(RigState::Engaged);
    let message = "static_force+ = 3 N is below the dynamic force of 3.5 N";
    let remark = Advice {
        param: "static_force+".into(),
        message: message.into(),
        finding: None,
    };
    let reply = ChangeReply {
        revision: 2,
        changed: true,
        tick: Some(321),
        applied: [("stiffness".to_owned(), 25_000.0)].into(),
        advice: vec![remark],
        ..ChangeReply::default()
    };
    answer(&mut panel, set("stiffness", 25_000.0), Answer::Changed(reply));
    let below = panel.get_by_label(message).rect().top();
    assert!(panel.get_by_label("static force slider").rect().bottom() <= below);
    assert!(below < panel.get_by_label("dynamic force slider").rect().top());
    let table = panel.query_by_label_contains("Stability");
    assert!(table.is_none(), "what it does not say may be kept or broken");
}

#[test]
fn every_check_is_in_a_table_at_the_end_of_the_scene() {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label_contains("Stability").is_none());
    let width = |panel: &Panel| panel.get_by_label("mass slider").rect().width();
    let before = width(&panel);
    let advice = vec![
        check("linear_stability", 20_000.0, Some(20_000.0)),
        check("encoder", 160_000.0, None),
    ];
    hear(&mut panel, advised(1, advice));
    press(&mut panel, "Stability: 1 of 2 bounds broken");
    for text in [
        "Linear stability",
        "20000 N/m",
        "0.80 broken",
        "Encoder",
        "160000 N/m",
        "6.40",
    ] {
        panel.get_by_label(text);
    }
    assert_eq!(
        panel.query_all_by_label("stiffness 25000").count(),
        2,
        "what the value is of"
    );
    let mut wide = check("encoder", 160_000.0, None);
    let finding = wide.finding.as_mut().expect("it has one");
    (finding.value, finding.margin) = (Some(123_456_789_012.0), Some(123_456_789_012.0));
    hear(&mut panel, advised(1, vec![wide]));
    panel.get_by_label("Margin");
    assert_eq!(width(&panel), before, "the table widens nothing");
    let mut without_limit = check("encoder", 160_000.0, None);
    let finding = without_limit.finding.as_mut().unwrap();
    (finding.bound, finding.margin) = (None, None);
    hear(&mut panel, advised(1, vec![without_limit]));
    assert_eq!(panel.query_all_by_label("∞").count(), 2);
    panel.get_by_label("Stability: the bound is kept");
}

#[test]
fn stick_slip_at_some_speeds_stands_below_the_checks() {
    let mut panel = informed();
    hear(&mut panel, advised(1, vec![check("encoder", 160_000.0, None)]));
    press(&mut panel, "Stability: the bound is kept");
    let found = stick_slip(&Scene::paper(), 1e-3)
        .expect("reckoned")
        .expect("stick-slip");
    panel.get_by_label_contains(&format!("Stick-slip: {:.1} Hz at 1 mm/s, ", found.frequency_hz));
    panel.get_by_label_contains("none at 100 mm/s");
}

#[test]
fn fix_sets_its_direction_and_a_refused_one_of_both_is_shown() {
    let mut panel = connected(RigState::Engaged);
    panel.click_on("viscous by direction");
    for param in ["viscous-", "viscous"] {
        let mut advice = check("friction_passivity", 2.0, Some(2.0));
        advice.param = param.into();
        hear(&mut panel, advised(1, vec![advice]));
        press(&mut panel, &format!("set {param} to 2 N s/m"));
        let asked: Vec<_> = asked(&mut panel).iter().map(ToString::to_string).collect();
        assert_eq!(asked, [format!("set {param} = 2")]);
    }
    refuse(
        &mut panel,
        set("viscous", 2.0),
        ErrorCode::OutOfRange,
        "viscous is refused",
    );
    panel.get_by_label("viscous is refused");
}

//! The hand on a fake rig: the strip on which it is moved, and the rig that the panel starts.

use crate::bench::{Panel, asked, at_page, connected, hear, lose_the_daemon, panel, press, refuse, sample, wait};
use crate::plots::feel;
use crate::rig::status;
use egui::vec2;
use egui_kittest::kittest::Queryable;
use haptic_ipc::socket_path::NamedSocket;
use haptic_ipc::{ErrorCode, Request, RigState};
use haptic_panel::{Intent, Page, Update};
use std::path::PathBuf;
use std::time::Duration;

/// A panel whose rig has a hand to be moved, and has it held back by 3.5 N.
fn with_hand() -> Panel {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label("hand").is_none(), "a person holds the rig");
    let mut status = status();
    status.device.takes_hand = true;
    hear(&mut panel, Update::Status(Ok(Box::new(status))));
    feel(&mut panel, &[sample(1.0)]);
    panel
}

/// The targets of the hand, m.
fn targets(panel: &mut Panel) -> Vec<f64> {
    let targets = asked(panel).into_iter().map(|intent| match intent {
        Intent::Hand { target_m } => target_m,
        other => panic!("{other}"),
    });
    targets.collect()
}

#[test]
fn a_drag_on_the_strip_moves_the_hand_until_it_is_let_go() {
    for page in [Page::Tune, Page::Task, Page::Perception] {
        let mut panel = at_page(with_hand(), page);
        panel.get_by_label("Force on the hand -3.5 N; drag here to pull the handle");
        let strip = panel.get_by_label("hand").rect();
        let at = |target_m: f32| strip.center() + vec2(strip.width() / 2.0 / 0.06 * target_m, 0.0);
        panel.hover_at(at(0.02));
        panel.run();
        assert_eq!(asked(&mut panel), [], "{page:?}: it is pressed, not pointed at");
        panel.drag_at(at(0.02));
        panel.run();
        panel.hover_at(at(-0.03));
        panel.run();
        let moved = targets(&mut panel);
        assert!((moved[0] - 0.02).abs() < 1e-4, "{page:?}: {moved:?}");
        assert!((moved[moved.len() - 1] + 0.03).abs() < 1e-4, "{page:?}: {moved:?}");
        // A pointer that rests is news as well, in time.
        let next = panel.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
        assert!(next <= Duration::from_millis(34), "{page:?}: {next:?}");
        wait(&mut panel, 1.0);
        assert!(targets(&mut panel).len() > 2, "{page:?}");
        panel.hover_at(at(0.9));
        panel.run();
        assert_eq!(targets(&mut panel).last(), Some(&0.06), "{page:?}: the strip's end");
        panel.drop_at(at(0.9));
        panel.run();
        asked(&mut panel);
        wait(&mut panel, 0.3);
        assert_eq!(asked(&mut panel), [], "{page:?}: the arm lets go");
    }
    let asked = Intent::Hand { target_m: 0.02 }.request();
    assert_eq!(asked, Some(Request::Hand { target_m: 0.02 }));
}

#[test]
fn handle_beyond_the_strip_has_its_place_in_words() {
    let mut panel = with_hand();
    let mut far = sample(1.1);
    far.device_position_m = -0.115;
    feel(&mut panel, &[far]);
    panel.get_by_label_contains("the handle is at -115 mm, beyond this strip");
}

#[test]
fn a_refused_hand_is_shown_and_a_lost_rig_takes_none() {
    let mut panel = with_hand();
    refuse(
        &mut panel,
        Intent::Hand { target_m: 0.0 },
        ErrorCode::HandHeld,
        "ada moves the hand",
    );
    panel.get_by_label("Refused: ada moves the hand");
    let at = panel.get_by_label("hand").rect().center();
    panel.drag_at(at);
    panel.run();
    panel.get_by_label("Force on the hand -3.5 N");
    panel.drop_at(at);
    panel.run();
    lose_the_daemon(&mut panel);
    asked(&mut panel);
    panel.drag_at(at);
    panel.run();
    assert_eq!(asked(&mut panel), [], "nobody hears it");
}

#[test]
fn a_panel_without_a_daemon_offers_a_fake_rig_and_others() {
    let mut panel = panel();
    assert!(panel.query_by_label("Start the fake rig").is_none(), "it still looks");
    lose_the_daemon(&mut panel);
    assert!(panel.query_by_label("Other rigs of this machine:").is_none());
    let path = PathBuf::from("/run/hapticd@left/control.sock");
    let left = NamedSocket {
        name: "left".into(),
        path: path.clone(),
    };
    hear(&mut panel, Update::Rigs(vec![left]));
    asked(&mut panel);
    press(&mut panel, "Rig left");
    assert_eq!(asked(&mut panel), [Intent::ConnectTo { path }]);
    press(&mut panel, "Start the fake rig");
    assert_eq!(asked(&mut panel), [Intent::StartFakeRig]);
    assert_eq!(Intent::StartFakeRig.request(), None, "no daemon is asked");
    // Again, where it has ended.
    let mut panel = connected(RigState::Idle);
    lose_the_daemon(&mut panel);
    asked(&mut panel);
    press(&mut panel, "Start the fake rig");
    assert_eq!(asked(&mut panel), [Intent::StartFakeRig]);
}

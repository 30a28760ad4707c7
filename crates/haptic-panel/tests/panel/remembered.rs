//! What the panel remembers.

use crate::bench::{Hands as _, Panel, choose_item, connected, press, press_item};
use crate::plots::{feel, felt, rows};
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_ipc::RigState;
use haptic_panel::Settings;

fn settings(panel: &Panel) -> Settings {
    panel.state().model.settings()
}

#[test]
fn another_panel_takes_up_what_one_has_remembered() {
    let mut panel = felt(0..3000, |_| 1.0);
    press(&mut panel, "signals of the Velocity plot");
    press(&mut panel, "Remove plot");
    press(&mut panel, "signals of the Force plot");
    press_item(&mut panel, "Tick time");
    press(&mut panel, "zoom in");
    press_item(&mut panel, "Limits");
    press(&mut panel, "Histograms");
    press_item(&mut panel, "Force against velocity");
    choose_item(&mut panel, "vertical signal", "Device velocity");
    choose_item(&mut panel, "samples drawn", "All in sight");
    press_item(&mut panel, "Spectrum");
    choose_item(&mut panel, "signal of the spectrum", "Device position");
    press_item(&mut panel, "Power density");
    press(&mut panel, "Axes");
    press(&mut panel, "Fit position");
    panel.hit(egui::Key::Enter);
    let kept = settings(&panel);
    let plots = kept.rig_plots.clone().expect("plots");
    assert_eq!(plots[0], ["Force on the hand", "Tick time"]);
    assert_eq!(plots.len(), 2);
    let axes = kept.rig_axes.clone().expect("axes");
    assert_eq!((axes[0].len(), axes[1].len()), (0, 2));
    let against = kept.rig_against.clone().expect("signals");
    assert_eq!((&*against.up, &*against.extent), ("Device velocity", "All in sight"));
    assert_eq!(kept.shows_histograms, Some(true));
    assert_eq!(kept.spectrum_of.as_deref(), Some("Device position"));
    assert_ne!(kept, settings(&connected(RigState::Engaged)));

    let mut other = connected(RigState::Engaged);
    other.state_mut().model.restore(&kept);
    feel(&mut other, &rows(0..3000, |_| 1.0));
    assert_eq!(settings(&other), kept);
    assert!(other.query_by_label("Velocity plot").is_none());
    let seen_s = other.get_by_label("time seen").accesskit_node().numeric_value();
    assert_eq!(seen_s, kept.span_s);
}

#[test]
fn settings_that_no_panel_could_have_written_change_nothing() {
    let mut panel = connected(RigState::Engaged);
    let before = settings(&panel);
    let strange = Settings {
        folder: Some(String::new()),
        recording_format: Some("vhs".to_owned()),
        beside: Some("Over time".to_owned()),
        span_s: Some(f64::NAN),
        rig_plots: Some(vec![vec!["Smell".to_owned()]; 99]),
        ..Settings::default()
    };
    panel.state_mut().model.restore(&strange);
    feel(&mut panel, &rows(0..3000, |_| 1.0));
    let after = settings(&panel);
    let empty = after.rig_plots.clone().expect("plots");
    assert!(empty.len() <= 8 && empty.iter().all(Vec::is_empty), "{empty:?}");
    let but_for_plots = Settings {
        rig_plots: before.rig_plots.clone(),
        rig_axes: before.rig_axes.clone(),
        ..after
    };
    assert_eq!(but_for_plots, before);
    let far = Settings {
        span_s: Some(1e12),
        ..Settings::default()
    };
    panel.state_mut().model.restore(&far);
    assert_eq!(settings(&panel).span_s, Some(60.0), "no more is kept");
}

//! The rig: its state, its commands, its samples and its timing.

use crate::bench::{
    Hands as _, Panel, SOCKET, answer, asked, at_page, connected, greeted, hear, in_state, is_enabled, lose_the_daemon,
    lost, press, refuse, sample, state_event,
};
use crate::layout::counted;
use crate::legible::texts;
use crate::plots::{batch_of, feel, rows, timing};
use egui::epaint::TextShape;
use egui::{Key, Modifiers, ViewportCommand, ViewportEvent, ViewportId};
use egui_kittest::kittest::Queryable;
use haptic_ipc::{Bucket, ChangeReply, ErrorCode, Event, LinkStatus, Request, RigState, Sample, StateReply, WireError};
use haptic_panel::{Answer, Intent, Page, Update};
use std::ops::Range;
use std::time::Duration;

#[test]
fn the_rig_is_engaged_released_and_reset_by_buttons() {
    let mut panel = connected(RigState::Idle);
    panel.get_by_label(&format!("{SOCKET}, hapticd 0.1.0"));
    panel.click_on("Engage");
    hear(&mut panel, in_state(RigState::Engaged, 150));
    panel.click_on("Release");
    hear(&mut panel, in_state(RigState::Stopped, 200));
    panel.get_by_label("Stopped at tick 200");
    assert!(!is_enabled(&panel, "Engage"), "a stopped rig cannot be engaged");
    panel.click_on("Reset");
    assert_eq!(asked(&mut panel), [Intent::Engage, Intent::Release, Intent::Reset]);
}

// hazard: H26
#[test]
fn header_and_title_name_the_rig_that_stop_is_for() {
    let mut panel = connected(RigState::Engaged);
    for (socket, name) in [
        ("/run/hapticd@left/control.sock", "Rig left"),
        ("/srv/x.sock", "/srv/x.sock"),
    ] {
        panel.state_mut().model.apply(greeted(socket, "1-1"));
        panel.step();
        let titled = ViewportCommand::Title(format!("{name} - Haptic panel"));
        let commands = &panel.output().viewport_output[&ViewportId::ROOT].commands;
        assert!(commands.contains(&titled), "{commands:?}");
        panel.run();
        panel.get_by_label(&format!("{name}, hapticd 0.1.0"));
        hear(&mut panel, lost(socket));
        panel.get_by_label(name);
    }
}

// hazard: H27
#[test]
fn a_rig_that_may_be_another_is_confirmed_by_a_button() {
    let mut panel = connected(RigState::Idle);
    refuse(
        &mut panel,
        Intent::Engage,
        ErrorCode::MaybeAnotherRig,
        "it has no serial number",
    );
    panel.get_by_label("Refused: it has no serial number");
    panel.click_on("Same rig");
    assert_eq!(asked(&mut panel), [Intent::SameRig]);
    let reply = StateReply {
        state: RigState::Idle,
        tick: 200,
    };
    answer(&mut panel, Intent::SameRig, Answer::State(reply));
    assert!(panel.query_by_label("Same rig").is_none() && is_enabled(&panel, "Engage"));
}

// hazard: H30
#[test]
fn a_rig_that_would_chatter_is_engaged_anyway_by_a_button() {
    let mut panel = connected(RigState::Idle);
    let refused = |intent| Update::Answered {
        intent,
        result: Err(WireError::new(ErrorCode::WouldChatter, "125 times a second")),
    };
    hear(&mut panel, refused(Intent::Engage));
    panel.get_by_label("Refused: 125 times a second");
    panel.click_on("Anyway");
    let anyway = Intent::Anyway(Box::new(Intent::Engage));
    assert_eq!(anyway.request(), Some(Request::Engage { anyway: true }));
    assert!(anyway.is_void_after_stop());
    assert_eq!(asked(&mut panel), std::slice::from_ref(&anyway));
    let reply = StateReply {
        state: RigState::Engaging,
        tick: 200,
    };
    answer(&mut panel, anyway, Answer::State(reply));
    assert!(panel.query_by_label("Anyway").is_none());

    // A change of the scene under force: beside the revision, where Release stays where it is.
    hear(&mut panel, refused(Intent::Undo));
    assert!(is_enabled(&panel, "Release"));
    panel.click_on("Change anyway");
    assert_eq!(asked(&mut panel), [Intent::Anyway(Box::new(Intent::Undo))]);
    hear(&mut panel, refused(Intent::Engage));
    panel.get_by_label("Change anyway");
    answer(
        &mut panel,
        Intent::Anyway(Box::new(Intent::Undo)),
        Answer::Changed(ChangeReply::default()),
    );
    assert!(panel.query_by_label("Change anyway").is_none());
}

#[test]
fn nothing_is_drawn_while_nothing_is_new() {
    let mut panel = connected(RigState::Engaged);
    panel.run();
    let wait = |panel: &Panel| panel.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
    assert_eq!(wait(&panel), Duration::MAX);
    hear(&mut panel, Update::Exported(Ok("/tmp/plots/haptic-plot-1.svg".into())));
    panel.run();
    assert!(
        wait(&panel) > Duration::from_secs(1),
        "until it goes: {:?}",
        wait(&panel)
    );
}

#[test]
fn nothing_else_ever_stands_where_engage_does() {
    let states = [
        RigState::Disconnected,
        RigState::Idle,
        RigState::Engaging,
        RigState::Engaged,
        RigState::Releasing,
        RigState::Stopped,
        RigState::Faulted,
    ];
    let mut panel = connected(RigState::Idle);
    let engage = panel.get_by_label("Engage").rect();
    for (tick, state) in (200..).zip(states) {
        hear(&mut panel, in_state(state, tick));
        assert_eq!(panel.get_by_label("Engage").rect(), engage, "{state}");
        let others = ["Release", "Reset"].map(|label| panel.query_by_label(label));
        for other in others.into_iter().flatten() {
            assert!(!other.rect().intersects(engage), "{state}: {:?}", other.rect());
        }
    }
}

#[test]
fn beside_a_long_fault_the_outcome_of_a_stop_is_whole() {
    let mut panel = connected(RigState::Engaged);
    let pages = |panel: &Panel| panel.get_by_label("Tune page").rect();
    let before = pages(&panel);
    let mut event = state_event(RigState::Faulted, 200);
    event.fault = Some("control_lost: no stop could be received, ".repeat(8));
    hear(&mut panel, Update::Event(Event::State(event)));
    assert_eq!(pages(&panel), before, "nothing moves");
    panel.get_by_label("Reset");
    let outcome = panel.get_by_label_contains("Zero force since tick").rect();
    let fault = panel.get_by_label_contains("Fault: control_lost").rect();
    assert!(
        outcome.top() >= 0.0 && outcome.bottom() <= fault.top() + 1.0,
        "{outcome:?}, {fault:?}"
    );
    assert!(fault.bottom() <= before.top(), "{fault:?}, {before:?}");
}

#[test]
fn panel_without_daemon_names_socket_and_disables_controls() {
    let mut panel = connected(RigState::Engaged);
    lose_the_daemon(&mut panel);
    panel.get_by_label("Not connected");
    panel.get_by_label("Connection lost: the daemon closed the connection");
    panel.get_by_label_contains(SOCKET);
    panel.get_by_label_contains("is lost, and the rig's state is unknown");
    for widget in [
        "Engage",
        "Release",
        "mass value",
        "mass slider",
        "friction law",
        "Histograms",
    ] {
        assert!(!is_enabled(&panel, widget), "{widget}: there is nobody to ask");
    }
    panel.hit_with(Modifiers::COMMAND, Key::Z);
    assert_eq!(asked(&mut panel), []);
    panel.click_on("Stop");
    assert_eq!(asked(&mut panel), [Intent::Stop], "sent when the daemon is back");
    panel.get_by_label_contains("Stop NOT sent: no connection to the daemon. Cut the motor's power");
}

#[test]
fn newest_sample_is_shown_and_stale_values_are_grey() {
    let mut panel = connected(RigState::Engaged);
    let hear_rows = |panel: &mut Panel, ticks: Range<u32>, numbers: Range<u32>| {
        let of_device = |tick: u32| Sample {
            tick: tick.into(),
            device_sequence: tick.clamp(numbers.start, numbers.end),
            ..sample(f64::from(tick) / 250.0)
        };
        hear(panel, batch_of(ticks.map(of_device).collect()));
    };
    hear_rows(&mut panel, 1..1250, 1..1250);
    panel.get_by_label("-3.50");
    panel.get_by_label("12.34");
    panel.get_by_label("Force plot");
    panel.get_by_label("Position plot");
    hear(&mut panel, in_state(RigState::Faulted, 200));
    assert!(is_vivid(&panel, "12.34"), "its device still measures");
    hear_rows(&mut panel, 1250..1350, 1..1250);
    assert!(!is_vivid(&panel, "12.34"), "its device is silent");
    assert!(panel.query_by_label("Device position, last").is_none());
    hear_rows(&mut panel, 1350..1450, 1350..1450);
    assert!(is_vivid(&panel, "12.34"), "it measures again");
    hear(&mut panel, in_state(RigState::Disconnected, 200));
    panel.get_by_label("Device position, last");
    assert!(!is_vivid(&panel, "12.34"), "a stale position is grey");
    hear(&mut panel, in_state(RigState::Idle, 300));
    assert!(panel.query_by_label("Device position, last").is_none());
    assert!(is_vivid(&panel, "12.34"));
    lose_the_daemon(&mut panel);
    panel.get_by_label("Device position, last");
    assert!(!is_vivid(&panel, "12.34"));
}

/// A text as it is drawn.
fn drawn<'a>(panel: &'a Panel, text: &str) -> &'a TextShape {
    let mut texts = texts(panel).into_iter().map(|(_, shape)| shape);
    texts.find(|shape| shape.galley.text() == text).expect("it is drawn")
}

/// Whether a text is drawn in a colour instead of in grey.
fn is_vivid(panel: &Panel, text: &str) -> bool {
    let shape = drawn(panel, text);
    let color = match shape.galley.job.sections[0].format.color {
        egui::Color32::PLACEHOLDER => shape.fallback_color,
        color => color,
    };
    let [red, green, blue, _] = color.to_array();
    red.max(green).max(blue) - red.min(green).min(blue) > 40
}

/// The green of a rig with force on the hand.
const GREEN: egui::Color32 = egui::Color32::from_rgb(0x1c, 0x7a, 0x46);

/// Whether something is filled with a colour.
fn is_filled(panel: &Panel, color: egui::Color32) -> bool {
    let mut shapes = panel.output().shapes.iter();
    shapes.any(|shape| matches!(&shape.shape, egui::Shape::Rect(shape) if shape.fill == color))
}

/// The opacity of a text that has the usual colour.
fn opacity(panel: &Panel, text: &str) -> u8 {
    drawn(panel, text).fallback_color.a()
}

// hazard: H28
#[test]
fn a_daemon_without_samples_is_grey_on_every_page() {
    for page in Page::ALL {
        let mut panel = at_page(connected(RigState::Engaged), *page);
        feel(&mut panel, &rows(0..2000, |_| 1.0));
        hear(&mut panel, Update::Event(Event::Timing(Box::new(timing(Vec::new())))));
        let places = |panel: &Panel| ["Stop", "Tune page", "Overruns 0"].map(|label| panel.get_by_label(label).rect());
        let before = places(&panel);
        let is_live = |panel: &Panel| {
            let is_live = panel.query_by_label("Engaged").is_some();
            assert_eq!(is_filled(panel, GREEN), is_live, "{page:?}");
            assert_eq!(opacity(panel, "Overruns 0") == 255, is_live, "{page:?}");
            assert_eq!(is_enabled(panel, "Release"), is_live);
            assert_eq!(panel.query_by_label("Engaged, last").is_none(), is_live);
            assert_eq!(panel.query_by_label_contains("No sample for").is_none(), is_live);
            if *page == Page::Tune {
                assert_eq!(is_vivid(panel, "12.34"), is_live);
                assert_eq!(panel.query_by_label("Device position, last").is_none(), is_live);
            }
            is_live
        };
        assert!(is_live(&panel));
        hear(&mut panel, Update::NoSample(Duration::from_millis(2400)));
        assert!(!is_live(&panel), "{page:?}");
        panel.get_by_label_contains("No sample for 2.4 s");
        assert_eq!(places(&panel), before, "nothing moves");
        asked(&mut panel);
        panel.key_press(Key::Space);
        panel.step();
        assert_eq!(asked(&mut panel), [Intent::Stop], "it is still sent");
        hear(&mut panel, Update::NoSample(Duration::ZERO));
        assert!(is_live(&panel), "{page:?}: samples come again");
        hear(&mut panel, Update::NoSample(Duration::from_millis(300)));
        lose_the_daemon(&mut panel);
        assert!(panel.query_by_label_contains("No sample for").is_none());
        panel.get_by_label("Not connected");
        // Nobody knows any better than before.
        panel.get_by_label_contains("is lost, and the rig's state is unknown: if in doubt, cut the motor's power");
        assert!(opacity(&panel, "Overruns 0") < 255, "{page:?}");
    }
}

#[test]
fn the_scene_of_the_library_is_named_and_that_it_was_changed() {
    let mut panel = connected(RigState::Idle);
    for (name, changed, line, listed) in [
        ("paper", false, "Scene: paper (library)", "paper"),
        ("paper", true, "Scene: paper (library, changed)", "paper"),
        ("sticky", false, "Scene: paper (sticky)", "sticky"),
        ("sticky", true, "Scene: paper (sticky, changed)", "sticky"),
        // A name in the library is that of a file.
        ("wet-sand", false, "Scene: wet sand (library)", "wet sand"),
    ] {
        let mut event = state_event(RigState::Idle, 100);
        if name == "wet-sand" {
            event.scene = "wet sand".into();
        }
        hear(&mut panel, Update::Event(Event::State(event)));
        let name = name.to_owned();
        let mut status = status();
        status.library_scene = Some(haptic_ipc::LibraryScene { name, changed });
        hear(&mut panel, Update::Status(Ok(Box::new(status))));
        panel.get_by_label(line);
        assert_eq!(panel.get_by_label("scenes").value().as_deref(), Some(listed));
    }
}

#[test]
fn numbers_beyond_any_rig_do_no_harm() {
    let mut panel = connected(RigState::Engaged);
    let mut rows = Vec::new();
    for value in [f64::MAX, f64::NAN, f64::INFINITY, f64::MIN, 0.0] {
        let mut row = sample(1.0);
        row.command_force_n = value;
        row.device_position_m = value;
        rows.push(row);
    }
    rows.push(Sample {
        t_s: 1e300,
        ..sample(0.0)
    });
    hear(&mut panel, batch_of(rows));
    panel.get_by_label("Force plot");
}

#[test]
fn the_link_is_always_in_sight_and_says_why_there_is_no_rig() {
    let mut panel = connected(RigState::Idle);
    let mut waiting = timing(Vec::new());
    waiting.link = Some(LinkStatus {
        waiting: Some("/dev/ttyACM0 is not there".into()),
        ..LinkStatus::default()
    });
    hear(&mut panel, Update::Event(Event::Timing(Box::new(waiting))));
    panel.get_by_label("Link: /dev/ttyACM0 is not there");
    assert!(panel.query_by_label_contains("No rig:").is_none());
    hear(&mut panel, in_state(RigState::Disconnected, 200));
    panel.get_by_label("No rig: /dev/ttyACM0 is not there");
    hear(&mut panel, counted(7));
    for label in [
        "Link a rig with a long name 1.0",
        "Round trip 1.23 ms, longest 0.0 ms",
        "Lost 7",
        "Bad CRC 14",
        "Late 21",
        "Device clock -12.3 ppm",
    ] {
        panel.get_by_label(label);
    }
}

#[test]
fn histograms_and_clipping_are_shown() {
    let mut panel = connected(RigState::Engaged);
    let buckets = vec![Bucket { up_to: 1024, count: 7 }, Bucket { up_to: 2048, count: 1 }];
    hear(&mut panel, Update::Event(Event::Timing(Box::new(timing(buckets)))));
    assert!(panel.query_by_label("Wake-up histogram").is_none(), "they are folded");
    press(&mut panel, "Histograms");
    panel.get_by_label("Wake-up histogram");
    panel.get_by_label("Tick: half below 2.00 µs, 99 % below 9.00 µs, 99.9 % below 30.0 µs, longest 1.20 ms");
    // A fourth of the samples is at the limit of 20 N.
    let strong = rows(0..1000, |_| 0.0).into_iter().map(|mut row| {
        row.command_force_n = if row.tick < 250 { -20.0 } else { 3.0 };
        row
    });
    feel(&mut panel, &strong.collect::<Vec<_>>());
    hear(&mut panel, Update::Status(Ok(Box::new(status()))));
    panel.get_by_label("At the force limit 25.0 %");
}

#[test]
fn the_devices_own_settings_are_in_a_menu() {
    let mut panel = connected(RigState::Idle);
    press(&mut panel, "Rig");
    panel.get_by_label("The daemon has not described its rig yet");
    press(&mut panel, "Rig");
    let status = status();
    let limit = format!("{} N", status.device.force_limit_n);
    hear(&mut panel, Update::Status(Ok(Box::new(status))));
    press(&mut panel, "Rig");
    panel.get_by_label_contains(&limit);
}

pub(crate) fn status() -> haptic_ipc::Status {
    let text = r#"{"server":"hapticd 0.1.0","state":"engaged","tick":1,"uptime_s":1,"rate_hz":1000,"scheme":"exact",
        "velocity_estimator":"foaw","revision":1,"scene":"paper","command_force_N":0,"device_position_m":0,"clients":1,
        "device":{"description":"fake rig","force_limit_N":20},"real_time":{"memory_locked":true,"problems":[]}}"#;
    serde_json::from_str(text).expect("a status")
}

#[test]
fn a_window_that_is_closed_while_force_is_on_asks_first() {
    let commands = |panel: &Panel| panel.output().viewport_output[&ViewportId::ROOT].commands.clone();
    let close = |panel: &mut Panel| {
        let root = panel.input_mut().viewports.entry(ViewportId::ROOT).or_default();
        root.events.push(ViewportEvent::Close);
        panel.step();
    };
    let mut panel = connected(RigState::Idle);
    close(&mut panel);
    assert_eq!(commands(&panel), [], "nothing is on");
    let mut panel = connected(RigState::Engaged);
    close(&mut panel);
    assert_eq!(commands(&panel), [ViewportCommand::CancelClose]);
    panel.get_by_label("Stop");
    press(&mut panel, "Keep the window");
    assert!(panel.query_by_label("Release and close").is_none());
    close(&mut panel);
    press(&mut panel, "Release and close");
    assert_eq!(asked(&mut panel), [Intent::Release]);
    panel.get_by_label("The window closes when the force is off");
    panel.state_mut().model.apply(in_state(RigState::Idle, 300));
    panel.step();
    assert_eq!(commands(&panel), [ViewportCommand::Close]);
}

#[test]
fn the_theme_can_be_switched() {
    let mut panel = connected(RigState::Idle);
    let is_dark = |panel: &Panel| panel.ctx.global_style().visuals.dark_mode;
    let before = is_dark(&panel);
    press(&mut panel, "switch theme");
    assert_ne!(is_dark(&panel), before);
}

/// The red of both themes for what stops.
const RED: egui::Color32 = egui::Color32::from_rgb(0xc6, 0x28, 0x28);

#[test]
fn stop_is_red_in_both_themes_while_a_daemon_is_connected() {
    let is_red = |panel: &Panel| {
        let stop = panel.get_by_label("Stop").rect();
        let mut shapes = panel.output().shapes.iter();
        shapes.any(|shape| match &shape.shape {
            egui::Shape::Rect(drawn) => drawn.fill == RED && drawn.rect.expand(1.0).contains_rect(stop),
            _ => false,
        })
    };
    let mut panel = connected(RigState::Idle);
    for _ in 0..2 {
        let is_dark = panel.ctx.global_style().visuals.dark_mode;
        panel.state_mut().model.apply(greeted(SOCKET, "1-1"));
        panel.run();
        assert!(is_red(&panel), "dark: {is_dark}");
        lose_the_daemon(&mut panel);
        panel.get_by_label("Stop");
        assert!(!is_red(&panel), "dark: {is_dark}: it cannot reach the daemon");
        press(&mut panel, "switch theme");
        assert_ne!(panel.ctx.global_style().visuals.dark_mode, is_dark);
    }
}

//! Stops on the connection: always first, on a line of their own, and never reported as sent when
//! they are not.

use crate::daemon::{Bench, Daemon, HELLO, LIMIT, StopLine, connected, greet, introduced, is_stop};
use haptic_ipc::Request;
use haptic_panel::connection::Patience;
use haptic_panel::{Intent, StopNews, Update};
use std::io::{BufRead, BufReader};
use std::thread;
use std::time::Duration;

#[test]
fn stop_without_a_daemon_reaches_the_next_one_first() {
    let never = Duration::from_secs(3600);
    let bench = Bench::with_patience(Patience {
        retry: never,
        silence: LIMIT,
    });
    bench.until_lost();
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Stop);
    // Only the stop can have caused this attempt.
    bench.until_lost();
    let listener = bench.listen();
    bench.connection.send(Intent::Stop);
    let mut daemon = Daemon::accept(&listener);
    assert_eq!(daemon.hear().request, Request::Stop {});
    daemon.introduce();
}

#[test]
fn a_stop_that_was_not_answered_is_sent_again() {
    let (bench, listener, mut daemon) = introduced();
    bench.connection.send(Intent::Stop);
    assert_eq!(daemon.hear().request, Request::Stop {});
    drop(daemon);
    let mut daemon = Daemon::accept(&listener);
    let stop = daemon.hear();
    assert_eq!(stop.request, Request::Stop {});
    daemon.answer(stop.id, r#"{"state":"stopped","tick":9}"#);
    daemon.introduce();
    bench.until(|update| match update {
        Update::Stop(StopNews::Answered { result, .. }) => Some(result.unwrap()),
        _ => None,
    });
}

// hazard: H4
#[test]
fn stop_has_its_own_connection_and_reports_its_time() {
    let (bench, _listener, mut daemon, mut stops) = connected();
    for number in 1..=3 {
        bench.connection.send(Intent::Stop);
        assert_eq!(stops.hear(), number);
        assert_eq!(bench.until_stop_news(), StopNews::Sent);
        stops.confirm(number);
        let StopNews::Answered { after, result } = bench.until_stop_news() else {
            panic!("it was answered");
        };
        assert!(result.is_ok_and(|reply| reply.tick == 9) && after < LIMIT);
        // And behind what was written before it.
        assert_eq!(daemon.hear().request, Request::Stop {});
    }
}

// hazard: H4
#[test]
fn stop_counts_as_unsent_until_a_full_socket_takes_it() {
    let (bench, _listener, _daemon, mut stops) = connected();
    // This daemon reads nothing.
    let mut pressed = 0;
    let reason = loop {
        assert!(pressed < 100_000, "a socket has an end");
        bench.connection.stop();
        pressed += 1;
        match bench.until_stop_news() {
            StopNews::Sent => {}
            StopNews::NotSent { reason } => break reason,
            news => panic!("{news:?}"),
        }
    };
    assert_eq!(reason, "the daemon does not read");
    while stops.hear() < pressed {}
    assert_eq!(bench.until_stop_news(), StopNews::Sent);
}

// hazard: H4
#[test]
fn a_waiting_stop_spares_the_fake_rig_that_the_panel_started() {
    // The daemon of this test says that its process is number 1.
    for (own_rig, is_pressed_again) in [(1, false), (1, true), (2, false)] {
        let bench = Bench::new();
        bench.until_lost();
        bench.connection.stop();
        let reason = "no connection".to_owned();
        assert_eq!(bench.until_stop_news(), StopNews::NotSent { reason });
        let stops = bench.connection.stops_pressed();
        bench.connection.set_own_rig(Some((own_rig, stops)));
        if is_pressed_again {
            bench.connection.stop();
        }
        let listener = bench.listen();
        let mut daemon = Daemon::accept(&listener);
        let first = daemon.hear().request;
        let is_spared = own_rig == 1 && !is_pressed_again;
        assert_eq!(first == Request::Stop {}, !is_spared, "{own_rig}: {first:?}");
        if is_spared {
            // Its line for stops comes before or after the conversation.
            thread::spawn(move || {
                let mut lines = Vec::new();
                loop {
                    lines.push(greet(&listener, HELLO));
                }
            });
            bench.until(|update| matches!(update, Update::Stop(StopNews::Dropped)).then_some(()));
        }
    }
}

// hazard: H4
#[test]
fn unanswered_stop_of_a_dead_daemon_goes_to_the_next() {
    let (bench, listener, daemon, mut stops) = connected();
    bench.connection.stop();
    stops.hear();
    assert_eq!(bench.until_stop_news(), StopNews::Sent);
    bench.end(listener);
    drop((daemon, stops));
    assert!(matches!(bench.until_stop_news(), StopNews::NotSent { .. }));
    let listener = bench.listen();
    // Whichever of the two connections comes first.
    let mut line = BufReader::new(greet(&listener, HELLO));
    let mut text = String::new();
    line.read_line(&mut text).expect("a stop in time");
    assert!(is_stop(&text), "{text}");
}

// hazard: H4
#[test]
fn engage_and_reset_queued_before_a_stop_are_dropped() {
    let (bench, _listener, mut daemon, mut stops) = connected();
    // The daemon reads nothing of the conversation, until its socket is full and the rest waits in the panel.
    let target = haptic_panel::Target {
        name: "mass".into(),
        direction: None,
    };
    for _ in 0..20_000 {
        let (target, value, merge) = (target.clone(), 0.5, false);
        bench.connection.send(Intent::Set { target, value, merge });
    }
    bench.connection.send(Intent::Reset);
    bench.connection.send(Intent::Engage);
    bench.connection.send(Intent::Stop);
    stops.hear();
    bench.connection.send(Intent::Undo);
    // Behind what was in the socket already comes the stop, ahead of all that waited; what would
    // bring the force back is dropped.
    let mut was_stopped = false;
    loop {
        match daemon.hear().request {
            Request::Stop {} => was_stopped = true,
            Request::Reset {} | Request::Engage { .. } => panic!("after a stop"),
            Request::Undo { .. } => break,
            _ => {}
        }
    }
    assert!(was_stopped);
}

// hazard: H4
#[test]
fn a_full_daemon_is_left_to_other_clients_until_there_is_a_stop() {
    let (bench, listener, _daemon) = introduced();
    let for_a_moment = r#"{"hello":{"protocol":1,"server":"hapticd test","session":"1-9","rights":"stop"}}"#;
    let mut idle = String::new();
    let read = BufReader::new(greet(&listener, for_a_moment)).read_line(&mut idle);
    assert_eq!(read.expect("it hangs up"), 0, "{idle}");
    bench.connection.stop();
    let mut stops = StopLine(BufReader::new(greet(&listener, for_a_moment)));
    let number = stops.hear();
    stops.confirm(number);
    bench.until(|update| matches!(update, Update::Stop(StopNews::Answered { .. })).then_some(()));
}

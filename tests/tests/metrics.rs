//! Metrics: what is scraped, and the rules and the dashboard that rest on it.

use haptic_core::servo::Fault;
use haptic_ipc::{Request, RigState, StateReply};
use rustix::process::Signal;
use serde_json::Value;
use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::fake_rig::connected;
use system_tests::{Daemon, PATIENCE, plain, pull_until, stderr, until, until_some, wait_for_state};

const PACKAGED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../packaging/monitoring");

/// A daemon with metrics, and their address.
fn daemon(more: &[&str]) -> (Daemon, SocketAddr) {
    let daemon = Daemon::start(&[&["--metrics", "127.0.0.1:0"], more].concat());
    let address = address_of(&daemon);
    (daemon, address)
}

/// Where a daemon says that it serves its metrics.
fn address_of(daemon: &Daemon) -> SocketAddr {
    let printed = daemon.printed().iter().find_map(|line| line.split_once("http://"));
    let (_, place) = printed.unwrap_or_else(|| panic!("no address: {:?}", daemon.printed()));
    let (address, _) = place.split_once('/').expect("a path");
    address.parse().expect("an address")
}

/// Sends bytes and returns the whole answer: its head and its body.
fn ask(address: SocketAddr, request: &str) -> (String, String) {
    tried(address, request).expect("it serves")
}

/// The same where it may be too early.
fn tried(address: SocketAddr, request: &str) -> Option<(String, String)> {
    let mut stream = TcpStream::connect(address).ok()?;
    stream.write_all(request.as_bytes()).ok()?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer).ok()?;
    let (head, body) = answer.split_once("\r\n\r\n")?;
    Some((head.to_owned(), body.to_owned()))
}

const GET: &str = "GET /metrics HTTP/1.1\r\nHost: rig\r\n\r\n";

fn scrape(address: SocketAddr) -> String {
    let (head, body) = ask(address, GET);
    assert!(head.starts_with("HTTP/1.1 200 OK"), "{head}");
    body
}

/// The value of a series, as printed with its labels.
fn value(scraped: &str, series: &str) -> f64 {
    let line = scraped
        .lines()
        .find_map(|line| line.strip_prefix(series)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("no {series} in {scraped}"))
        .parse()
        .expect("a number")
}

#[test]
fn a_scrape_tells_state_force_faults_stops_and_times() {
    let (daemon, address) = daemon(&[]);
    let mut client = daemon.client();
    pull_until(&mut client, |status| status.command_force_n.abs() > 3.0);
    let engaged = scrape(address);
    for (series, wanted) in [
        ("hapticd_state{state=\"engaged\"}", 1.0),
        ("hapticd_state{state=\"idle\"}", 0.0),
        ("hapticd_force_limit_newtons", 20.0),
        ("hapticd_clients", 1.0),
    ] {
        assert_eq!(value(&engaged, series), wanted, "{series}");
    }
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    wait_for_state(&mut client, RigState::Stopped);
    let stopped = scrape(address);
    assert_eq!(value(&stopped, "hapticd_state{state=\"stopped\"}"), 1.0);
    assert_eq!(value(&stopped, "hapticd_force_newtons"), 0.0);
    assert_eq!(value(&stopped, "hapticd_stops_total{outcome=\"confirmed\"}"), 1.0);
    let written_s = value(&stopped, "hapticd_stop_written_seconds{percentile=\"100\"}");
    assert!(written_s > 0.0 && written_s < 10.0, "{written_s}");
    // The last bucket holds all, and the buckets are those of `timing`.
    for name in ["hapticd_wake_latency_seconds", "hapticd_tick_seconds"] {
        let all = value(&stopped, &format!("{name}_bucket{{le=\"+Inf\"}}"));
        assert!(
            all > 100.0 && all == value(&stopped, &format!("{name}_count")),
            "{name} {all}"
        );
        let mean_s = value(&stopped, &format!("{name}_sum")) / all;
        assert!(mean_s > 1e-7 && mean_s < 1.0, "{name} {mean_s}");
    }
    assert!(value(&stopped, "hapticd_ticks_total") > value(&engaged, "hapticd_ticks_total"));
    // A Prometheus asks for OpenMetrics, which marks its end.
    let asked = "GET /metrics HTTP/1.1\r\nAccept: application/openmetrics-text;version=1.0.0,*/*;q=0.1\r\n\r\n";
    let (head, body) = ask(address, asked);
    assert!(
        head.contains("application/openmetrics-text") && body.ends_with("# EOF\n"),
        "{head}"
    );
}

#[test]
fn a_fault_is_counted_by_its_code() {
    // A hand faster than the limit.
    let (daemon, address) = daemon(&["--hand", "sine", "--speed-limit-mps", "0.01"]);
    let mut client = daemon.client();
    let counted = |code: &str| format!("hapticd_faults_total{{code=\"{code}\"}}");
    // Each from the beginning: monitoring sees the first as an increase.
    let before = scrape(address);
    for fault in Fault::KINDS {
        assert_eq!(value(&before, &counted(fault.code())), 0.0);
    }
    drop(client.request::<StateReply>(Request::engage()));
    wait_for_state(&mut client, RigState::Faulted);
    assert_eq!(value(&scrape(address), &counted("too_fast")), 1.0);
}

#[test]
fn bad_metrics_requests_are_refused_and_block_nothing() {
    let (daemon, address) = daemon(&[]);
    for (line, refused) in [("GET /", "404"), ("POST /metrics", "405")] {
        let (head, _) = ask(address, &format!("{line} HTTP/1.1\r\nHost: rig\r\n\r\n"));
        assert!(head.starts_with(&format!("HTTP/1.1 {refused}")), "{head}");
    }
    // More connections that say nothing than it has places: they are closed after 2 s.
    let silent: Vec<TcpStream> = (0..12)
        .map(|_| TcpStream::connect(address).expect("it serves"))
        .collect();
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::Stop {}).expect("a stop is obeyed meanwhile");
    for mut stream in silent {
        stream.set_read_timeout(Some(PATIENCE)).expect("a socket");
        // Its end, or a reset, but no wait without end.
        drop(stream.read(&mut [0; 1]));
    }
    until("the page is not served again", || {
        tried(address, GET).is_some_and(|(head, _)| head.starts_with("HTTP/1.1 200"))
    });
}

#[test]
fn node_exporter_file_is_whole_readable_and_current() {
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("hapticd.prom");
    let daemon = Daemon::start(&["--metrics-file", path.to_str().expect("a plain path")]);
    let read_when = |failure: &str, holds: &dyn Fn(&str) -> bool| {
        until_some(failure, || fs::read_to_string(&path).ok().filter(|text| holds(text)))
    };
    let first = read_when("it is not written", &|text| !text.is_empty());
    assert!(
        first.ends_with('\n') && first.contains("hapticd_scene_changes"),
        "whole from the first: {first}"
    );
    let ticks = value(&first, "hapticd_ticks_total");
    read_when("it is not written again", &|text| {
        value(text, "hapticd_ticks_total") > ticks
    });
    assert_eq!(
        fs::read_dir(directory.path()).expect("a directory").count(),
        1,
        "nothing else is left there"
    );
    daemon.end(Signal::TERM);
    assert!(!path.exists(), "nobody reports a daemon that has ended");
}

/// Gives promtool a text to check.
fn check(arguments: &[&str], text: &str) -> String {
    let mut child = Command::new("promtool")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut input = child.stdin.take().expect("it is piped");
    input.write_all(text.as_bytes()).expect("it reads");
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    let printed = format!("{}{}", String::from_utf8_lossy(&output.stdout), stderr(&output));
    assert!(output.status.success(), "{printed}");
    printed
}

/// Every query of the dashboard.
fn queries() -> Vec<String> {
    let text = fs::read_to_string(Path::new(PACKAGED).join("grafana-dashboard.json")).expect("it is packaged");
    let dashboard: Value = serde_json::from_str(&text).expect("JSON");
    let panels = dashboard["panels"].as_array().expect("panels");
    let targets = panels
        .iter()
        .flat_map(|panel| panel["targets"].as_array().expect("targets"));
    let query = |target: &Value| target["expr"].as_str().expect("a query").replace("$rig", ".*");
    targets.map(query).collect()
}

#[test]
fn promtool_accepts_metrics_and_rules_use_only_scraped_names() {
    if !test_run::is_there("promtool") {
        return test_run::skip("prometheus", "Debian: apt install prometheus");
    }
    let (_rig, daemon, _client) = connected(&[], &["--metrics", "127.0.0.1:0"]);
    let scraped = scrape(address_of(&daemon));
    assert_eq!(check(&["check", "metrics"], &scraped), "");

    let alerts = Path::new(PACKAGED).join("alerts.yml");
    check(&["check", "rules", plain(&alerts)], "");
    let cases = concat!(env!("CARGO_MANIFEST_DIR"), "/monitoring/alerts.test.yml");
    check(&["test", "rules", cases], "");
    // What the alerts tell apart is there before it happens.
    for label in [
        r#"state="faulted""#,
        r#"state="disconnected""#,
        r#"outcome="unconfirmed""#,
        r#"kind="bad_crc""#,
        r#"kind="malformed""#,
        r#"kind="lost""#,
    ] {
        assert!(scraped.contains(label), "{label} is not scraped");
    }
    let directory = tempfile::tempdir().expect("a directory");
    let put = |name: &str, text: String| {
        let path = directory.path().join(name);
        fs::write(&path, text).expect("written");
        path
    };
    let mut text = "groups:\n- name: dashboard\n  rules:\n".to_owned();
    for (number, query) in queries().iter().enumerate() {
        let query = serde_json::to_string(query).expect("text");
        text.push_str(&format!("  - record: panel:{number}\n    expr: {query}\n"));
    }
    check(&["check", "rules", plain(&put("dashboard.yml", text))], "");
    let packaged = fs::read_to_string(Path::new(PACKAGED).join("prometheus.yml")).expect("it is packaged");
    let packaged = packaged
        .replace("/usr/share/doc/hapticd/examples/monitoring", PACKAGED)
        .replace("/etc/prometheus/rigs/*.yml", &format!("{PACKAGED}/rigs.yml"));
    let configuration = put("prometheus.yml", packaged);
    let printed = check(&["check", "config", plain(&configuration)], "");
    assert!(printed.contains("SUCCESS") && !printed.contains("WARNING"), "{printed}");

    let alerts = fs::read_to_string(alerts).expect("it is packaged");
    let used = format!("{alerts} {}", queries().join(" "));
    let words = used.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    for metric in words.filter(|word| word.starts_with("hapticd_")) {
        // A counter of what has not happened yet has no series.
        let family = metric.trim_end_matches("_bucket");
        let is_scraped = scraped.contains(&format!("# TYPE {family} "));
        assert!(is_scraped, "{metric} is not scraped");
    }
}

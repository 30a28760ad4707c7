//! The library of scenes.

use haptic_ipc::{ChangeReply, Client, ErrorCode, Request, SceneListReply, SceneRef, SceneReply, SceneSaveReply};
use system_tests::{Daemon, refused};

fn named(name: &str) -> SceneRef {
    SceneRef::Name(name.to_owned())
}

fn save(name: &str, replace: bool) -> Request {
    Request::SceneSave {
        name: name.to_owned(),
        scene: None,
        replace,
    }
}

fn code(client: &mut Client, request: Request) -> ErrorCode {
    refused(client, request).code
}

#[test]
fn every_scene_that_comes_with_the_daemon_loads_and_goes_back() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let list: SceneListReply = client.request(Request::SceneList {}).expect("a list");
    let files = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes")).expect("the scenes");
    assert_eq!(list.scenes.len(), files.count(), "each file of scenes/ is in the list");
    for listed in &list.scenes {
        assert_eq!((&listed.path, &listed.problem), (&None, &None), "{listed:?}");
        let _: ChangeReply = client.request(Request::load(named(&listed.name))).expect("it loads");
        let now: SceneReply = client.request(Request::get()).expect("a scene");
        assert_eq!(
            (&now.scene.name, now.scene.friction.law()),
            (&listed.title, listed.law.as_str())
        );
    }
    // The daemon starts with the first of them: loading it has changed nothing.
    assert_eq!(list.scenes[0].title, "simulated friction");
    for _ in &list.scenes[1..] {
        let _: ChangeReply = client.request(Request::undo()).expect("as many steps back");
    }
    let now: SceneReply = client.request(Request::get()).expect("a scene");
    assert_eq!(now.scene.name, "simulated friction");
}

#[test]
fn saved_scene_is_listed_and_starts_another_daemon() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let params = [("M", 2.5), ("Fs+", 6.0)].into_iter().collect();
    let _: ChangeReply = client.request(Request::set(params)).expect("a change");
    let saved: SceneSaveReply = client.request(save("my rig evening", false)).expect("it is saved");
    let scene: SceneReply = client.request(Request::get()).expect("a scene");

    let directory = daemon.scene_dir();
    let other = Daemon::start(&["--scene", &saved.path]);
    let started: SceneReply = other.client().request(Request::get()).expect("a scene");
    let mut expected = scene.scene;
    expected.name = "my rig evening".to_owned();
    assert_eq!(started.scene, expected);
    let files: Vec<_> = std::fs::read_dir(directory).expect("it is there").collect();
    assert_eq!(files.len(), 1, "nothing but the scene is left: {files:?}");
    let list: SceneListReply = client.request(Request::SceneList {}).expect("a list");
    let listed = list.scenes.last().expect("it is listed");
    assert_eq!(
        (listed.name.as_str(), listed.path.as_ref()),
        ("my rig evening", Some(&saved.path))
    );
}

#[test]
fn what_cannot_be_a_scene_is_refused_by_its_own_code() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    for name in ["", "../up", ".hidden", "a/b", "ends ", "line\nbreak", &"x".repeat(65)] {
        assert_eq!(code(&mut client, save(name, false)), ErrorCode::BadName, "{name:?}");
        assert_eq!(
            code(&mut client, Request::load(named(name))),
            ErrorCode::BadName,
            "{name:?}"
        );
    }
    let directory = daemon.scene_dir();
    std::fs::create_dir_all(&directory).expect("a directory");
    let broken = "name = \"broken\"\n[friction]\nlaw = \"karnop\"\n";
    let wild = "[friction]\nlaw = \"viscous\"\nviscous = -1\n";
    for (name, text) in [("broken.toml", broken), ("wild.toml", wild)] {
        std::fs::write(directory.join(name), text).expect("a file");
    }
    assert_eq!(code(&mut client, Request::load(named("broken"))), ErrorCode::SceneFile);
    assert_eq!(code(&mut client, Request::load(named("wild"))), ErrorCode::OutOfRange);
    let list: SceneListReply = client
        .request(Request::SceneList {})
        .expect("the others are listed all the same");
    let problems: Vec<&str> = list
        .scenes
        .iter()
        .filter_map(|scene| scene.problem.as_deref())
        .collect();
    assert_eq!(problems.len(), 2);
    assert!(
        problems[0].contains("karnop") && problems[1].contains("viscous = -1"),
        "{problems:?}"
    );
}

//! The library of scenes.

use haptic_ipc::{ChangeReply, Request, SceneListReply, SceneReply, SceneSaveReply};
use system_tests::Daemon;

fn save(name: &str, replace: bool) -> Request {
    Request::SceneSave {
        name: name.to_owned(),
        scene: None,
        replace,
    }
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

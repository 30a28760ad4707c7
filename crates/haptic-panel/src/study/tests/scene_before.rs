//! The scene that was active before the study.

use super::*;

#[test]
fn closed_study_puts_the_former_scene_back_unless_changed() {
    for is_changed_by_another in [false, true] {
        let mut daemon = Daemon::with_study(TARGETS);
        daemon.begin();
        let own_revision = daemon.revision;
        if is_changed_by_another {
            daemon.revision += 1;
            daemon.tell_state();
        }
        daemon.link.command(StudyCommand::Close);
        let put_back = Intent::TrialScene {
            scene: Box::new(Scene::paper()),
            if_revision: own_revision,
            ramp_ms: 200.0,
        };
        if !is_changed_by_another {
            assert_eq!(daemon.intent(), put_back);
        }
        assert_eq!(daemon.intent(), Intent::Lease { timeout_ms: 0 });
        assert_eq!(daemon.intent(), Intent::Stream { batch_ms: 34 });
    }
}

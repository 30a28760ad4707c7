//! One subject after the other, and the scene that was active before the study.

use super::*;

#[test]
fn broken_subject_is_reported_and_another_can_be_chosen() {
    let mut daemon = Daemon::with_study(TARGETS);
    let folder = daemon.study().join("data/subject-P8/session-01");
    std::fs::create_dir_all(&folder).expect("a folder");
    let rows = folder.join("subject-P8_session-01_task-fitts_data.csv");
    std::fs::write(&rows, "this,is\nno,study\n").expect("written");
    daemon.link.command(StudyCommand::Choose(1));
    daemon.until(|stage| matches!(stage, Stage::Held { why, is_trouble: true } if why.contains("no column `subject`")));
    daemon.go_on();
    daemon.link.command(StudyCommand::Choose(0));
    daemon.until(|stage| matches!(stage, Stage::Held { why, is_trouble: false } if why.starts_with("Ready")));
    std::fs::remove_file(&rows).expect("removed");
    daemon.link.command(StudyCommand::Choose(1));
    daemon.go_on();
    daemon.until(|stage| matches!(stage, Stage::Running { what } if what.contains("instructions")));
}

#[test]
fn finished_subject_frees_the_rig_but_viewing_one_does_not() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin();
    loop {
        match phase_after(&daemon, |phase| !matches!(phase, Phase::GetReady)) {
            Phase::Targets(targets) if targets.is_start => {
                let first_m = targets.active_m / 2.0;
                daemon.click_at(first_m);
                for position_m in [-first_m, first_m] {
                    daemon.click_at(position_m);
                    // A trial is on the disk before the next one begins.
                    daemon.row();
                }
                phase_after(&daemon, |phase| !matches!(phase, Phase::Targets(_)));
            }
            Phase::Rest { .. } => {
                daemon.ticks(5000);
                daemon.read();
                daemon.ticks(300);
                phase_after(&daemon, |phase| !matches!(phase, Phase::Rest { .. }));
            }
            Phase::Done => break,
            phase => panic!("{phase:?}"),
        }
    }
    daemon.until(|stage| *stage == Stage::Finished);
    assert_eq!(daemon.intent(), Intent::Release);
    assert_eq!(daemon.render(), Scene::paper(), "the scene before the study");
    assert_eq!(daemon.intent(), Intent::Lease { timeout_ms: 0 });
    daemon.turn(RigState::Engaged);
    daemon.link.command(StudyCommand::Choose(1));
    daemon.until(|stage| matches!(stage, Stage::Held { is_trouble: false, .. }));
    daemon.link.command(StudyCommand::Choose(0));
    daemon.until(|stage| *stage == Stage::Finished);
    daemon.ticks(10);
    daemon.link.command(StudyCommand::Close);
    assert_eq!(
        daemon.intent(),
        Intent::Lease { timeout_ms: 0 },
        "the rig stays as it is"
    );
}

#[test]
fn a_closed_study_leaves_the_scene_that_another_has_changed() {
    let mut daemon = Daemon::with_study(TARGETS);
    daemon.begin();
    daemon.revision += 1;
    daemon.tell_state();
    daemon.link.command(StudyCommand::Close);
    assert_eq!(daemon.intent(), Intent::Lease { timeout_ms: 0 });
}

/// Waits until the subject's screen shows a phase; returns it.
fn phase_after(daemon: &Daemon, is_wanted: impl Fn(&Phase) -> bool) -> Phase {
    let began = Instant::now();
    loop {
        match daemon.screen().begin_frame(Instant::now()).view.map(|view| view.phase) {
            Some(phase) if is_wanted(&phase) => return phase,
            phase => assert!(began.elapsed() < PATIENCE, "{phase:?}"),
        }
        std::thread::yield_now();
    }
}

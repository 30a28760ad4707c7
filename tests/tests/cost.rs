//! A scene pays for what it has: instructions a tick, counted by callgrind in the real program, as
//! `haptic-ctl cost` prints them.

use std::collections::BTreeMap;
use system_tests::ctl_offline;

/// Instructions a tick of each scene of the table, in the profile that the tests are built with,
/// and a tenth on top. Raise one only for something that the scene really needs.
const BUDGETS: [(&str, f64); 21] = [
    ("viscous on the device", 34.0),
    ("Salcudean-Vlaar on the device", 186.0),
    ("Karnopp on the device", 186.0),
    ("Dahl on the device", 249.0),
    ("Hayward-Armstrong on the device", 260.0),
    ("reset integrator on the device", 183.0),
    ("LuGre without Stribeck on the device", 264.0),
    ("LuGre on the device", 749.0),
    ("elasto-plastic without Stribeck on the device", 330.0),
    ("elasto-plastic on the device", 2019.0),
    ("viscous behind a block", 218.0),
    ("Karnopp behind a block", 360.0),
    ("the same with DV", 360.0),
    ("the same, asymmetric", 383.0),
    ("asymmetric with rising Fs", 392.0),
    ("Karnopp with Stribeck behind a block", 747.0),
    ("Dahl behind a block", 1660.0),
    ("LuGre behind a block", 1858.0),
    ("elasto-plastic behind a block", 2560.0),
    ("excitation along a chirp", 421.0),
    ("excitation along a sweep", 334.0),
];

#[test]
fn a_scene_never_pays_for_what_it_lacks() {
    if !test_run::is_long_for("the instructions of a tick by what its scene has") {
        return;
    }
    if !test_run::is_there("valgrind") {
        test_run::skip("valgrind", "Debian: apt install valgrind libc6-dbg");
        return;
    }
    let output = ctl_offline(&["cost", "--json"]);
    let rows: Vec<serde_json::Value> = serde_json::from_slice(&output.stdout).expect("JSON");
    let counted: BTreeMap<String, f64> = rows
        .iter()
        .map(|row| {
            let name = row["scene"].as_str().expect("a name").to_owned();
            (name, row["tick_instructions"].as_f64().expect("counted"))
        })
        .collect();
    for (scene, count) in &counted {
        println!("{scene:40} {count:8.1}");
    }
    assert_eq!(counted.len(), BUDGETS.len());
    for (scene, budget) in BUDGETS {
        let count = counted[scene];
        assert!(
            count <= budget,
            "{scene}: {count:.0} instructions a tick, and {budget:.0} were agreed on"
        );
    }
    // Each part costs where it is, and not where it is not.
    let of = |scene: &str| counted[scene];
    assert!(of("viscous on the device") * 2.0 < of("Karnopp on the device"));
    assert!(of("Karnopp on the device") < of("Dahl on the device"));
    assert!(of("Karnopp on the device") * 1.8 < of("Karnopp behind a block"));
    assert!(of("viscous behind a block") < of("Karnopp behind a block"));
    // Neither a second direction nor a rising limit is in the way of a steady tick.
    assert!(of("asymmetric with rising Fs") < 1.2 * of("Karnopp behind a block"));
    assert!(of("Karnopp behind a block") * 3.0 < of("Dahl behind a block"));
}

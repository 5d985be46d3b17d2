//! The gallery's scenes on `opengl1` and on Relight: pictures and answers have to be the same. All of them with
//! `RELIGHT_FULL=1`, else those that are quick.

#![forbid(unsafe_code)]

use std::path::Path;

use tests::data;
use tests::gallery::{run, scenes};

#[test]
fn scenes_look_as_in_opengl1() {
    let mut scenes = scenes();
    if !testkit::is_set("RELIGHT_FULL") {
        scenes.retain(|s| s.quick);
    }
    // Both processes play what was built for this test.
    let folder = data::repository().join("target/gallery-test");
    let program = Path::new(env!("CARGO_BIN_EXE_gallery"));
    let Some(outcomes) = run::compare(program, &scenes, &folder) else {
        return;
    };
    assert!(outcomes.len() >= scenes.len());
    let bad: Vec<String> = outcomes
        .iter()
        .filter(|o| !o.complaint.is_empty())
        .map(|o| format!("{}.{}: {} {:?}", o.scene, o.name, o.complaint, o.difference))
        .collect();
    assert!(
        bad.is_empty(),
        "{}\nsee {}",
        bad.join("\n"),
        folder.join("index.html").display()
    );
}

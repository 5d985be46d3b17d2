//! Debian's ioquake3 with OpenArena and this renderer, without a display.

#![forbid(unsafe_code)]

use relight::compare::{Rgb8, compare};
use tests::data::keep_picture;
use tests::real::{self, Run, picture, start_map};
use tests::roq;

/// Cameras: a map, its start as `x y z yaw`. Chosen for what they show: torches, sky, liquids, curves, models.
const VIEWS: [(&str, &str); 4] = [
    ("oa_dm1", "-560 768 60 20"),
    ("am_galmevish", "-640 -384 60 20"),
    ("oa_dm5", "936 192 290 180"),
    ("oa_ctf2", "1504 1760 740 180"),
];

/// More of them for the classic look: a mirror with the player in it, a portal, factors of the window's alpha, fog over
/// waves, highlights on faces without a normal.
const CLASSIC_VIEWS: &[(&str, &str)] = &[
    ("oa_dm1", "392 1600 -106 180"),
    ("oa_dm3", "1320 -904 -18 180"),
    ("hydronex", "280 2616 81 91"),
    ("dm4ish", "64 128 -215 90"),
    ("oa_spirit3", "480 1952 -95 270"),
];

/// The classic look is at least this similar to the engine's own OpenGL renderer's picture of the same frame.
/// `scripts/fidelity` measures many more: 0.9972 at least.
const CLASSIC_SSIM: f64 = 0.993;

fn run(renderer: &'static str, size: (u32, u32), commands: Vec<String>) -> real::Outcome {
    run_with(renderer, size, commands, Vec::new())
}

fn run_with(
    renderer: &'static str,
    size: (u32, u32),
    commands: Vec<String>,
    files: Vec<(String, Vec<u8>)>,
) -> real::Outcome {
    prepared(renderer, size, commands, files).go()
}

/// The engine's own renderer and this one, beside each other, with commands and files for each.
fn run_both(
    size: (u32, u32),
    commands: [Vec<String>; 2],
    files: &[(String, Vec<u8>)],
) -> [real::Outcome; 2] {
    let [reference, ours] = commands;
    Run::go_both([
        &prepared("opengl1", size, reference, files.to_vec()),
        &prepared("vk", size, ours, files.to_vec()),
    ])
}

fn prepared(
    renderer: &'static str,
    size: (u32, u32),
    commands: Vec<String>,
    files: Vec<(String, Vec<u8>)>,
) -> Run {
    let cvars = [("r_rt", "0"), ("r_vkValidation", "1")]
        .map(|(n, v)| (n.to_string(), v.to_string()))
        .to_vec();
    Run {
        files,
        cvars,
        renderer,
        width: size.0,
        height: size.1,
        commands,
        limit: 600,
    }
}

fn set(commands: &mut Vec<String>, lines: &[&str]) {
    commands.extend(lines.iter().map(|l| l.to_string()));
}

fn assert_plausible(picture: &Rgb8, what: &str) {
    let (luminance, colors) = (picture.mean_luminance(), picture.distinct_colors());
    assert!(
        (3.0..240.0).contains(&luminance),
        "{what}: mean luminance {luminance}"
    );
    assert!(colors > 200, "{what}: {colors} colours");
}

#[test]
fn the_classic_look_is_the_engines_own() {
    if !real::available() {
        return;
    }
    for (map, camera) in VIEWS.iter().chain(CLASSIC_VIEWS) {
        let mut commands = start_map(map);
        commands.extend(picture(camera, 30, "shot"));
        let mut with_info = commands.clone();
        set(&mut with_info, &["gfxinfo"]);
        let [reference, ours] = run_both((640, 480), [commands, with_info], &[]);
        reference.assert_clean();
        ours.assert_clean();
        let (reference, picture) = (reference.picture("shot"), ours.picture("shot"));
        assert_plausible(reference, map);
        keep_picture(reference, &format!("{map}-opengl1"));
        keep_picture(picture, &format!("{map}-classic"));
        let difference = compare(reference, picture).unwrap();
        println!("{map}: {difference:?}");
        assert!(difference.ssim >= CLASSIC_SSIM, "{map}: {difference:?}");
    }
}

/// A film of 64 coloured squares, and a script that shows it behind the console.
fn film_files() -> Vec<(String, Vec<u8>)> {
    let picture: Vec<[u8; 3]> = (0..64u8)
        .map(|i| [60 + i * 2, 60 + i % 8 * 18, 60 + i / 8 * 18])
        .collect();
    // the game's own file of this name, which has the console in it, gives way
    let script = b"console { nopicmip nomipmaps { videoMap film.roq } }\n";
    vec![
        ("video/film.roq".into(), roq::film(64, &vec![picture; 90])),
        ("scripts/oanew.shader".into(), script.to_vec()),
    ]
}

#[test]
fn films_that_the_engine_decodes_are_shown() {
    if !real::available() {
        return;
    }
    let whole = [
        "cinematic film.roq 2",
        "wait 60",
        "screenshot shot",
        "wait 6",
    ];
    let behind = [
        "toggleconsole",
        "wait 400",
        "clear",
        "wait 8",
        "screenshot shot",
        "wait 6",
    ];
    for (name, lines) in [("cinematic", &whole[..]), ("videoMap", &behind[..])] {
        let mut commands = Vec::new();
        set(
            &mut commands,
            &["set con_notifytime -1", "set r_ignorehwgamma 1", "wait 20"],
        );
        set(&mut commands, lines);
        let both = [commands.clone(), commands];
        let [reference, ours] = run_both((320, 240), both, &film_files()).map(|outcome| {
            outcome.assert_clean();
            outcome.picture("shot").clone()
        });
        keep_picture(&reference, &format!("{name}-opengl1"));
        keep_picture(&ours, &format!("{name}-vk"));
        let difference = compare(&reference, &ours).unwrap();
        println!("{name}: {difference:?}");
        assert!(difference.ssim >= CLASSIC_SSIM, "{name}: {difference:?}");
        // a square of the first row, which both show, whatever else lies over it
        let place = if name == "cinematic" {
            (100, 15)
        } else {
            (100, 7)
        };
        let at = (place.1 * 320 + place.0) * 3;
        let seen = &ours.pixels()[at..at + 3];
        let meant = roq::rgb([60 + 2 * 2, 60 + 2 * 18, 60]);
        let near = seen.iter().zip(meant).all(|(&a, b)| a.abs_diff(b) <= 6);
        assert!(near, "{name}: {seen:?} is not {meant:?}");
    }
}

/// The traced look's picture of a view is another one, but of the same place: at least this similar to the picture of
/// the engine's own renderer. Dark or even pictures of different places are similar, too, so this bound alone means
/// little: the picture is also more similar to that of its own view than to those of the other [`VIEWS`].
const TRACED_SSIM: f64 = 0.2;

#[test]
fn the_traced_look_shows_the_same_places() {
    if !real::available() {
        return;
    }
    let pictures = VIEWS.map(|(map, camera)| {
        let mut classic = start_map(map);
        classic.extend(picture(camera, 8, "shot"));
        let mut traced = start_map(map);
        set(
            &mut traced,
            &[&format!("setviewpos {camera}"), "set r_rt 1"],
        );
        traced.extend(picture(camera, 8, "shot"));
        set(&mut traced, &["rt_lights"]);
        let [reference, ours] = run_both((320, 240), [classic, traced], &[]);
        ours.assert_clean();
        let picture = ours.picture("shot");
        keep_picture(picture, &format!("{map}-traced"));
        assert_plausible(picture, map);
        [reference.picture("shot").clone(), picture.clone()]
    });
    for (view, [reference, picture]) in pictures.iter().enumerate() {
        let map = VIEWS[view].0;
        let ssim = pictures
            .each_ref()
            .map(|[r, _]| compare(r, picture).unwrap().ssim);
        println!(
            "{map}: {ssim:.3?}, luminance {:.1} and {:.1}",
            reference.mean_luminance(),
            picture.mean_luminance()
        );
        let own = ssim[view];
        assert!(own >= TRACED_SSIM, "{map}: {ssim:?}");
        for (other, value) in ssim.into_iter().enumerate() {
            let of = VIEWS[other].0;
            assert!(other == view || own > value, "{map} and {of}: {ssim:?}");
        }
    }
}

#[test]
fn lights_by_hand_light_the_traced_look() {
    if !real::available() {
        return;
    }
    let (map, camera) = VIEWS[0];
    let lights = "// a red lamp in the dark\n\
        without points\nwithout suns\nscale surfaces 0.001\nambient 0 1 1 1\n\
        point -540 775 110 400 1 0 0 16\n\
        point 1 2\n";
    let mut commands = vec!["set sv_pure 0".to_string()];
    commands.extend(start_map(map));
    commands.extend([format!("setviewpos {camera}"), "set r_rt 1".to_string()]);
    commands.extend(picture(camera, 8, "shot"));
    set(&mut commands, &["rt_reload", "wait 4"]);
    let materials = "rough textures/* 0.4\nrough textures/* 7\n";
    let files = vec![
        (format!("maps/{map}.lights"), lights.into()),
        (format!("maps/{map}.materials"), materials.into()),
    ];
    let outcome = run_with("vk", (160, 120), commands, files);
    outcome.assert_clean();
    let printed = format!("maps/{map}.lights: line 7: ");
    assert!(outcome.log.contains(&printed), "{}", outcome.log_end());
    // read by the first traced frame, and once more by the command
    let printed = format!("maps/{map}.materials: line 2: roughness is from 0 to 1");
    let read = outcome.log.matches(&printed).count();
    assert_eq!(read, 2, "{}", outcome.log_end());
    assert!(
        outcome.log.contains("rt_reload: read"),
        "{}",
        outcome.log_end()
    );
    let picture = outcome.picture("shot");
    keep_picture(picture, "lights-by-hand");
    let mean = |channel: usize| {
        let all = picture.pixels().iter().skip(channel).step_by(3);
        all.map(|&v| u32::from(v)).sum::<u32>()
    };
    let [red, green, blue] = [0, 1, 2].map(mean);
    println!("{red} {green} {blue}");
    assert!(red > 2 * green.max(blue), "{red} {green} {blue}");
}

#[test]
fn a_session_with_everything() {
    if !real::available() {
        return;
    }
    let mut commands = start_map(VIEWS[1].0);
    let camera = VIEWS[1].1;
    commands.extend(picture(camera, 20, "classic"));
    set(&mut commands, &["set r_rt 1"]);
    commands.extend(picture(camera, 24, "traced"));
    set(&mut commands, &["set r_rt 0"]);
    // as long after the camera was put there as the first one: the effect of the teleport has faded by then
    commands.extend(picture(camera, 20, "back"));
    // another map, both looks, bots that fight
    set(
        &mut commands,
        &[
            "set bot_enable 1",
            "set timescale 1000",
            "devmap oa_dm5",
            "wait 60",
            "set timescale 1",
        ],
    );
    set(
        &mut commands,
        &[
            "addbot sarge 3",
            "addbot grism 3",
            "wait 100",
            "screenshot second",
            "wait 4",
        ],
    );
    set(
        &mut commands,
        &[
            "set r_rt 1",
            "wait 12",
            "screenshot secondtraced",
            "wait 4",
            "set r_rt 0",
        ],
    );
    // the library is unloaded and comes back in the middle of the game
    set(
        &mut commands,
        &["vid_restart", "wait 40", "screenshot restarted", "wait 4"],
    );
    set(
        &mut commands,
        &[
            "r_gamma 1.4",
            "wait 4",
            "screenshotJPEG jpeg",
            "wait 4",
            "imagelist",
            "shaderlist",
        ],
    );
    set(
        &mut commands,
        &[
            "rt_timings",
            "video clip",
            "wait 8",
            "stopvideo",
            "disconnect",
            "wait 20",
        ],
    );
    let outcome = run("vk", (320, 240), commands);
    for (name, picture) in &outcome.pictures {
        keep_picture(picture, &format!("session-{name}"));
    }
    for name in [
        "classic",
        "traced",
        "back",
        "second",
        "secondtraced",
        "restarted",
    ] {
        assert_plausible(outcome.picture(name), name);
    }
    assert_ne!(
        outcome.picture("classic"),
        outcome.picture("traced"),
        "r_rt changes nothing"
    );
    // Lifts and items have moved on meanwhile, so the picture is not the same one.
    let [back, traced] = ["back", "traced"]
        .map(|name| compare(outcome.picture("classic"), outcome.picture(name)).unwrap());
    assert!(back.ssim > traced.ssim, "{back:?} {traced:?}");
    outcome.assert_clean();
    assert!(
        outcome.log.contains("screenshots/jpeg.jpg"),
        "{}",
        outcome.log_end()
    );
}

#[test]
fn errors_drop_to_the_menu() {
    if !real::available() {
        return;
    }
    let mut commands = vec!["devmap no_such_map".to_string()];
    set(&mut commands, &["wait 10"]);
    commands.extend(start_map("oa_dm1"));
    commands.extend(picture(VIEWS[0].1, 4, "after"));
    let outcome = run("vk", (320, 240), commands);
    assert_plausible(outcome.picture("after"), "after the error");
    assert_eq!(outcome.status, Some(0), "{}", outcome.log_end());
}

#[test]
fn many_restarts_and_map_changes() {
    if !real::available() {
        return;
    }
    let rounds = if testkit::is_set("RELIGHT_FULL") {
        40
    } else {
        3
    };
    let mut commands = vec!["set timescale 1000".to_string()];
    for round in 0..rounds {
        let map = VIEWS[round % VIEWS.len()].0;
        set(
            &mut commands,
            &[
                &format!("set r_rt {}", round % 2),
                &format!("devmap {map}"),
                "wait 60",
            ],
        );
        set(&mut commands, &["vid_restart", "wait 20"]);
    }
    set(&mut commands, &["screenshot last", "wait 4"]);
    let outcome = run("vk", (320, 240), commands);
    assert_plausible(outcome.picture("last"), "the last frame");
    outcome.assert_clean();
}

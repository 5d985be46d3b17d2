//! Console variables, lists and debugging aids: the real engine with this renderer beside the same engine with its own
//! OpenGL one.

#![forbid(unsafe_code)]

use std::collections::BTreeSet;

use relight::compare::compare;
use tests::data::keep_picture;
use tests::real::{self, Outcome, Run, picture, start_map};

fn run(renderer: &'static str, commands: &[String]) -> Outcome {
    let cvars = [("r_rt", "0"), ("r_vkValidation", "1")]
        .map(|(n, v)| (n.to_string(), v.to_string()))
        .to_vec();
    let outcome = Run {
        files: Vec::new(),
        cvars,
        renderer,
        width: 640,
        height: 480,
        commands: commands.to_vec(),
        limit: 900,
    }
    .go();
    outcome.assert_clean();
    outcome
}

/// The same commands on both renderers: opengl1's outcome and ours.
fn both(commands: &[String]) -> (Outcome, Outcome) {
    (run("opengl1", commands), run("vk", commands))
}

/// Lines that `command` printed.
fn printed(outcome: &Outcome, command: &str) -> Vec<String> {
    let begin = format!("BEGIN {command}");
    let lines = outcome.log.lines().skip_while(|line| *line != begin);
    lines
        .skip(1)
        .take_while(|line| *line != "END")
        .map(str::to_string)
        .collect()
}

fn print(commands: &mut Vec<String>, command: &str) {
    commands.extend([
        format!("echo BEGIN {command}"),
        command.into(),
        "echo END".into(),
    ]);
}

/// `flags name "value"` of the renderer's own variables.
fn renderer_cvars(outcome: &Outcome) -> BTreeSet<String> {
    printed(outcome, "cvarlist")
        .iter()
        .map(|line| line.to_ascii_lowercase())
        // created by a `set`, known to no renderer
        .filter(|line| !line.contains('?'))
        .filter(|line| {
            let name = line.get(10..).unwrap_or("");
            name.starts_with("r_")
                || name.starts_with("cg_shadows")
                || name.starts_with("com_altivec")
        })
        .collect()
}

#[test]
fn variables_and_lists_are_the_engines_own() {
    if !real::available() {
        return;
    }
    let mut commands = vec!["vid_restart".to_string(), "wait 10".to_string()];
    print(&mut commands, "cvarlist");
    commands.extend(start_map("oa_dm1"));
    for command in [
        "imagelist",
        "shaderlist",
        "shaderlist sorted",
        "skinlist",
        "modellist",
        "modelist",
    ] {
        print(&mut commands, command);
    }
    let (reference, ours) = both(&commands);

    let (theirs, own) = (renderer_cvars(&reference), renderer_cvars(&ours));
    assert!(theirs.len() >= 100, "{} variables", theirs.len());
    let missing: Vec<_> = theirs.difference(&own).collect();
    assert!(missing.is_empty(), "different or missing: {missing:#?}");

    for command in ["skinlist", "modellist", "modelist"] {
        assert!(printed(&reference, command).len() > 8, "{command}");
        assert_eq!(
            printed(&reference, command),
            printed(&ours, command),
            "{command}"
        );
    }
    // What each renderer draws with itself differs; what the game requested does not, nor its order, in which
    // materials of equal sort are drawn. Those without a picture are never drawn.
    let shaders = |outcome: &Outcome, command: &str| {
        let mut lines = printed(outcome, command);
        lines.retain(|line| {
            line.split_once(" : ")
                .is_some_and(|(_, name)| !name.starts_with(['*', '<']))
                && !(command.ends_with("sorted") && line.ends_with("(DEFAULTED)"))
        });
        lines
    };
    for command in ["shaderlist", "shaderlist sorted"] {
        let theirs = shaders(&reference, command);
        assert!(theirs.len() > 300);
        assert_eq!(theirs, shaders(&ours, command), "{command}");
    }
    // number: width x height, then what the GPU makes of it, and the name
    let images = |outcome: &Outcome| {
        printed(outcome, "imagelist")
            .iter()
            .filter_map(|line| {
                let (number, image) = line.split_once(": ")?;
                number.trim().parse::<u32>().ok()?;
                let (size, name) = (image.get(..9)?, image.rsplit(' ').next()?);
                (!name.starts_with('*') || name.starts_with("*lightmap"))
                    .then(|| format!("{size} {name}"))
            })
            .collect::<BTreeSet<_>>()
    };
    assert!(images(&reference).len() > 200);
    assert_eq!(images(&reference), images(&ours));
}

/// A setting, its value, and how similar the pictures are at least.
const SHOWN: &[(&str, &str, f64)] = &[
    ("r_lightmap", "1", 0.99),
    ("r_textureMode", "GL_NEAREST_MIPMAP_NEAREST", 0.98),
    ("r_nocurves", "1", 0.99),
    ("r_debugSort", "3", 0.99),
    ("r_gamma", "2", 0.99),
    // lines are drawn by each driver's own rules
    ("r_showtris", "1", 0.96),
    ("r_shownormals", "1", 0.93),
];

/// The same for settings that count when a map is loaded.
const LOADED: &[(&str, &str, f64)] = &[
    ("r_singleShader", "1", 0.99),
    ("r_colorMipLevels", "1", 0.98),
    ("r_picmip", "3", 0.99),
    ("r_fullbright", "1", 0.99),
    // the game takes a high one back at once, which counts from the next start on
    ("r_intensity", "4", 0.99),
    ("r_greyscale", "0.5", 0.99),
];

#[test]
fn settings_change_the_picture_as_in_the_engine() {
    if !real::available() {
        return;
    }
    let camera = "936 192 290 180";
    let mut commands = start_map("oa_dm5");
    commands.extend(picture(camera, 30, "base"));
    for (name, value, _) in SHOWN {
        commands.extend([format!("set {name} {value}"), "wait 8".into()]);
        commands.extend([format!("screenshot {name}"), "wait 4".into()]);
        commands.extend([format!("reset {name}"), "wait 4".into()]);
    }
    for (name, value, _) in LOADED {
        commands.extend([
            format!("set {name} {value}"),
            "vid_restart".into(),
            "wait 40".into(),
        ]);
        commands.extend([
            format!("screenshot {name}"),
            "wait 4".into(),
            format!("reset {name}"),
        ]);
    }
    let (reference, ours) = both(&commands);
    for (name, value, least) in SHOWN.iter().chain(LOADED) {
        let (theirs, own) = (reference.picture(name), ours.picture(name));
        keep_picture(theirs, &format!("setting-{name}-opengl1"));
        keep_picture(own, &format!("setting-{name}-classic"));
        let same = compare(theirs, own).unwrap();
        let changed = compare(ours.picture("base"), own).unwrap();
        println!(
            "{name} {value}: {same:?}, changed {:.2}",
            changed.mean_absolute
        );
        assert!(same.ssim >= *least, "{name} {value}: {same:?}");
        assert!(
            changed.mean_absolute > 0.3,
            "{name} {value} changes nothing: {changed:?}"
        );
    }
}

//! What players ask for in the console: presets, reports, benchmarks.

use super::support::{engine_in_map, for_every_engine, image_of, text_of};
use exr::prelude::{ReadChannels, ReadLayers};
use tests::engine::{Engine, View};
use tests::maps::{HERE, ROOMS};

for_every_engine!(
    presets_set_what_decides_about_cost,
    a_report_has_what_developers_ask_for_and_nothing_personal,
    a_benchmark_measures_a_path_and_says_what_is_wrong,
);

/// Runs a command and draws a frame; what was printed.
fn ask(engine: &mut Engine, command: &str) -> String {
    engine.take_messages();
    engine.command(command).unwrap();
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    text_of(&engine.take_messages())
}

fn presets_set_what_decides_about_cost() {
    let mut engine = engine_in_map();
    let printed = ask(&mut engine, "rt_preset");
    assert!(printed.contains("* high"), "{printed}");
    assert!(printed.contains("usage: rt_preset NAME"), "{printed}");
    let printed = ask(&mut engine, "rt_preset LOW");
    assert!(printed.contains("rt_preset low"), "{printed}");
    for (name, value) in [("rt_scale", "0.5"), ("rt_bounces", "0")] {
        assert_eq!(engine.cvar(name).as_deref(), Some(value), "{name}");
    }
    assert!(ask(&mut engine, "rt_preset").contains("* low"));
    // A setting changed by hand leaves the preset.
    engine.set("rt_bounces", "2");
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    assert!(!ask(&mut engine, "rt_preset").contains('*'));
    assert!(ask(&mut engine, "rt_preset best").contains("usage: rt_preset NAME"));

    assert!(ask(&mut engine, "rt_preset auto").contains("set r_rt 1 and start a map first"));
    assert_eq!(engine.cvar("rt_bounces").as_deref(), Some("2"));
    engine.assert_clean();
}

#[test]
fn a_menu_is_drawn_over_the_game_and_closes_without_a_trace() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    let before = engine.picture(&view).unwrap();
    let cvars = ["r_rt", "rt_scale", "rt_bounces"];
    let values: Vec<_> = cvars.map(|name| engine.cvar(name)).into();
    engine.take_messages();
    engine.command("rt_menu").unwrap();
    let open = engine.picture(&view).unwrap();
    // egui lays out a window in its first frame and draws it in the second
    let open = (engine.picture(&view).ok()).unwrap_or(open);
    let alike = relight::compare::compare(&before, &open).unwrap();
    assert!(alike.ssim < 0.97, "no menu: {alike:?}");
    // keys along the widgets, and enter: a setting changes
    for _ in 0..12 {
        engine.command("rt_menu down").unwrap();
        engine.picture(&view).unwrap();
        engine.command("rt_menu enter").unwrap();
        engine.picture(&view).unwrap();
        if cvars.map(|name| engine.cvar(name)).as_slice() != values {
            break;
        }
    }
    assert_ne!(cvars.map(|name| engine.cvar(name)).as_slice(), values);
    for (name, value) in cvars.iter().zip(&values) {
        engine.set(name, value.as_deref().unwrap());
    }
    engine.command("rt_menu close").unwrap();
    engine.picture(&view).unwrap();
    let after = engine.picture(&view).unwrap();
    let alike = relight::compare::compare(&before, &after).unwrap();
    assert!(alike.ssim > 0.9999, "{alike:?}");
    // the command closes it, too, and keys for a closed menu do nothing
    engine.command("rt_menu").unwrap();
    engine.command("rt_menu").unwrap();
    engine.command("rt_menu enter").unwrap();
    engine.picture(&view).unwrap();
    let after = engine.picture(&view).unwrap();
    let alike = relight::compare::compare(&before, &after).unwrap();
    assert!(alike.ssim > 0.9999, "{alike:?}");
    assert!(ask(&mut engine, "rt_menu sideways").contains("usage: rt_menu"));
    engine.assert_clean();
}

#[test]
fn photos_of_each_kind_are_written_while_the_game_goes_on() {
    let mut engine = engine_in_map();
    let view = View::new(HERE, 30.0);
    assert!(ask(&mut engine, "rt_photo").contains("set r_rt 1"));
    engine.set("r_rt", "1");
    engine.picture(&view).unwrap();
    assert!(ask(&mut engine, "rt_photo png").contains("give rt_photo first"));
    let before = engine.cvar("rt_exposure");
    engine.command("rt_photo").unwrap();
    engine.picture(&view).unwrap();
    assert!(ask(&mut engine, "rt_photo bmp").contains("usage: rt_photo"));
    let (width, height) = (view.width as u32, view.height as u32);
    for (word, file, wanted) in [
        ("png 2", "photo0000.png", Some((2 * width, 2 * height))),
        ("exr 2", "photo0001.exr", Some((2 * width, 2 * height))),
        ("360 1", "photo0002.png", None),
    ] {
        engine.command(&format!("rt_photo {word}")).unwrap();
        let path = format!("screenshots/{file}");
        for _ in 0..200 {
            engine.picture(&view).unwrap();
            if engine.read_file(&path).is_some() {
                break;
            }
        }
        let bytes = engine.read_file(&path).expect(&path);
        let (size, mean) = if file.ends_with(".exr") {
            size_and_mean_of_exr(&bytes)
        } else {
            let picture = image::load_from_memory(&bytes).unwrap().to_rgb32f();
            let mean = picture.iter().sum::<f32>() / picture.len() as f32;
            (picture.dimensions(), mean)
        };
        match wanted {
            Some(wanted) => assert_eq!(size, wanted, "{word}"),
            None => assert!(size.0.abs_diff(2 * size.1) <= 2, "{word}: {size:?}"),
        }
        assert!(mean > 0.005, "{word}: {mean}");
    }
    engine.command("rt_photo").unwrap();
    engine.picture(&view).unwrap();
    assert_eq!(engine.cvar("rt_exposure"), before);
    engine.assert_clean();
}

#[test]
fn the_preset_of_a_software_device_is_the_cheapest() {
    let mut engine = engine_in_map();
    engine.set("r_rt", "1");
    engine.picture(&View::new(HERE, 30.0)).unwrap();
    let printed = ask(&mut engine, "rt_preset auto");
    if printed.contains("draws in software") {
        assert_eq!(engine.cvar("rt_scale").as_deref(), Some("0.5"), "{printed}");
    } else {
        assert!(printed.contains("measuring"), "{printed}");
    }
    engine.assert_clean();
}

/// Width and height, and the mean of the three channels.
fn size_and_mean_of_exr(file: &[u8]) -> ((u32, u32), f32) {
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size, _| (size, 0.0),
            |sum, _, (r, g, b): (f32, f32, f32)| sum.1 += r + g + b,
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(file))
        .unwrap();
    let (size, sum): (_, f32) = read.layer_data.channel_data.pixels;
    let values = size.0 * size.1 * 3;
    ((size.0 as u32, size.1 as u32), sum / values as f32)
}

fn a_report_has_what_developers_ask_for_and_nothing_personal() {
    let mut engine = engine_in_map();
    engine.set("rt_bounces", "2");
    let shown = engine.picture(&View::new(HERE, 30.0)).unwrap();
    engine.take_messages();
    for number in 0..2 {
        engine.command("report").unwrap();
        let path = format!("reports/relight000{number}.zip");
        let printed = text_of(&engine.take_messages());
        assert!(printed.contains(&format!("Wrote {path}")), "{printed}");
    }
    let bytes = engine.read_file("reports/relight0001.zip").unwrap();
    let mut zip = zip::ZipArchive::new(std::io::Cursor::new(bytes)).unwrap();
    let mut file = |name: &str| {
        let mut bytes = Vec::new();
        let mut file = zip.by_name(name).unwrap();
        std::io::Read::read_to_end(&mut file, &mut bytes).unwrap();
        bytes
    };
    let mut text = |name: &str| String::from_utf8(file(name)).unwrap();
    let texts = [
        "about.txt",
        "device.txt",
        "settings.txt",
        "timings.json",
        "log.txt",
    ]
    .map(&mut text);
    let [about, device, settings, timings, log] = &texts;
    assert!(about.contains("map: maps/rooms.bsp"), "{about}");
    assert!(device.contains("driver"), "{device}");
    assert!(
        settings.contains("* rt_bounces \"2\" (default \"1\")"),
        "{settings}"
    );
    assert!(serde_json::from_str::<serde_json::Value>(timings).unwrap()["passes"].is_array());
    assert!(log.contains("Relight on"), "{log}");
    let home = engine.home().display().to_string();
    for text in &texts {
        for word in std::env::var("HOME")
            .into_iter()
            .filter(|home| home.len() > 1)
        {
            assert!(!text.contains(&word), "{word} in {text}");
        }
        assert!(!text.contains(&home), "{home} in {text}");
    }
    let picture = image_of(&file("picture.png"), "png");
    let alike = relight::compare::compare(&shown, &picture).unwrap();
    assert!(alike.ssim > 0.9999, "{alike:?}");

    // Where the engine cannot write.
    std::fs::remove_dir_all(engine.home().join("reports")).unwrap();
    std::fs::write(engine.home().join("reports"), b"no folder").unwrap();
    engine.command("report").unwrap();
    let printed = text_of(&engine.take_messages());
    assert!(
        printed.contains("reports/relight0000.zip could not be written"),
        "{printed}"
    );
    engine.assert_clean();
}

/// Draws frames until something printed contains `end`; what was printed.
fn play_until(engine: &mut Engine, end: &str) -> String {
    let mut printed = String::new();
    for _ in 0..200 {
        engine.picture(&View::new(HERE, 30.0)).unwrap();
        printed += &text_of(&engine.take_messages());
        if printed.contains(end) {
            return printed;
        }
    }
    panic!("no {end:?} in {printed}");
}

/// The result in a file.
fn result_of(engine: &Engine, path: &str) -> serde_json::Value {
    let bytes = engine.read_file(path).expect(path);
    serde_json::from_slice(&bytes).expect("JSON")
}

fn a_benchmark_measures_a_path_and_says_what_is_wrong() {
    let mut engine = engine_in_map();
    let shown = engine.picture(&View::new(HERE, 30.0)).unwrap();
    engine.take_messages();
    let says = |engine: &mut Engine, command: &str, part: &str| {
        engine.command(command).unwrap();
        let printed = text_of(&engine.take_messages());
        assert!(printed.contains(part), "{command}: {printed}");
    };
    says(&mut engine, "rt_benchmark a b", "usage: rt_benchmark");
    says(&mut engine, "rt_benchmark stop", "none is measuring");
    says(
        &mut engine,
        "rt_benchmark lost",
        "there is no paths/lost.txt",
    );
    says(&mut engine, "rt_benchmark demo a;quit", "letters, digits");
    for (name, text, part) in [
        ("empty", "# nothing\n", "has no frames"),
        ("bad", "0 1 2 3\n", "line 1"),
    ] {
        engine.insert_file(&format!("paths/{name}.txt"), text.into());
        says(&mut engine, &format!("rt_benchmark {name}"), part);
    }

    let lines = (0..5).map(|i| format!("{} -100 0 40 0 {} 0 90 74\n", i * 16, i * 30));
    engine.insert_file("paths/short.txt", lines.collect::<String>().into());
    for number in 0..2 {
        says(&mut engine, "rt_benchmark short", "benchmark: 5 frames");
        says(
            &mut engine,
            "rt_benchmark short",
            "rt_benchmark stop ends it",
        );
        // nothing is measured while a menu hides the map
        engine.begin_frame(0).unwrap();
        engine.end_frame().unwrap();
        let printed = play_until(&mut engine, "frames/s");
        let path = format!("relight/benchmark-rooms-000{number}.json");
        assert!(printed.contains(&format!("Wrote {path}")), "{printed}");
        let version = env!("CARGO_PKG_VERSION");
        assert!(
            printed.contains(&format!("Relight {version}, ")),
            "{printed}"
        );
        assert!(
            printed.contains(", rooms, 320x240, classic look: "),
            "{printed}"
        );
        let result = result_of(&engine, &path);
        assert_eq!(result["frames"], 5);
        assert_eq!(result["map"], "rooms");
        assert_eq!(result["route"], "paths/short.txt");
        assert_eq!(result["look"], "classic");
        for times in ["gpu_ms", "frame_ms"] {
            let time = |part: &str| result[times][part].as_f64().expect(part);
            assert!(time("median") > 0.0 && time("median") <= time("p95"));
            assert!(time("p5") <= time("median") && time("p99") <= time("worst"));
        }
        assert!(!result["passes"].as_object().unwrap().is_empty());
        assert!(result["memory"]["textures"].as_u64().unwrap() > 0);
    }
    // the game's view is back
    assert_eq!(engine.picture(&View::new(HERE, 30.0)).unwrap(), shown);

    says(&mut engine, "rt_benchmark", "benchmark: 240 frames");
    says(&mut engine, "rt_benchmark stop", "stopped");
    says(&mut engine, "rt_benchmark", "benchmark: 240 frames");
    engine.start_map(ROOMS).unwrap();
    let printed = text_of(&engine.take_messages());
    assert!(
        printed.contains("the map ended after 0 of 240"),
        "{printed}"
    );
    engine.shutdown(false).unwrap();
    engine.begin_registration().unwrap();
    says(&mut engine, "rt_benchmark", "start a map first");
    engine.assert_clean();
}

#[test]
fn a_benchmark_of_a_demo_begins_with_its_map_and_ends_with_it() {
    let mut engine = engine_in_map();
    engine.take_messages();
    engine.command("rt_benchmark demo one").unwrap();
    // the stand-in plays none; the next map is the demo's
    let asked = engine.violations();
    assert!(asked.iter().any(|v| v.contains("demo one")), "{asked:?}");
    engine.start_map(ROOMS).unwrap();
    for _ in 0..15 {
        engine.picture(&View::new(HERE, 30.0)).unwrap();
    }
    engine.start_map(ROOMS).unwrap();
    let printed = text_of(&engine.take_messages());
    assert!(printed.contains("frames/s"), "{printed}");
    let result = result_of(&engine, "relight/benchmark-rooms-0000.json");
    assert_eq!(
        (&result["frames"], &result["route"]),
        (&5.into(), &"demo one".into())
    );
}

//! Devices that nobody has here: sessions below the layer of the crate `layer`.

#![forbid(unsafe_code)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use relight::compare::compare;
use tests::data;
use tests::layer::{Outcome, Session};

/// The program that plays a session.
const PROGRAM: &str = env!("CARGO_BIN_EXE_session");
/// Sessions at a time, by the cores: most of one waits for the compiler of shaders, which uses one core.
fn at_once() -> usize {
    let cores = std::thread::available_parallelism().map_or(1, |cores| cores.get());
    cores.max(2)
}

/// Whether there is a Vulkan device; otherwise the test is reported as skipped.
fn available() -> bool {
    testkit::device(renderer_vk::probe(None)).is_some()
}

fn play(session: &Session) -> Outcome {
    session.play(Path::new(PROGRAM))
}

/// Plays sessions and gives each outcome to `look`, which returns what is wrong with it; fails if anything is.
fn play_all(sessions: &[Session], look: impl Fn(&Session, &Outcome) -> Option<String> + Sync) {
    let (next, wrong) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..at_once() {
            scope.spawn(|| {
                while let Some(session) = sessions.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let outcome = play(session);
                    let found = outcome.failure.clone().or_else(|| look(session, &outcome));
                    if let Some(found) = found {
                        let line = format!("{session:?}: {found}\n{}", outcome.text);
                        wrong.lock().expect("the list").push(line);
                    }
                }
            });
        }
    });
    let wrong = wrong.into_inner().expect("the list");
    assert!(
        wrong.is_empty(),
        "{} of {} sessions:\n{}",
        wrong.len(),
        sessions.len(),
        wrong.join("\n")
    );
}

/// Arguments of a session in these looks. The lights of directives need no calibration, which takes seconds.
fn looks(looks: &str) -> Vec<String> {
    ["--looks", looks, "--set", "rt_lights", "prior"]
        .map(str::to_owned)
        .to_vec()
}

/// `count` numbers from 1 to `last`, first and last among them.
fn spread(last: u32, count: u32) -> BTreeSet<u32> {
    let steps = count.max(2) - 1;
    (0..=steps.min(last))
        .map(|i| 1 + (u64::from(last - 1) * u64::from(i) / u64::from(steps.min(last))) as u32)
        .collect()
}

/// A session for `count` calls of each function and each error that it may return, or every `stride`th of these.
fn faults(of: &str, count: u32, stride: usize) -> Vec<Session> {
    let arguments = looks(of);
    let whole = play(&Session {
        arguments: arguments.clone(),
        ..Session::default()
    });
    assert_eq!(whole.failure, None, "{}", whole.text);
    assert_eq!(
        whole.unknown,
        Vec::<String>::new(),
        "the layer does not know their functions"
    );
    let mut all = Vec::new();
    for (function, (last, results)) in &whole.calls {
        for number in spread(*last, count) {
            all.extend(results.iter().map(|result| Session {
                fault: Some(format!("{function} {number} {result}")),
                arguments: arguments.clone(),
                ..Session::default()
            }));
        }
    }
    all.into_iter().step_by(stride).collect()
}

/// What is wrong with a session in which a call failed: it has to recover, or to end with a line for the player.
fn recovers(_: &Session, outcome: &Outcome) -> Option<String> {
    match &outcome.ended {
        Some(line) if !line.contains("+set cl_renderer") => {
            Some(format!("no way out is named: {line}"))
        }
        _ if !outcome.struck => Some("the call was not made".to_owned()),
        _ => None,
    }
}

#[test]
fn a_call_that_fails_neither_crashes_nor_hangs() {
    if !available() {
        return;
    }
    if std::env::var_os("RELIGHT_DEVICES").is_some() {
        play_all(&faults("c", u32::MAX, 1), recovers);
        play_all(&faults("ct", 3, 1), recovers);
    } else {
        play_all(&faults("c", 2, 7), recovers);
    }
}

/// The least SSIM of a picture on a limited device beside that on the driver's own: formats and tracers differ.
const CLASSIC_SSIM: f64 = 0.99;
const TRACED_SSIM: f64 = 0.9;

/// The folder of the profiles.
fn folder() -> PathBuf {
    data::repository().join("tests/devices")
}

fn profile(name: &str) -> PathBuf {
    folder().join(format!("{name}.txt"))
}

/// The names of all profiles.
fn profiles() -> Vec<String> {
    let files = std::fs::read_dir(folder()).expect("the folder").flatten();
    let stem = |file: std::fs::DirEntry| Some(file.path().file_stem()?.to_str()?.to_owned());
    let mut names: Vec<String> = files.filter_map(stem).collect();
    names.sort();
    names
}

/// The values of a key of a profile.
fn values(name: &str, key: &str) -> Vec<String> {
    let text = std::fs::read_to_string(profile(name)).expect("a profile");
    let lines = text
        .lines()
        .filter_map(|line| line.strip_prefix(key)?.strip_prefix(' '));
    lines.map(str::to_owned).collect()
}

/// What is wrong with a session on a limited device, beside the same on the driver's own.
fn plays_alike(session: &Session, outcome: &Outcome, reference: &Outcome) -> Option<String> {
    let name = session.profiles[0].file_stem()?.to_str()?;
    let refused = values(name, "refused").join(" ");
    if !refused.is_empty() {
        let line = outcome.ended.clone().unwrap_or_default();
        let all = refused.split(' ').all(|word| line.contains(word));
        return (!all).then(|| format!("{refused} is not what the line names: {line}"));
    }
    if let Some(line) = outcome.ended.iter().chain(&outcome.errors).next() {
        return Some(line.clone());
    }
    for (look, least) in [("classic", CLASSIC_SSIM), ("traced", TRACED_SSIM)] {
        let Some(expected) = reference.pictures.get(look) else {
            continue;
        };
        let Some(picture) = outcome.pictures.get(look) else {
            return Some(format!("no picture of the {look} look"));
        };
        data::keep_picture(picture, &format!("{name}-{look}"));
        let found = compare(expected, picture).expect("pictures of a size");
        println!("{name}, {look}: SSIM {:.4}", found.ssim);
        if found.ssim < least {
            return Some(format!("{look}: {found:?}"));
        }
    }
    None
}

#[test]
fn every_device_draws_what_the_drivers_own_does_or_names_what_it_lacks() {
    if !available() {
        return;
    }
    let full = std::env::var_os("RELIGHT_DEVICES").is_some();
    let mut arguments = looks("ct");
    let names = match full {
        true => profiles(),
        false => {
            // Compilation of ray tracing pipelines takes minutes on a software device.
            arguments.extend(["--set", "rt_tracer", "compute"].map(str::to_owned));
            ["gen7", "mali", "required-only"]
                .map(str::to_owned)
                .to_vec()
        }
    };
    let session = |profiles| Session {
        profiles,
        arguments: arguments.clone(),
        ..Session::default()
    };
    let reference = play(&session(Vec::new()));
    assert_eq!(reference.failure, None, "{}", reference.text);
    assert!(
        reference
            .pictures
            .values()
            .all(|p| p.mean_luminance() > 3.0),
        "black"
    );
    let sessions: Vec<Session> = names
        .iter()
        .map(|name| session(vec![profile(name)]))
        .collect();
    play_all(&sessions, |session, outcome| {
        plays_alike(session, outcome, &reference)
    });
}

#[test]
fn the_best_of_several_devices_draws() {
    if !available() {
        return;
    }
    let (own, shared) = ("NVIDIA GeForce RTX 3060", "Intel(R) Xe Graphics (TGL GT2)");
    // profiles, `r_device`, the call that fails, the device that draws
    let cases = [
        ("xe ampere", "", "", own),
        ("ampere xe", "", "", own),
        ("lavapipe-old gen7 xe", "", "", shared),
        ("ampere xe", "Xe", "", shared),
        ("xe ampere", "0", "", shared),
        // `GetRefAPI` makes the first device, to see whether there is one
        (
            "ampere xe",
            "",
            "vkCreateDevice 2 ERROR_INITIALIZATION_FAILED",
            shared,
        ),
    ];
    let session = |(profiles, device, fault, _): &(&str, &str, &'static str, &str)| {
        let mut arguments = looks("c");
        arguments.extend(["--set", "r_device", device].map(str::to_owned));
        Session {
            profiles: profiles.split(' ').map(profile).collect(),
            fault: Some((*fault).to_owned()).filter(|fault| !fault.is_empty()),
            arguments,
            ..Session::default()
        }
    };
    let sessions: Vec<Session> = cases.iter().map(session).collect();
    play_all(&sessions, |session, outcome| {
        let case = sessions.iter().position(|s| std::ptr::eq(s, session))?;
        let name = cases[case].3;
        let drawn = outcome.text.contains(&format!("Relight on {name}:"));
        (!drawn).then(|| format!("{name} does not draw"))
    });
}

#[test]
fn a_window_may_be_minimised_and_resized_in_every_frame() {
    if !available() {
        return;
    }
    let sizes = [
        "320x240", "0x0", "0x0", "640x480", "1x1", "321x17", "16x4096", "0x0", "320x240",
    ];
    let outcome = play(&Session {
        sizes: sizes.to_vec(),
        arguments: [looks("c"), ["--frames", "12"].map(str::to_owned).to_vec()].concat(),
        ..Session::default()
    });
    assert_eq!(
        (outcome.failure, outcome.ended, outcome.errors),
        (None, None, vec![]),
        "{}",
        outcome.text
    );
    let made = outcome
        .calls
        .get("vkCreateSwapchainKHR")
        .map_or(0, |(number, _)| *number);
    assert!(made >= 6, "{made} swapchains for 6 sizes");
}

/// A session on a display of the layer: its interval in milliseconds, or `mute`.
fn on_display(display: &'static str, low_latency: &str, frames: &str) -> Session {
    let more = [
        "--costs",
        "--frames",
        frames,
        "--set",
        "r_swapInterval",
        "1",
    ];
    let more = more
        .into_iter()
        .chain(["--set", "r_lowLatency", low_latency]);
    Session {
        display: Some(display),
        // no software device, for which presenting is deferred
        profiles: vec![profile("ampere")],
        arguments: [looks("c"), more.map(str::to_owned).collect()].concat(),
        ..Session::default()
    }
}

#[test]
fn at_most_one_frame_waits_for_a_display_that_is_observed() {
    if !available() {
        return;
    }
    for (low_latency, most) in [("0", 2), ("1", 1), ("2", 1)] {
        let outcome = play(&on_display("40", low_latency, "60"));
        assert_eq!(
            (&outcome.failure, &outcome.ended, outcome.errors.len()),
            (&None, &None, 0),
            "{}",
            outcome.text
        );
        let queued = &outcome.queued;
        println!("r_lowLatency {low_latency}: {queued:?}");
        assert!(queued.len() > 60 && queued.iter().all(|n| *n <= most));
        let printed = outcome.text.contains("from input until shown, ");
        assert!(printed, "{}", outcome.text);
    }
}

#[test]
fn a_display_that_shows_nothing_does_not_hold_the_game() {
    if !available() {
        return;
    }
    let outcome = play(&on_display("mute", "2", "60"));
    assert_eq!(outcome.failure, None, "{}", outcome.text);
    let polls = outcome.calls.get("vkWaitForPresentKHR").map_or(0, |c| c.0);
    assert!(polls > 60, "{polls} calls");
    // the renderer after the restart draws a single frame, which has none before it
    assert_eq!(outcome.waits, 1, "waits of a quarter of a second");
}

#[test]
fn a_wait_for_the_display_may_fail() {
    if !available() {
        return;
    }
    let whole = play(&on_display("5", "1", "6"));
    assert_eq!(whole.failure, None, "{}", whole.text);
    let (_, results) = &whole.calls["vkWaitForPresentKHR"];
    let mut sessions = Vec::new();
    // how often a display is asked depends on the time that it takes; each frame but the first waits at least once
    for number in [1, 2, 4] {
        sessions.extend(results.iter().map(|result| Session {
            fault: Some(format!("vkWaitForPresentKHR {number} {result}")),
            ..on_display("5", "1", "6")
        }));
    }
    play_all(&sessions, recovers);
}

#[test]
fn a_display_that_is_lost_ends_the_game() {
    if !available() {
        return;
    }
    let Some(display) = tests::display::Display::start() else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let mut command = std::process::Command::new(PROGRAM);
    display.lend_to(&mut command);
    command
        .arg(folder.path())
        .args(["--window", "--frames", "1000000", "--looks", "c"]);
    command
        .env("RELIGHT_LIBRARY", data::library())
        .stdout(std::process::Stdio::piped());
    let mut child = command.spawn().expect("the program `session`");
    let mut lines = std::io::BufReader::new(child.stdout.take().expect("its output"));
    let mut line = String::new();
    // Printed when the map is there.
    while !line.contains("drawing") {
        line.clear();
        let read = std::io::BufRead::read_line(&mut lines, &mut line).expect("its output");
        assert!(read > 0, "it ended before it drew");
    }
    drop(display);
    let start = std::time::Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("the state of a child") {
            break status;
        }
        if start.elapsed().as_secs() > 60 {
            let _ = child.kill();
            panic!("it hangs without its display");
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    };
    assert!(status.code().is_some(), "it crashed: {status}");
}

/// The table of docs/src/devices.md.
fn table() -> String {
    let mut rows = String::from("| file | device | missing | refused |\n|---|---|---|---|\n");
    for name in profiles() {
        let formats = values(&name, "format").into_iter();
        let formats = formats.filter_map(|line| Some(line.split_once(' ')?.0.to_owned()));
        let words = |key| values(&name, key).join(" ");
        let missing: Vec<String> = (words("hide").split_whitespace())
            .chain(words("lacks").split_whitespace())
            .map(str::to_owned)
            .chain(formats)
            .map(|word| format!("`{}`", word.trim_start_matches("VK_")))
            .collect();
        let missing = missing.join(", ").replace(RAY_TRACING, "ray tracing");
        let refused = match values(&name, "refused").join(" ") {
            none if none.is_empty() => "",
            _ => "yes",
        };
        let device = values(&name, "name").join(" ");
        rows += &format!("| `{name}` | {device} | {missing} | {refused} |\n");
    }
    rows
}

/// All extensions of ray tracing in a row of the table.
const RAY_TRACING: &str = "`KHR_acceleration_structure`, `KHR_deferred_host_operations`, `KHR_ray_tracing_pipeline`, `KHR_ray_query`";

#[test]
fn the_page_has_the_table() {
    let path = data::repository().join("docs/src/devices.md");
    let page = std::fs::read_to_string(&path).expect("the page");
    let (begin, end) = ("<!-- devices -->\n", "<!-- /devices -->");
    let (before, rest) = page.split_once(begin).expect("the beginning of the table");
    let (found, after) = rest.split_once(end).expect("its end");
    let table = table();
    if std::env::var_os("RELIGHT_UPDATE").is_some() {
        std::fs::write(&path, format!("{before}{begin}{table}{end}{after}")).expect("the page");
    } else {
        assert_eq!(found, table, "RELIGHT_UPDATE=1 writes it");
    }
}

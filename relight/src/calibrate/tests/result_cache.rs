use super::*;

#[test]
fn results_are_the_same_every_time_and_can_be_kept() {
    let folder = tempfile::tempdir().unwrap();
    let fresh = || room(true, Some(&from_hidden));
    let plain = small();
    let caching = CalibrationOptions {
        cache: Some(CalibrationCache::new(folder.path().join("light"))),
        ..plain.clone()
    };
    let run = |options: &CalibrationOptions| {
        let mut world = fresh();
        let report = calibrate(&mut world, options);
        (lights(&world), report, world.warnings)
    };
    let first = run(&plain);
    let (kept, report, _) = run(&caching);
    assert!(first.0 == kept && !report.cached);
    let (read, report, warnings) = run(&caching);
    assert_eq!(read, first.0);
    assert!(report.cached && warnings.is_empty(), "{warnings:?}");
    let same = CalibrationReport {
        seconds: 0.0,
        cached: false,
        ..report
    };
    assert_eq!(
        same,
        CalibrationReport {
            seconds: 0.0,
            ..first.1
        }
    );
    // Another choice of samples is another result.
    let other = CalibrationOptions {
        seed: 2,
        ..caching.clone()
    };
    assert!(!run(&other).1.cached);

    let files = || std::fs::read_dir(folder.path().join("light")).unwrap();
    assert_eq!(files().count(), 2);
    let paths: Vec<_> = files().map(|f| f.unwrap().path()).collect();
    let whole: Vec<_> = paths.iter().map(|p| std::fs::read(p).unwrap()).collect();
    type Damage<'a> = &'a dyn Fn(&[u8]) -> Vec<u8>;
    let replaced = |b: &[u8], from, to| {
        let text = String::from_utf8_lossy(b);
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1).into_bytes()
    };
    let damages: [Damage<'_>; 9] = [
        &|_| Vec::new(),
        &|b| b[..b.len() / 2].to_vec(),
        &|b| b.iter().map(|c| c ^ 0x80).collect(),
        &|b| [b, b"{}"].concat(),
        &|b| replaced(b, "\"known\":[[", "\"known\":[[-"),
        &|b| replaced(b, "\"known\":[[", "\"known\":[[1,2,3],["),
        &|b| replaced(b, "\"ambient\":[", "\"ambient\":[9e99,"),
        &|b| replaced(b, "\"ambient\":[", "\"ambient\":[1e39],\"x\":["),
        &|b| replaced(b, "\"ambient\"", "\"ambience\""),
    ];
    for (number, damage) in damages.iter().enumerate() {
        for (path, whole) in paths.iter().zip(&whole) {
            std::fs::write(path, damage(whole)).unwrap();
        }
        let (again, report, warnings) = run(&caching);
        assert!(
            !report.cached && warnings.len() == 1,
            "{number}: {warnings:?}"
        );
        assert!(warnings[0].contains(".light: "), "{}", warnings[0]);
        assert_eq!(again, first.0, "{number}");
        // It was written anew.
        assert!(run(&caching).1.cached, "{number}");
    }
    // A file of another version is absent.
    for (path, whole) in paths.iter().zip(&whole) {
        std::fs::write(path, replaced(whole, "\"version\":", "\"version\":1")).unwrap();
    }
    let (again, report, warnings) = run(&caching);
    assert!(!report.cached && warnings.is_empty(), "{warnings:?}");
    assert_eq!(again, first.0);
}

#[test]
fn a_folder_that_cannot_be_used_is_a_warning() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let mut world = room(false, Some(&from_hidden));
    let options = CalibrationOptions {
        samples: 200,
        candidates: 50,
        cache: Some(CalibrationCache::new(file.path())),
        ..Default::default()
    };
    let report = calibrate(&mut world, &options);
    assert!(report.placed > 0 && !world.warnings.is_empty());
    assert!(
        world.warnings.iter().all(|w| w.contains("cannot be")),
        "{:?}",
        world.warnings
    );
}

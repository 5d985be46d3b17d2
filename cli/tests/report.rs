//! `relight report`.

use std::io::Read;
use std::process::{Command, Output};

/// Makes a report where the Vulkan loader finds no driver.
fn report(folder: &std::path::Path, name: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_relight"));
    command.args(["report", "-o", name]).current_dir(folder);
    for drivers in ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"] {
        command.env(drivers, folder.join("none.json"));
    }
    command.output().unwrap()
}

#[test]
fn a_report_without_a_device_has_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(folder.path(), "r.zip");
    assert!(output.status.success(), "{output:?}");
    let file = std::fs::File::open(folder.path().join("r.zip")).unwrap();
    let mut zip = zip::ZipArchive::new(file).unwrap();
    assert_eq!(zip.len(), 3, "texts alone");
    assert!(zip.by_name("settings.txt").is_ok() && zip.by_name("log.txt").is_ok());
    let mut about = String::new();
    let mut file = zip.by_name("about.txt").unwrap();
    file.read_to_string(&mut about).unwrap();
    assert!(about.starts_with("Relight "), "{about}");
    assert!(about.contains("no usable Vulkan device"), "{about}");
}

#[test]
fn a_report_that_is_no_zip_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = report(folder.path(), "r.txt");
    assert!(!output.status.success(), "{output:?}");
    let message = String::from_utf8(output.stderr).unwrap();
    assert!(message.contains("r.txt: reports are .zip"), "{message}");
}

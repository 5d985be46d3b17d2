//! Every compiled shader passes the validator of the SPIR-V tools.

#![forbid(unsafe_code)]

use std::process::Command;

#[test]
fn every_module_is_valid() {
    let Some(validator) = tests::data::tool("spirv-val") else {
        return;
    };
    assert!(!shaders::ALL.is_empty(), "no shader was built");
    let folder = tempfile::tempdir().unwrap();
    let mut failures = Vec::new();
    for (i, module) in shaders::ALL.iter().enumerate() {
        let file = folder.path().join(format!("{i}.spv"));
        let bytes: Vec<u8> = module
            .words()
            .iter()
            .flat_map(|w| w.to_le_bytes())
            .collect();
        std::fs::write(&file, bytes).unwrap();
        let output = Command::new(&validator)
            .args(["--target-env", "vulkan1.2", "--scalar-block-layout"])
            .arg(&file)
            .output()
            .unwrap();
        if !output.status.success() {
            failures.push(format!(
                "{}: {}",
                module.name(),
                String::from_utf8_lossy(&output.stderr)
            ));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    println!("{} modules are valid", shaders::ALL.len());
}

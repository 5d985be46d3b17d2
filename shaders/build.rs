//! Compiles every GLSL stage file beside this script to SPIR-V and writes the Rust statics that hold them.
//!
//! Target: Vulkan 1.2, SPIR-V 1.5. Names (`OpName`, `OpMemberName`) are kept, because the layout test reads them.
//! A file may ask for more than its plain compilation, one comment line for each:
//!
//! ```glsl
//! // variants: QUERY=-DTRACER_QUERY -DWIDTH=4
//! // variants: PIPELINE=-DTRACER_PIPELINE -S rgen
//! ```
//!
//! An output is compiled again only when the text that it was made from (the file, what it includes, its
//! definitions, this script's version) has another hash than the one kept in `OUT_DIR`.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Component, Path, PathBuf};

use glslang::error::GlslangError;
use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderMessage, ShaderSource, ShaderStage,
    SourceLanguage, SpirvVersion, Target, VulkanVersion,
};

/// Part of every content hash: raise it when the way of compiling changes.
const SCRIPT_VERSION: &str = "3 vulkan1.2 spirv1.5 glslang 0.9.1";

/// The file name extensions that are stages, with the `Stage` variant of the library and glslang's value.
const STAGES: [(&str, &str, ShaderStage); 7] = [
    ("vert", "Vertex", ShaderStage::Vertex),
    ("frag", "Fragment", ShaderStage::Fragment),
    ("comp", "Compute", ShaderStage::Compute),
    ("rgen", "RayGeneration", ShaderStage::RayGeneration),
    ("rchit", "ClosestHit", ShaderStage::ClosestHit),
    ("rahit", "AnyHit", ShaderStage::AnyHit),
    ("rmiss", "Miss", ShaderStage::Miss),
];

/// One SPIR-V module to be made.
struct Job {
    /// Name of the Rust static.
    symbol: String,
    /// Path below the shader root, with `/`.
    file: String,
    /// Extension that decides the stage; differs from the file's own for `-S` variants.
    stage: String,
    /// Preprocessor definitions.
    defines: Vec<(String, Option<String>)>,
}

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));

    let mut files = Vec::new();
    collect_files(&root, &root, &mut files);
    files.sort();

    let mut jobs = Vec::new();
    let mut errors = String::new();
    for file in &files {
        let extension = file.rsplit('.').next().unwrap_or_default();
        if STAGES.iter().any(|s| s.0 == extension) {
            match fs::read_to_string(root.join(file)) {
                Ok(text) => jobs_of_file(file, extension, &text, &mut jobs, &mut errors),
                Err(e) => {
                    let _ = writeln!(errors, "{file}: {e}");
                }
            }
        }
    }
    // The folder itself, so that a new file starts this script too.
    println!("cargo::rerun-if-changed=.");

    let mut symbols = BTreeSet::new();
    for job in &jobs {
        if !symbols.insert(job.symbol.clone()) {
            let _ = writeln!(
                errors,
                "{}: the name {} is taken by another file or variant",
                job.file, job.symbol
            );
        }
    }

    let mut generated = String::new();
    for job in &jobs {
        if let Err(e) = build(&root, &out, job) {
            let _ = writeln!(errors, "{e}");
        }
        let stage = STAGES
            .iter()
            .find(|s| s.0 == job.stage)
            .map_or("Compute", |s| s.1);
        let defines: String = job.defines.iter().fold(String::new(), |mut text, (k, v)| {
            let _ = match v {
                Some(v) => write!(text, " -D{k}={v}"),
                None => write!(text, " -D{k}"),
            };
            text
        });
        let _ = write!(
            generated,
            "/// `{file}`{defines}\npub static {symbol}: Spirv = Spirv {{\n    name: \"{file}{defines}\",\n    stage: Stage::{stage},\n    \
             bytes: &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{symbol}.spv\"))),\n}};\n",
            file = job.file,
            symbol = job.symbol,
        );
    }
    let _ = writeln!(
        generated,
        "/// Every module of this crate, in order of file names.\npub static ALL: &[&Spirv] = &["
    );
    for job in &jobs {
        let _ = writeln!(generated, "    &{},", job.symbol);
    }
    generated.push_str("];\n");

    let layouts = layouts(&root);
    assert!(errors.is_empty(), "shader compilation failed\n{errors}");
    for (file, text) in [("modules.rs", generated), ("layouts.rs", layouts)] {
        let file = out.join(file);
        if !fs::read_to_string(&file).is_ok_and(|old| old == text) {
            fs::write(file, text).expect("OUT_DIR can be written");
        }
    }
}

/// A table of the public structures of the `*types.rs` files with the sizes and offsets that the compiler gives them,
/// for the test that compares them with SPIR-V. Nobody has to keep a list of fields that way.
fn layouts(root: &Path) -> String {
    let mut table = String::from(
        "/// Name, size, and name and offset of each field.\npub const LAYOUTS: &[Layout] = &[\n",
    );
    for (module, text) in ["types", "trace_types"].map(|m| (m, texts(root, m))) {
        let mut structure: Option<&str> = None;
        for line in text.lines() {
            let line = line.trim();
            if let Some(name) = line
                .strip_prefix("pub struct ")
                .and_then(|rest| rest.strip_suffix('{'))
            {
                let name = name.trim();
                structure = Some(name);
                let _ = writeln!(
                    table,
                    "    (\"{name}\", size_of::<crate::{module}::{name}>(), &["
                );
            } else if let Some(name) = structure {
                if line == "}" {
                    table.push_str("    ]),\n");
                    structure = None;
                } else if let Some((field, _)) = line
                    .strip_prefix("pub ")
                    .and_then(|rest| rest.split_once(':'))
                {
                    let _ = writeln!(
                        table,
                        "        (\"{field}\", std::mem::offset_of!(crate::{module}::{name}, {field})),"
                    );
                }
            }
        }
    }
    table.push_str("];\n");
    table
}

/// The text of a module of this crate and of the modules in its folder, whose structures it publishes as its own.
fn texts(root: &Path, module: &str) -> String {
    let folder = root.join("src").join(module);
    let mut files: Vec<PathBuf> = fs::read_dir(&folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .collect();
    files.sort();
    files.insert(0, folder.with_extension("rs"));
    let texts = files
        .into_iter()
        .map(|file| fs::read_to_string(file).unwrap_or_default());
    texts.collect()
}

/// Collects the paths of all GLSL files below `folder`, relative to `root`, with `/`.
fn collect_files(root: &Path, folder: &Path, files: &mut Vec<String>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    for entry in entries.flatten() {
        let path = entry.path();
        let name = entry.file_name();
        let name = name.to_string_lossy();
        if path.is_dir() {
            // The crate's own Rust sources, tests and hidden folders hold no GLSL.
            let rust = folder == root && (name == "src" || name == "tests" || name == "target");
            if !rust && !name.starts_with('.') {
                collect_files(root, &path, files);
            }
            continue;
        }
        let extension = name.rsplit('.').next().unwrap_or_default();
        if (extension == "glsl" || STAGES.iter().any(|s| s.0 == extension))
            && let Ok(relative) = path.strip_prefix(root)
        {
            files.push(slashes(relative));
        }
    }
}

/// The plain compilation of a stage file and the variants that its comments ask for.
fn jobs_of_file(file: &str, extension: &str, text: &str, jobs: &mut Vec<Job>, errors: &mut String) {
    let base = symbol_of(file);
    jobs.push(Job {
        symbol: base.clone(),
        file: file.to_owned(),
        stage: extension.to_owned(),
        defines: Vec::new(),
    });
    for (number, line) in text.lines().enumerate() {
        let Some(request) = line.trim().strip_prefix("// variants:") else {
            continue;
        };
        let Some((name, flags)) = request.trim().split_once('=') else {
            let _ = writeln!(
                errors,
                "{file}:{}: expected `// variants: NAME=-DFLAG ...`",
                number + 1
            );
            continue;
        };
        let mut job = Job {
            symbol: format!("{base}_{}", symbol_of(name.trim())),
            file: file.to_owned(),
            stage: extension.to_owned(),
            defines: Vec::new(),
        };
        let mut words = flags.split_whitespace();
        while let Some(word) = words.next() {
            if let Some(define) = word.strip_prefix("-D") {
                let (key, value) = match define.split_once('=') {
                    Some((key, value)) => (key, Some(value.to_owned())),
                    None => (define, None),
                };
                job.defines.push((key.to_owned(), value));
            } else if word == "-S" {
                let stage = words.next().unwrap_or_default();
                if STAGES.iter().any(|s| s.0 == stage) {
                    job.stage = stage.to_owned();
                } else {
                    let _ = writeln!(errors, "{file}:{}: no stage `{stage}`", number + 1);
                }
            } else {
                let _ = writeln!(errors, "{file}:{}: unknown flag `{word}`", number + 1);
            }
        }
        jobs.push(job);
    }
}

/// `raster/draw.vert` becomes `RASTER_DRAW_VERT`.
fn symbol_of(file: &str) -> String {
    file.chars()
        .map(|c| {
            if c.is_ascii_alphanumeric() {
                c.to_ascii_uppercase()
            } else {
                '_'
            }
        })
        .collect()
}

/// A path with `/` between its parts and without `.` and `..` where they can be resolved.
fn slashes(path: &Path) -> String {
    let mut parts: Vec<String> = Vec::new();
    for part in path.components() {
        match part {
            Component::Normal(p) => parts.push(p.to_string_lossy().into_owned()),
            Component::ParentDir => {
                parts.pop();
            }
            _ => {}
        }
    }
    parts.join("/")
}

/// Finds an included file: relative to the includer first, then to the shader root.
fn resolve(root: &Path, includer: &str, header: &str) -> Option<String> {
    let beside = Path::new(includer)
        .parent()
        .map(|p| slashes(&p.join(header)));
    let from_root = slashes(Path::new(header));
    beside
        .into_iter()
        .chain([from_root])
        .find(|candidate| root.join(candidate).is_file())
}

/// Adds the text of `file` and of everything that it may include to `text`.
fn gather(root: &Path, file: &str, seen: &mut BTreeSet<String>, text: &mut String) {
    if !seen.insert(file.to_owned()) {
        return;
    }
    let Ok(source) = fs::read_to_string(root.join(file)) else {
        return;
    };
    let _ = writeln!(text, "{file}\n{source}");
    for line in source.lines() {
        let Some(rest) = line.trim_start().strip_prefix('#') else {
            continue;
        };
        let Some(rest) = rest.trim_start().strip_prefix("include") else {
            continue;
        };
        let name = rest.trim().trim_matches(|c| matches!(c, '"' | '<' | '>'));
        if let Some(found) = resolve(root, file, name) {
            gather(root, &found, seen, text);
        }
    }
}

/// FNV-1a, 64 bits: enough to notice an edit, and the same on every machine.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Answers glslang's `#include` lines.
struct Includes<'a> {
    root: &'a Path,
    file: &'a str,
}

impl IncludeHandler for Includes<'_> {
    fn include(
        &mut self,
        _: IncludeType,
        header: &str,
        includer: &str,
        _: usize,
    ) -> Option<IncludeResult> {
        // glslang names the stage file itself with the empty string.
        let includer = if includer.is_empty() {
            self.file
        } else {
            includer
        };
        let name = resolve(self.root, includer, header)?;
        let data = fs::read_to_string(self.root.join(&name)).ok()?;
        Some(IncludeResult { name, data })
    }
}

/// Compiles one module unless its output is up to date.
fn build(root: &Path, out: &Path, job: &Job) -> Result<(), String> {
    let mut text = format!("{SCRIPT_VERSION} {} {:?}\n", job.stage, job.defines);
    gather(root, &job.file, &mut BTreeSet::new(), &mut text);
    let key = format!("{:016x}", hash(&text));
    let module = out.join(format!("{}.spv", job.symbol));
    let stamp = out.join(format!("{}.hash", job.symbol));
    if module.is_file() && fs::read_to_string(&stamp).is_ok_and(|old| old == key) {
        return Ok(());
    }
    let words = compile(root, job)?;
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    fs::write(&module, bytes)
        .and_then(|()| fs::write(&stamp, key))
        .map_err(|e| format!("{}: {e}", module.display()))
}

/// GLSL to SPIR-V words, or glslang's messages with the file's name in them.
fn compile(root: &Path, job: &Job) -> Result<Vec<u32>, String> {
    let compiler = Compiler::acquire().ok_or("glslang did not start")?;
    let text =
        fs::read_to_string(root.join(&job.file)).map_err(|e| format!("{}: {e}", job.file))?;
    if text.contains('\0') {
        return Err(format!("{}: a NUL byte in the source", job.file));
    }
    let stage = STAGES
        .iter()
        .find(|s| s.0 == job.stage)
        .map(|s| s.2)
        .ok_or_else(|| format!("{}: no stage `{}`", job.file, job.stage))?;
    let options = CompilerOptions {
        source_language: SourceLanguage::GLSL,
        target: Target::Vulkan {
            version: VulkanVersion::Vulkan1_2,
            spirv_version: SpirvVersion::SPIRV1_5,
        },
        version_profile: None,
        messages: ShaderMessage::DEFAULT
            | ShaderMessage::ENHANCED
            | ShaderMessage::DISPLAY_ERROR_COLUMN,
    };
    let defines: Vec<(&str, Option<&str>)> = job
        .defines
        .iter()
        .map(|(k, v)| (k.as_str(), v.as_deref()))
        .collect();
    let text = with_includes(&text);
    let source = ShaderSource::from(text.as_str());
    let mut includes = Includes {
        root,
        file: &job.file,
    };
    let explain = |e: GlslangError| explain(&job.file, &e);
    let input = ShaderInput::new(
        &source,
        stage,
        &options,
        Some(&defines[..]),
        Some(&mut includes),
    )
    .map_err(explain)?;
    let shader = Shader::new(compiler, input).parse().map_err(explain)?;
    let words = shader.compile().map_err(explain)?;
    if words.is_empty() {
        return Err(format!("{}: glslang made no SPIR-V", job.file));
    }
    Ok(words)
}

/// Switches `#include` on, behind the `#version` line: nothing may stand before that. Line numbers stay what they were.
fn with_includes(text: &str) -> String {
    const EXTENSION: &str = "#extension GL_GOOGLE_include_directive : require\n";
    match text.split_once('\n') {
        Some((version, rest)) if version.trim_start().starts_with("#version") => {
            format!("{version}\n{EXTENSION}#line 2\n{rest}")
        }
        _ => format!("#version 460\n{EXTENSION}#line 1\n{text}"),
    }
}

/// glslang calls the stage file `0` in its messages; give it its name: `file:line:column`.
fn explain(file: &str, error: &GlslangError) -> String {
    let text = error.to_string();
    let mut lines = String::new();
    for line in text.lines() {
        let line = line.trim_start_matches("parse error: Log:");
        let line = match line.split_once("ERROR: 0:") {
            Some((before, rest)) => format!("{before}ERROR: shaders/{file}:{rest}"),
            None => line.to_owned(),
        };
        if !line.trim().is_empty() && line.trim() != "DebugLog:" {
            let _ = writeln!(lines, "{line}");
        }
    }
    format!("shaders/{file}:\n{lines}")
}

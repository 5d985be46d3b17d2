//! Compiles every GLSL file of a shader stage beside this script to SPIR-V and writes the Rust statics that hold them.
//!
//! Target: Vulkan 1.2, SPIR-V 1.5. Names (`OpName`, `OpMemberName`) are kept, because the layout test reads them.
//! A file declares further variants, one comment line for each:
//!
//! ```glsl
//! // variants: QUERY=-DTRACER_QUERY -DWIDTH=4
//! // variants: PIPELINE=-DTRACER_PIPELINE -S rgen
//! ```
//!
//! A module is compiled again only when the hash of its source (the file, its includes, its definitions, this script's
//! version) differs from the one stored in `OUT_DIR`.
//!
//! Shared structures and constants are written in Rust, in `src/types` and `src/trace_types`. This script writes them
//! as GLSL to `OUT_DIR/glsl/generated`; shaders include `generated/types.glsl` or `generated/trace_types.glsl`. Ids of
//! specialization constants are written in GLSL; this script writes them as Rust constants.

#[path = "build/shared.rs"]
mod shared;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::path::{Component, Path, PathBuf};

use glslang::error::GlslangError;
use glslang::include::{IncludeHandler, IncludeResult, IncludeType};
use glslang::{
    Compiler, CompilerOptions, Shader, ShaderInput, ShaderMessage, ShaderSource, ShaderStage,
    SourceLanguage, SpirvVersion, Target, VulkanVersion,
};

/// Rust modules whose structures and constants GLSL shares, and the generated file that each one includes.
const SHARED: [(&str, Option<&str>); 2] = [
    ("types", None),
    ("trace_types", Some("generated/types.glsl")),
];

/// Part of every source hash: raise it when the compilation changes.
const SCRIPT_VERSION: &str = "3 vulkan1.2 spirv1.5 glslang 0.9.1";

/// File name extensions of stages, with the library's `Stage` variant and glslang's value.
const STAGES: [(&str, &str, ShaderStage); 7] = [
    ("vert", "Vertex", ShaderStage::Vertex),
    ("frag", "Fragment", ShaderStage::Fragment),
    ("comp", "Compute", ShaderStage::Compute),
    ("rgen", "RayGeneration", ShaderStage::RayGeneration),
    ("rchit", "ClosestHit", ShaderStage::ClosestHit),
    ("rahit", "AnyHit", ShaderStage::AnyHit),
    ("rmiss", "Miss", ShaderStage::Miss),
];

/// One SPIR-V module to compile.
struct Job {
    /// Name of the Rust static.
    symbol: String,
    /// Path below the shader root, with `/`.
    file: String,
    /// Extension that selects the stage; differs from the file's own for `-S` variants.
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
    let layouts = match share(&root, &out) {
        Ok(layouts) => layouts,
        Err(e) => {
            let _ = writeln!(errors, "{e}");
            String::new()
        }
    };
    let constant_ids = constant_ids(&root, &files, &mut errors);
    let roots = Roots([&root, &out.join("glsl")]);
    for file in &files {
        let extension = file.rsplit_once('.').map_or("", |(_, extension)| extension);
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
        let group = match build(&roots, &out, job) {
            Ok(words) => local_size(&words),
            Err(e) => {
                let _ = writeln!(errors, "{e}");
                [1; 3]
            }
        };
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
             local_size: {group:?},\n    bytes: &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{symbol}.spv\"))),\n}};\n",
            file = job.file,
            symbol = job.symbol,
        );
    }
    for job in &jobs {
        generated.push_str(&for_tracers(job, &symbols));
    }
    let _ = writeln!(
        generated,
        "/// Every module of this crate, in order of file names.\npub static ALL: &[&Spirv] = &["
    );
    for job in &jobs {
        let _ = writeln!(generated, "    &{},", job.symbol);
    }
    generated.push_str("];\n");

    assert!(errors.is_empty(), "shader compilation failed\n{errors}");
    for (file, text) in [
        ("modules.rs", generated),
        ("layouts.rs", layouts),
        ("constant_ids.rs", constant_ids),
    ] {
        write_if_changed(&out.join(file), &text).expect("OUT_DIR can be written");
    }
}

/// The static that joins the modules of a ray generation shader for all tracers; empty for other modules.
fn for_tracers(job: &Job, symbols: &BTreeSet<String>) -> String {
    let variants = ["COMPUTE", "GRID", "QUERY"].map(|v| format!("{}_{v}", job.symbol));
    let [compute, grid, query] = &variants;
    match job.symbol.strip_suffix("_RGEN") {
        Some(name) if variants.iter().all(|variant| symbols.contains(variant)) => format!(
            "/// `{file}` for each tracer.\npub static {name}: RayShader = RayShader {{\n    pipeline: &{pipeline},\n    \
             compute: &{compute},\n    grid: &{grid},\n    query: &{query},\n}};\n",
            file = job.file,
            pipeline = job.symbol,
        ),
        _ => String::new(),
    }
}

/// The size of a compute shader's work groups: the operands of `OpExecutionMode LocalSize`. 1 for other stages, and for
/// words that end early, which Vulkan refuses.
fn local_size(words: &[u32]) -> [u32; 3] {
    const HEADER: usize = 5;
    const OP_EXECUTION_MODE: u32 = 16;
    const LOCAL_SIZE: u32 = 17;
    let mut rest = words.get(HEADER..).unwrap_or_default();
    while let Some(&first) = rest.first() {
        let length = ((first >> 16) as usize).max(1);
        if let [_, _, LOCAL_SIZE, x, y, z] = *rest.get(..length).unwrap_or_default()
            && first & 0xFFFF == OP_EXECUTION_MODE
        {
            return [x, y, z];
        }
        rest = rest.get(length..).unwrap_or_default();
    }
    [1; 3]
}

/// Writes a file unless it has this text already, so that its dependents are not built again.
fn write_if_changed(file: &Path, text: &str) -> std::io::Result<()> {
    if fs::read_to_string(file).is_ok_and(|old| old == text) {
        return Ok(());
    }
    fs::write(file, text)
}

/// Writes the GLSL of the shared structures and constants. Returns a table of the structures with their sizes and
/// offsets in Rust, for the test that compares them with SPIR-V.
fn share(root: &Path, out: &Path) -> Result<String, String> {
    let folder = out.join("glsl/generated");
    fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut table = String::from(
        "/// Name, size, and name and offset of each field.\npub const LAYOUTS: &[Layout] = &[\n",
    );
    let mut known = BTreeSet::new();
    for (name, base) in SHARED {
        let module = read_shared(root, name)?;
        let text = module
            .glsl(name, base, &mut known)
            .map_err(|e| format!("shaders/src/{name}: {e}"))?;
        let file = folder.join(format!("{name}.glsl"));
        write_if_changed(&file, &text).map_err(|e| format!("{}: {e}", file.display()))?;
        for structure in &module.structures {
            let path = format!("crate::{name}::{}", structure.name);
            let _ = writeln!(
                table,
                "    (\"{}\", size_of::<{path}>(), &[",
                structure.name
            );
            for field in &structure.fields {
                let field = &field.name;
                let _ = writeln!(
                    table,
                    "        (\"{field}\", std::mem::offset_of!({path}, {field})),"
                );
            }
            table.push_str("    ]),\n");
        }
    }
    table.push_str("];\n");
    Ok(table)
}

/// The shared items of a module of this crate and of the modules in its folder.
fn read_shared(root: &Path, name: &str) -> Result<shared::Module, String> {
    let folder = root.join("src").join(name);
    let mut files: Vec<PathBuf> = fs::read_dir(&folder)
        .map_err(|e| format!("{}: {e}", folder.display()))?
        .flatten()
        .map(|entry| entry.path())
        .collect();
    files.sort();
    files.insert(0, folder.with_extension("rs"));
    let mut module = shared::Module::default();
    for file in files {
        let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        module
            .read(&text)
            .map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(module)
}

/// Rust constants for the ids of specialization constants: those of `trace/direct.rgen` are in the module
/// `trace::direct`. Two files with the same folder and stem do not compile if both declare such constants.
fn constant_ids(root: &Path, files: &[String], errors: &mut String) -> String {
    let mut folders: BTreeMap<&str, String> = BTreeMap::new();
    let mut all = String::new();
    for file in files {
        // The compiler reports what cannot be read.
        let text = fs::read_to_string(root.join(file)).unwrap_or_default();
        let constants = match shared::specialization_constants(&text) {
            Ok(constants) if constants.is_empty() => continue,
            Ok(constants) => constants,
            Err(e) => {
                let _ = writeln!(errors, "shaders/{file}:{e}");
                continue;
            }
        };
        let (folder, name) = file.split_once('/').unwrap_or(("", file));
        let stem =
            symbol_of(name.split_once('.').map_or(name, |(stem, _)| stem)).to_ascii_lowercase();
        let ids = folders.entry(folder).or_default();
        let _ = writeln!(
            ids,
            "    /// Specialization constants of `{file}`.\n    pub mod {stem} {{"
        );
        for (constant, id) in constants {
            let _ = writeln!(
                ids,
                "        /// Id of `{constant}`.\n        pub const {constant}: u32 = {id};"
            );
            let _ = writeln!(all, "    (\"{constant}\", {id}),");
        }
        ids.push_str("    }\n");
    }
    let mut text = String::new();
    for (folder, ids) in folders {
        let _ = writeln!(
            text,
            "/// Specialization constants of the shaders in `{folder}`.\npub mod {folder} {{\n{ids}}}"
        );
    }
    let _ = writeln!(
        text,
        "/// Name and id of every one.\n#[cfg(test)]\npub(crate) const ALL: &[(&str, u32)] = &[\n{all}];"
    );
    text
}

/// Collects the paths of all GLSL files below `folder`, relative to `root`, with `/`.
fn collect_files(root: &Path, folder: &Path, files: &mut Vec<String>) {
    let Ok(entries) = fs::read_dir(folder) else {
        return; // what names a shader that is missing does not compile
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
        let extension = name.rsplit_once('.').map_or("", |(_, extension)| extension);
        if (extension == "glsl" || STAGES.iter().any(|s| s.0 == extension))
            && let Ok(relative) = path.strip_prefix(root)
        {
            files.push(slashes(relative));
        }
    }
}

/// The default compilation of a stage file, and the variants that its comments declare.
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
                // No stage has the empty name.
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

/// Folders that hold GLSL: the shader root, and the folder of generated files.
struct Roots<'a>([&'a Path; 2]);

impl Roots<'_> {
    /// The text of a file below the first root that has it.
    fn read(&self, file: &str) -> std::io::Result<String> {
        let [written, generated] = self.0.map(|root| root.join(file));
        fs::read_to_string(if written.is_file() {
            written
        } else {
            generated
        })
    }

    /// Finds an included file: relative to the includer first, then to the roots.
    fn resolve(&self, includer: &str, header: &str) -> Option<String> {
        let beside = Path::new(includer)
            .parent()
            .map(|p| slashes(&p.join(header)));
        let from_root = slashes(Path::new(header));
        beside
            .into_iter()
            .chain([from_root])
            .find(|candidate| self.0.iter().any(|root| root.join(candidate).is_file()))
    }
}

/// Appends the text of `file` and of all files that it may include to `text`.
fn gather(roots: &Roots, file: &str, seen: &mut BTreeSet<String>, text: &mut String) {
    if !seen.insert(file.to_owned()) {
        return;
    }
    let Ok(source) = roots.read(file) else {
        return; // the compiler reports it
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
        if let Some(found) = roots.resolve(file, name) {
            gather(roots, &found, seen, text);
        }
    }
}

/// FNV-1a, 64 bits: detects edits, and is equal on every machine.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |h, b| {
        (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Resolves glslang's `#include` lines.
struct Includes<'a> {
    roots: &'a Roots<'a>,
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
        let name = self.roots.resolve(includer, header)?;
        let data = self.roots.read(&name).ok()?;
        Some(IncludeResult { name, data })
    }
}

/// Compiles one module unless its output is up to date; returns its words.
fn build(roots: &Roots, out: &Path, job: &Job) -> Result<Vec<u32>, String> {
    let mut text = format!("{SCRIPT_VERSION} {} {:?}\n", job.stage, job.defines);
    gather(roots, &job.file, &mut BTreeSet::new(), &mut text);
    let key = format!("{:016x}", hash(&text));
    let module = out.join(format!("{}.spv", job.symbol));
    let stamp = out.join(format!("{}.hash", job.symbol));
    if fs::read_to_string(&stamp).is_ok_and(|old| old == key)
        && let Ok(bytes) = fs::read(&module)
    {
        let words = bytes.as_chunks().0.iter();
        return Ok(words.map(|word| u32::from_le_bytes(*word)).collect());
    }
    let words = compile(roots, job)?;
    let bytes: Vec<u8> = words.iter().flat_map(|w| w.to_le_bytes()).collect();
    fs::write(&module, bytes)
        .and_then(|()| fs::write(&stamp, key))
        .map_err(|e| format!("{}: {e}", module.display()))?;
    Ok(words)
}

/// GLSL to SPIR-V words, or glslang's messages with the file's name in them.
fn compile(roots: &Roots, job: &Job) -> Result<Vec<u32>, String> {
    let compiler = Compiler::acquire().ok_or("glslang did not start")?;
    let text = roots
        .read(&job.file)
        .map_err(|e| format!("{}: {e}", job.file))?;
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
        roots,
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

/// Enables `#include` behind the `#version` line, which must be the first. Line numbers do not change.
fn with_includes(text: &str) -> String {
    const EXTENSION: &str = "#extension GL_GOOGLE_include_directive : require\n";
    match text.split_once('\n') {
        Some((version, rest)) if version.trim_start().starts_with("#version") => {
            format!("{version}\n{EXTENSION}#line 2\n{rest}")
        }
        _ => format!("#version 460\n{EXTENSION}#line 1\n{text}"),
    }
}

/// Replaces `0`, glslang's name of the stage file in messages, by the file's name: `file:line:column`.
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

//! Materials by name: what the scripts of a game define, what the engine makes of bare images, and the
//! default for everything that is missing. [`light`]: what a material is to light.

pub mod by_hand;
pub mod finish;
pub mod light;
pub mod mat;
mod of_pack;

use crate::files::GameFiles;
use crate::image;
use by_hand::MaterialsByHand;
use finish::Finish;
use of_pack::Usual;
use shaderscript::{Diagnostic, ImplicitKind, Library, Shader};
use std::collections::{HashMap, HashSet};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

/// The materials of a game.
#[derive(Debug)]
pub struct Materials {
    library: Library,
    /// The scripts with `.mtr` files in place of those of the same names, if there are any.
    with_mtr: Option<Library>,
    /// What `opengl2`'s variables state for materials that state nothing.
    usual: Usual,
    /// Names that are no maps of other images.
    drawn: OnceLock<HashSet<String>>,
    /// Whether the image of a name exists, for names requested so far.
    images: Mutex<HashMap<String, bool>>,
    /// Materials whose fault was reported.
    reported: Mutex<HashSet<String>>,
    unusable: Vec<Diagnostic>,
}

/// A material as it is drawn, and as the map compiler read it.
#[derive(Debug, Clone, PartialEq)]
pub struct Resolved {
    /// What is drawn: the script's definition, the implicit material of an image, or the default
    /// ([`Shader::default_material`]).
    pub shader: Shader,
    /// The script's definition, even if something else is drawn: its light directives hold for the
    /// map compiler, which needs no images.
    pub script: Option<Shader>,
    /// Why the default is drawn; `None` for a good material.
    pub fault: Option<String>,
}

impl Resolved {
    /// The definition that decides about light: the script's, otherwise the drawn one.
    pub fn definition(&self) -> &Shader {
        self.script.as_ref().unwrap_or(&self.shader)
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What is behind these locks is valid at every moment.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Materials {
    /// Reads `scripts/*.shader` in the engine's order, and `.mtr` files beside them.
    ///
    /// Faults of scripts, and scripts that cannot be read, are in the diagnostics; none of them is fatal.
    pub fn load(files: &dyn GameFiles) -> (Materials, Vec<Diagnostic>) {
        let mut unreadable = Vec::new();
        let mut read = |path: String| match files.read(&path) {
            Ok(Some(text)) => Some((path, text)),
            Ok(None) => None,
            Err(problem) => {
                unreadable.push(Diagnostic {
                    file: path,
                    line: 1,
                    column: 1,
                    severity: shaderscript::Severity::Error,
                    shader: None,
                    message: format!("cannot be read: {problem}"),
                });
                None
            }
        };
        let names = files.list("scripts", ".shader");
        let path = |name: &String| read(format!("scripts/{name}"));
        let scripts: Vec<_> = names.iter().filter_map(path).collect();
        let mut replaced = false;
        let mtr = |(shader, text): &(String, Vec<u8>)| {
            let found = read(format!("{}.mtr", shaderscript::strip_extension(shader)));
            let found = found.filter(|(_, text)| !text.is_empty());
            replaced |= found.is_some();
            found.unwrap_or_else(|| (shader.clone(), text.clone()))
        };
        let with_mtr: Vec<_> = if files.list("scripts", ".mtr").is_empty() {
            Vec::new()
        } else {
            scripts.iter().map(mtr).collect()
        };
        let variables = |name: &str| files.variable(name);
        let library = |scripts| Library::of_engine(scripts, &variables, files.precedence());
        let mut materials = Materials::from_library(library(scripts));
        materials.usual = Usual::of_variables(&variables);
        materials.with_mtr = replaced.then(|| library(with_mtr));
        materials.unusable.extend_from_slice(&unreadable);
        unreadable.extend_from_slice(materials.library.diagnostics());
        let of_mtr = (materials.with_mtr.iter()).flat_map(|library| library.diagnostics());
        let of_mtr = of_mtr.filter(|fault| fault.file.ends_with(".mtr"));
        unreadable.extend(of_mtr.cloned());
        (materials, unreadable)
    }

    /// Materials of scripts that were read elsewhere.
    pub fn from_library(library: Library) -> Materials {
        Materials {
            unusable: library.dropped().to_vec(),
            library,
            with_mtr: None,
            usual: Usual::default(),
            drawn: OnceLock::new(),
            images: Mutex::default(),
            reported: Mutex::default(),
        }
    }

    /// The scripts.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The scripts whose words of reflection count.
    pub fn reflections(&self) -> &Library {
        self.with_mtr.as_ref().unwrap_or(&self.library)
    }

    /// Faults of the definition of a name in an `.mtr` file.
    pub fn mtr_faults(&self, name: &str) -> impl Iterator<Item = &Diagnostic> {
        let library = self.with_mtr.as_ref();
        let found = library.and_then(|library| library.find(name));
        let of = move |fault: &&Diagnostic| {
            found.is_some_and(|shader| {
                fault.file.ends_with(".mtr")
                    && fault.file == shader.location.file
                    && fault.shader.as_deref() == Some(shader.name.as_str())
                    && fault.severity != shaderscript::Severity::Note
            })
        };
        let all = library.map_or(&[][..], Library::diagnostics);
        all.iter().filter(of)
    }

    /// The material of a name, for a kind of use.
    ///
    /// As in the engine: a script's definition if there is one, all images of its stages exist, and the engine
    /// would accept it; the image of that name with implicit stages if there is no script; the default
    /// otherwise, which is logged once per name.
    pub fn resolve(&self, files: &dyn GameFiles, name: &str, kind: ImplicitKind) -> Resolved {
        let script = self.library.find(name).cloned();
        let fault = match &script {
            Some(script) => self.script_fault(files, script),
            None if self.image_exists(files, name) => None,
            None => Some("neither a script nor an image has this name".to_owned()),
        };
        if let Some(fault) = &fault {
            self.tell_fault(name, fault);
        }
        let shader = match (&script, &fault) {
            (_, Some(_)) => Shader::default_material(name),
            (Some(script), None) => script.clone(),
            (None, None) => Shader::implicit(name, kind),
        };
        Resolved {
            shader,
            script,
            fault,
        }
    }

    /// What packs and files by hand state about the reflection of a material that is drawn by `shader`.
    pub fn finish(
        &self,
        files: &dyn GameFiles,
        name: &str,
        shader: &Shader,
        by_hand: &MaterialsByHand,
    ) -> Finish {
        let exists = |image: &str| self.image_exists(files, image);
        by_hand.finish(name, &self.of_pack(name, shader, &exists))
    }

    /// Warns that the default is drawn instead of a material; once for each name, whoever finds out first.
    pub fn tell_fault(&self, name: &str, fault: &str) {
        let name = shaderscript::strip_extension(name);
        if lock(&self.reported).insert(name.to_ascii_lowercase()) {
            log::warn!("material {name}: {fault}; the default is drawn");
        }
    }

    /// What is wrong with whole script files: nothing of them is used, because they cannot be read or their braces do
    /// not match, or a comment takes the rest of them.
    pub fn faults_of_files(&self) -> impl Iterator<Item = &Diagnostic> {
        let of_mtr = self.with_mtr.iter().flat_map(Library::warnings_of_files);
        let dropped = self.with_mtr.iter().flat_map(Library::dropped);
        let of_mtr = of_mtr
            .chain(dropped)
            .filter(|fault| fault.file.ends_with(".mtr"));
        (self.unusable.iter())
            .chain(self.library.warnings_of_files())
            .chain(of_mtr)
    }

    /// Why the engine would not draw a script's definition.
    fn script_fault(&self, files: &dyn GameFiles, script: &Shader) -> Option<String> {
        let place = &script.location;
        let at = |what: String| format!("{}:{}: {what}", place.file, place.line);
        if let Some(reason) = &script.rejected {
            return Some(at(reason.clone()));
        }
        let missing = script
            .needed_images()
            .find(|image| !self.image_exists(files, image))?;
        Some(at(format!("image {missing} is missing")))
    }

    fn image_exists(&self, files: &dyn GameFiles, name: &str) -> bool {
        if let Some(&known) = lock(&self.images).get(name) {
            return known;
        }
        let exists = image::find(files, name).is_some();
        lock(&self.images).insert(name.to_owned(), exists);
        exists
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;

    const PIXEL: &[u8] = &[
        0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 10, 20, 30,
    ];

    fn files(entries: &[(&str, &[u8])]) -> MemoryFiles {
        let mut files = MemoryFiles::new();
        for (path, bytes) in entries {
            files.insert(path, *bytes).unwrap();
        }
        files
    }

    #[test]
    fn scripts_images_and_the_default() {
        let script = b"t/good\n{\n{\nmap t/pixel.jpg\n}\n}\nt/gone\n{\nq3map_surfacelight 100\n{\nmap t/none\n}\n}\nt/twice\n{\n{\nmap t/none\nmap t/pixel.tga\n}\n}\nt/bad\n{\nnonsense\n}\n";
        let files = files(&[("scripts/a.shader", script), ("t/pixel.tga", PIXEL)]);
        let (materials, _) = Materials::load(&files);
        let resolve = |name: &str| materials.resolve(&files, name, ImplicitKind::Lightmapped);

        let good = resolve("T/GOOD");
        assert_eq!((good.fault.as_ref(), good.shader.stages.len()), (None, 1));
        let implicit = resolve("t/pixel");
        assert_eq!(
            (implicit.fault.as_ref(), implicit.script.as_ref()),
            (None, None)
        );
        assert_eq!(
            implicit.shader,
            Shader::implicit("t/pixel", ImplicitKind::Lightmapped)
        );

        let gone = resolve("t/gone");
        assert!(
            gone.fault.as_ref().unwrap().contains("t/none"),
            "{:?}",
            gone.fault
        );
        assert_eq!(gone.shader, Shader::default_material("t/gone"));
        assert_eq!(gone.definition().light.surface_light, Some(100.0));
        assert_eq!(
            resolve("t/twice").fault.unwrap(),
            "scripts/a.shader:14: image t/none is missing"
        );
        assert!(resolve("t/bad").fault.is_some());
        assert!(resolve("t/nothing").fault.unwrap().contains("neither"));
    }

    #[test]
    fn built_in_images_exist() {
        let files = files(&[("scripts/a.shader", b"t/w\n{\n{\nmap *white\n}\n}\n")]);
        let (materials, _) = Materials::load(&files);
        assert_eq!(
            materials.resolve(&files, "t/w", ImplicitKind::Vertex).fault,
            None
        );
    }
}

//! All scripts of a game, joined by the engine's rules.

use crate::{
    diagnostic::{Diagnostic, Severity},
    parse::{Variables, parse_with},
    shader::Shader,
};
use std::collections::HashMap;

/// The definition that counts where the joined scripts have several of one name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precedence {
    /// The first: id's engine and most others.
    #[default]
    First,
    /// The last: Quake3e.
    Last,
}

/// The scripts of a game.
///
/// Precedence: id's engine joins the files in *reverse* listing order and takes the first definition of a name. The
/// listing has the highest-priority archive first, so between files of different names the one from the
/// lowest-priority archive wins, and inside one file the first definition. Files of the same name never meet: the
/// file system shows only the one of highest priority. A file that fails the structural check contributes nothing.
#[derive(Clone, Debug, Default)]
pub struct Library {
    shaders: Vec<Shader>,
    /// Winning definition of each name in lower case.
    by_name: HashMap<String, usize>,
    diagnostics: Vec<Diagnostic>,
    dropped: Vec<Diagnostic>,
}

impl Library {
    /// Joins scripts, given as (file name, contents) in the engine's listing order: highest priority first.
    pub fn new<N: AsRef<str>, T: AsRef<[u8]>>(
        files: impl IntoIterator<Item = (N, T), IntoIter: DoubleEndedIterator>,
    ) -> Library {
        Self::of_engine(files, &|_| String::new(), Precedence::First)
    }

    /// [`Library::new`] with console variables, which conditions in `.shaderx` files compare, and an engine's choice
    /// among definitions of one name.
    pub fn of_engine<N: AsRef<str>, T: AsRef<[u8]>>(
        files: impl IntoIterator<Item = (N, T), IntoIter: DoubleEndedIterator>,
        variables: Variables<'_>,
        precedence: Precedence,
    ) -> Library {
        let mut library = Library::default();
        let mut files: Vec<(N, T)> = files.into_iter().collect();
        if precedence == Precedence::First {
            files.reverse();
        }
        for (file, text) in files {
            let script = parse_with(file.as_ref(), text.as_ref(), variables);
            if script.dropped.is_some() {
                // what the file is dropped for is found before anything else
                library.dropped.extend(script.diagnostics.first().cloned());
            }
            library.diagnostics.extend(script.diagnostics);
            if script.dropped.is_some() {
                continue;
            }
            let mut shaders = script.shaders;
            if precedence == Precedence::Last {
                shaders.reverse();
            }
            for shader in shaders {
                let index = library.shaders.len();
                let key = shader.name.to_ascii_lowercase();
                match library
                    .by_name
                    .get(&key)
                    .and_then(|&i| library.shaders.get(i))
                {
                    Some(winner) => library.diagnostics.push(Diagnostic {
                        file: shader.location.file.clone(),
                        line: shader.location.line,
                        column: 1,
                        severity: Severity::Note,
                        shader: Some(shader.name.clone()),
                        message: format!(
                            "not used: {}:{} defines this name too, and counts",
                            winner.location.file, winner.location.line
                        ),
                    }),
                    None => {
                        library.by_name.insert(key, index);
                    }
                }
                library.shaders.push(shader);
            }
        }
        library
    }

    /// The definition of a name as the engine looks it up: an extension of `name` is ignored, case does not count, a
    /// backslash is not a slash. A definition whose own name has an extension is therefore never found.
    pub fn find(&self, name: &str) -> Option<&Shader> {
        let key = strip_extension(name).to_ascii_lowercase();
        self.by_name.get(&key).and_then(|&i| self.shaders.get(i))
    }

    /// Every definition; of several with one name the first in this list counts.
    pub fn definitions(&self) -> &[Shader] {
        &self.shaders
    }

    /// The definitions that count, one for each name, in the same order.
    pub fn effective(&self) -> impl Iterator<Item = &Shader> {
        self.shaders.iter().enumerate().filter_map(|(i, shader)| {
            (self.by_name.get(&shader.name.to_ascii_lowercase()) == Some(&i)).then_some(shader)
        })
    }

    /// Of each file that contributes nothing, the fault that is the reason.
    pub fn dropped(&self) -> &[Diagnostic] {
        &self.dropped
    }

    /// Warnings that are about whole files.
    pub fn warnings_of_files(&self) -> impl Iterator<Item = &Diagnostic> {
        let of_file = |d: &&Diagnostic| d.severity == Severity::Warning && d.shader.is_none();
        self.diagnostics.iter().filter(of_file)
    }

    /// What the engine would warn about in a definition; why it rejects one is in [`Shader::rejected`].
    pub fn warnings_of(&self, shader: &Shader) -> impl Iterator<Item = &Diagnostic> {
        let of = |diagnostic: &&Diagnostic| {
            diagnostic.severity == Severity::Warning
                && diagnostic.file == shader.location.file
                && diagnostic.shader.as_deref() == Some(shader.name.as_str())
        };
        self.diagnostics.iter().filter(of)
    }

    /// All faults of all files, and a note for every definition that another one hides.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }
}

/// A name without its extension: what follows the last dot of its last component.
pub fn strip_extension(name: &str) -> &str {
    match (name.rfind('.'), name.rfind('/')) {
        (Some(dot), Some(slash)) if dot < slash => name,
        (Some(dot), _) => name.get(..dot).unwrap_or(name),
        (None, _) => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(library: &Library, name: &str) -> Vec<String> {
        library
            .find(name)
            .map(|s| s.image_names().map(str::to_owned).collect())
            .unwrap_or_default()
    }

    #[test]
    fn the_last_file_listed_and_its_first_definition_win() {
        let library = Library::new([
            ("high.shader", "a\n{\n{\nmap high\n}\n}\n"),
            (
                "low.shader",
                "A\n{\n{\nmap low1\n}\n}\na\n{\n{\nmap low2\n}\n}\n",
            ),
        ]);
        assert_eq!(images(&library, "a"), ["low1"]);
        assert_eq!(library.definitions().len(), 3);
        assert_eq!(library.effective().count(), 1);
        assert_eq!(library.diagnostics().len(), 2);
    }

    #[test]
    fn where_the_last_definition_counts_the_first_file_listed_wins() {
        let two = |name: &str| {
            format!("a\n{{\n{{\nmap {name}1\n}}\n}}\nA\n{{\n{{\nmap {name}2\n}}\n}}\n")
        };
        let files = [("high.shader", two("high")), ("low.shader", two("low"))];
        let library = Library::of_engine(files, &|_| String::new(), Precedence::Last);
        assert_eq!(images(&library, "a"), ["high2"]);
        assert_eq!(
            (library.definitions().len(), library.effective().count()),
            (4, 1)
        );
    }

    #[test]
    fn names_are_compared_as_the_engine_compares_them() {
        let library = Library::new([(
            "f",
            "Textures/Wall {\n{\nmap x\n}\n}\na\\b {\n{\nmap y\n}\n}\nc.d {\n{\nmap z\n}\n}\n",
        )]);
        assert!(library.find("textures/WALL.tga").is_some());
        assert!(library.find("a/b").is_none());
        assert!(library.find("a\\b").is_some());
        assert!(library.find("c.d").is_none());
        assert_eq!(strip_extension("a.b/c"), "a.b/c");
        assert_eq!(strip_extension("a/b.c.d"), "a/b.c");
    }

    #[test]
    fn a_broken_file_is_dropped_whole() {
        let library = Library::new([
            ("good", "a {\n{\nmap x\n}\n}\n"),
            ("bad", "b {\n{\nmap x\n}\n}\na {\n{\nmap y\n}\n"),
        ]);
        assert_eq!(images(&library, "a"), ["x"]);
        assert!(library.find("b").is_none());
        let dropped: Vec<_> = library.dropped().iter().map(|d| d.to_string()).collect();
        assert_eq!(
            dropped,
            [
                "bad:6:1: error: a: braces are not balanced up to the end of the file; the engine ignores the whole file"
            ]
        );
    }

    #[test]
    fn a_comment_that_never_closes_is_told() {
        let library = Library::new([
            ("after", "b {\n{\nmap y\n}\n}\n"),
            (
                "open",
                "a {\n{\nmap x\n}\n}\n /* from here on\n// */ // no\n/*",
            ),
            ("closed", "c {\n{\nmap z\n}\n} /* all */ // /* is well\n"),
        ]);
        assert_eq!(images(&library, "a"), ["x"]);
        assert_eq!(images(&library, "b"), ["y"], "the engine loses it");
        let lines = |library: &Library| -> Vec<String> {
            (library.warnings_of_files().map(ToString::to_string)).collect()
        };
        assert_eq!(lines(&library).len(), 1);
        assert!(lines(&library)[0].starts_with("open:8:1: warning: this comment is never closed"));
        assert!(lines(&library)[0].ends_with("put */ where the comment ends"));
        // a file that the engine drops cannot spoil others
        let library = Library::new([("open", "a {\n{\nmap x\n/*\n}\n}\n")]);
        assert_eq!((library.dropped().len(), lines(&library).len()), (1, 0));
    }

    #[test]
    fn warnings_belong_to_their_definition() {
        let library = Library::new([
            (
                "one",
                "a {\n{\nmap x\nrgbGen nothing\n}\n}\nb {\n{\nmap x\n}\n}\n",
            ),
            ("two", "c {\ncull sideways\n{\nmap x\n}\n}\n"),
        ]);
        let lines = |name: &str| -> Vec<u32> {
            let shader = library.find(name).unwrap();
            library.warnings_of(shader).map(|d| d.line).collect()
        };
        assert_eq!(lines("a"), [4]);
        assert_eq!(lines("b"), [0; 0]);
        assert_eq!(lines("c"), [2]);
    }
}

//! Which files have changed, and what that means: a compiler is started, or a map or its entities are new.

use std::path::Path;
use std::sync::Arc;
use std::time::SystemTime;

use q3bsp::Bsp;

use super::compiler::{Compiler, Run, copy_leak};
use super::polled::{New, Polled};
use super::source_text::SourceText;
use super::{Compiled, Files, News};

/// Looks at the files of a map.
pub struct Follower {
    bsp: Polled,
    source: Option<Source>,
    /// The compiled map has been reported.
    has_map: bool,
}

/// A `.map` file.
struct Source {
    file: Polled,
    compiler: Option<Compiler>,
    /// The newest text.
    text: Option<Arc<SourceText>>,
    /// The text of the newest compiled map, or of the one that is compiled.
    compiled: Option<Arc<SourceText>>,
    run: Option<Run>,
    /// When the compiled text was saved.
    saved: Option<SystemTime>,
    /// A leak's line lies beside the source, written here.
    wrote_line: bool,
}

impl Follower {
    /// Looks at these files.
    pub fn new(files: Files) -> Self {
        let source = files.source.map(|(path, compiler)| Source {
            file: Polled::new(path),
            compiler,
            text: None,
            compiled: None,
            run: None,
            saved: None,
            wrote_line: false,
        });
        Self {
            bsp: Polled::new(files.bsp),
            source,
            has_map: false,
        }
    }

    /// Looks once.
    pub fn step(&mut self) -> Vec<News> {
        let mut news = Vec::new();
        // the text first, because a compiled map is shown with its lights
        if let Some(source) = &mut self.source {
            source.look(&self.bsp, &mut news);
        }
        let at_start = !self.has_map;
        if let Some(found) = self.bsp.look(|bytes| whole_map(&bytes).map(|()| bytes)) {
            match found {
                Ok(New { content, saved }) => {
                    let map = Compiled {
                        bytes: content.into(),
                        place: self.bsp.path().to_owned(),
                    };
                    let old = at_start && is_before_start(saved);
                    news.push(News::Map {
                        map,
                        text: self.source.as_ref().and_then(|source| source.text.clone()),
                        saved: (!old).then_some(saved),
                    });
                }
                Err(why) => news.push(News::Failed(why)),
            }
        }
        if let Some(source) = &mut self.source {
            source.follow_compiler(&mut news);
        }
        self.has_map |= news.iter().any(|new| matches!(new, News::Map { .. }));
        news
    }
}

/// Whether a file that is found at the start is no news.
fn is_before_start(saved: SystemTime) -> bool {
    const NEW: f32 = 1.0;
    saved.elapsed().is_ok_and(|age| age.as_secs_f32() > NEW)
}

/// Checks that bytes are a map.
fn whole_map(bytes: &[u8]) -> Result<(), String> {
    Bsp::parse(bytes).map(drop).map_err(|e| e.to_string())
}

impl Source {
    /// Reads a new text: either it is compiled, or only its entities are new.
    fn look(&mut self, bsp: &Polled, news: &mut Vec<News>) {
        let parsed = |bytes: Vec<u8>| {
            let text = SourceText::parse(&bytes).map_err(|e| e.to_string())?;
            Ok((bytes, text))
        };
        let New {
            content: (bytes, text),
            saved,
        } = match self.file.look(parsed) {
            None => return,
            Some(Ok(new)) => new,
            Some(Err(why)) => return news.push(News::Failed(why)),
        };
        let text = Arc::new(text);
        let before = self.text.replace(Arc::clone(&text));
        let first = before.is_none();
        // a newer compiled map is that of the text
        let is_compiled = first && bsp.modified().is_some_and(|compiled| compiled >= saved);
        if is_compiled {
            self.compiled = Some(text);
            return;
        }
        let compiled = self.compiled.as_ref();
        if compiled.is_some_and(|compiled| compiled.compiles_as(&text)) {
            if before.is_none_or(|before| before.entities() != text.entities()) {
                news.push(News::Entities { text, saved });
            }
            return;
        }
        let Some(compiler) = &self.compiler else {
            self.compiled = Some(text);
            if !first {
                news.push(News::Failed(
                    "the .map has changed, and no q3map2 is found to compile it: name one with --compiler PATH, or write the .bsp"
                        .to_owned(),
                ));
            }
            return;
        };
        // ends an earlier one
        self.run = None;
        let name = self.file.path().file_stem().unwrap_or_default();
        match compiler.begin(&bytes, &name.to_string_lossy()) {
            Ok(run) => {
                self.run = Some(run);
                self.compiled = Some(text);
                self.saved = (!first).then_some(saved);
                news.push(News::Compiles);
            }
            Err(e) => news.push(News::Failed(format!("{e:#}"))),
        }
    }

    /// Takes over what the compiler has written.
    fn follow_compiler(&mut self, news: &mut Vec<News>) {
        let ended = match self.run.as_mut().map(Run::poll) {
            None | Some(Ok(None)) => return,
            Some(Ok(Some(ended))) => ended,
            Some(Err(why)) => {
                self.run = None;
                // saved again, it is compiled again
                self.compiled = None;
                return news.push(News::Failed(why));
            }
        };
        if ended.last {
            self.run = None;
        }
        let read = std::fs::read(&ended.bsp).map_err(|e| e.to_string());
        let checked = read.and_then(|bytes| whole_map(&bytes).map(|()| bytes));
        let bytes = match checked {
            Ok(bytes) => bytes,
            Err(why) => return news.push(News::Failed(format!("{}: {why}", ended.bsp.display()))),
        };
        let note = self.note_of_leak(ended.leak.as_deref());
        news.push(News::Compiled {
            seconds: ended.seconds,
            note,
        });
        news.push(News::Map {
            map: Compiled {
                bytes: bytes.into(),
                place: ended.bsp,
            },
            text: self.text.clone(),
            saved: self.saved,
        });
    }

    /// What is said about a leak; removes the line of an earlier one.
    fn note_of_leak(&mut self, leak: Option<&Path>) -> Option<String> {
        let source = self.file.path();
        match leak {
            Some(line) => {
                let place = copy_leak(line, source);
                self.wrote_line |= place.is_some();
                let place = place.unwrap_or_else(|| line.to_owned());
                Some(format!("the map leaks: the line is {}", place.display()))
            }
            None => {
                if std::mem::take(&mut self.wrote_line) {
                    // the mapper may have removed it
                    let _ = std::fs::remove_file(source.with_extension("lin"));
                }
                None
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use relight::GameFiles;
    use relight::sample::Sample;
    use std::path::PathBuf;
    use std::time::Duration;

    /// In place of a compiler: a map without surfaces, or what the text demands.
    const SCRIPT: &str = r#"
for file; do :; done
if grep -q broken "$file"; then echo first; echo "no such shader"; exit 1; fi
if grep -q hole "$file"; then echo 1 2 3 > "${file%.map}.lin"; fi
cp "$(dirname "$0")/ready" "${file%.map}.bsp"
"#;

    fn text(shader: &str, light: u32) -> String {
        format!(
            "{{\n\"classname\" \"worldspawn\"\n{{\n( 0 0 0 ) ( 1 0 0 ) ( 0 1 0 ) {shader} 0 0 0 1 1 0 0 0\n}}\n}}\n{{\n\"classname\" \"light\"\n\"origin\" \"1 2 {light}\"\n}}\n"
        )
    }

    struct Room {
        folder: tempfile::TempDir,
        follower: Follower,
    }

    impl Room {
        fn new(compiles: bool) -> Self {
            let folder = tempfile::tempdir().unwrap();
            let path = |name: &str| folder.path().join(name);
            let files = Sample::Hall.files().unwrap();
            let map = files.read(Sample::Hall.map()).unwrap().unwrap();
            std::fs::write(path("ready"), map).unwrap();
            std::fs::write(path("compile.sh"), SCRIPT).unwrap();
            let stages = [path("compile.sh").display().to_string()];
            // a shell, because a program that has just been written may be busy
            let compiler = Compiler::new("/bin/sh".into(), &stages, &[], path("work"));
            let follower = Follower::new(Files {
                bsp: path("room.bsp"),
                source: Some((path("room.map"), compiles.then_some(compiler))),
            });
            Self { folder, follower }
        }

        fn path(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        fn save(&self, text: &str) {
            std::fs::write(self.path("room.map"), text).unwrap();
        }

        /// News up to the first that is wanted.
        fn until(&mut self, wanted: impl Fn(&News) -> bool) -> Vec<News> {
            let mut all = Vec::new();
            for _ in 0..2000 {
                all.extend(self.follower.step());
                if all.iter().any(&wanted) {
                    return all;
                }
                std::thread::sleep(Duration::from_millis(5));
            }
            panic!("{all:?}");
        }
    }

    fn is_map(news: &News) -> bool {
        matches!(news, News::Map { .. })
    }

    fn is_failed(news: &News) -> bool {
        matches!(news, News::Failed(_))
    }

    #[test]
    fn surfaces_are_compiled_and_lights_are_not() {
        let mut room = Room::new(true);
        assert!(room.follower.step().is_empty());
        room.save(&text("base/wall", 1));
        let news = room.until(is_map);
        let [
            News::Compiles,
            News::Compiled { note: None, .. },
            News::Map {
                text: Some(lit), ..
            },
        ] = &news[..]
        else {
            panic!("{news:?}")
        };
        assert_eq!(lit.entities()[1].get("origin"), Some("1 2 1"));
        // the mapper's own compiled map is not written
        assert!(!room.path("room.bsp").exists());

        room.save(&text("base/wall", 22));
        let news = room.until(|new| matches!(new, News::Entities { .. }));
        let [News::Entities { text: lit, .. }] = &news[..] else {
            panic!("{news:?}")
        };
        assert_eq!(lit.entities()[1].get("origin"), Some("1 2 22"));

        room.save(&text("base/floors", 22));
        assert_eq!(room.until(is_map).len(), 3);

        room.save(&text("broken", 22));
        let news = room.until(is_failed);
        let Some(News::Failed(why)) = news.last() else {
            panic!("{news:?}")
        };
        assert_eq!(why, "q3map2: failed (1)\nfirst\nno such shader");
        // saved once more, it is compiled once more
        room.save(&text("broken", 333));
        assert_eq!(room.until(is_failed).len(), 2);

        room.save(&text("hole", 1));
        let news = room.until(is_map);
        let Some(News::Compiled {
            note: Some(note), ..
        }) = news.get(1)
        else {
            panic!("{news:?}")
        };
        assert!(
            note.contains("leaks") && note.contains("room.lin"),
            "{note}"
        );
        assert!(room.path("room.lin").is_file());
        room.save(&text("base/wall", 1));
        room.until(is_map);
        assert!(!room.path("room.lin").exists());

        room.save("{ \"classname\" \"worldspawn\"");
        let news = room.until(is_failed);
        let Some(News::Failed(why)) = news.last() else {
            panic!("{news:?}")
        };
        assert!(why.contains("room.map: line 1: the file ends"), "{why}");
    }

    #[test]
    fn a_compiled_map_beside_the_text_is_shown_with_its_lights() {
        let mut room = Room::new(true);
        room.save(&text("base/wall", 1));
        std::fs::copy(room.path("ready"), room.path("room.bsp")).unwrap();
        // newer than the text: nothing is compiled
        let news = room.until(is_map);
        let [
            News::Map {
                text: Some(_), map, ..
            },
        ] = &news[..]
        else {
            panic!("{news:?}")
        };
        assert_eq!(map.place, room.path("room.bsp"));
        room.save(&text("base/wall", 22));
        let news = room.until(|new| matches!(new, News::Entities { .. }));
        assert_eq!(news.len(), 1);
    }

    #[test]
    fn without_a_compiler_new_surfaces_are_reported() {
        let mut room = Room::new(false);
        room.save(&text("base/wall", 1));
        std::fs::copy(room.path("ready"), room.path("room.bsp")).unwrap();
        room.until(is_map);
        room.save(&text("base/floors", 1));
        let news = room.until(is_failed);
        let Some(News::Failed(why)) = news.last() else {
            panic!("{news:?}")
        };
        assert!(why.contains("--compiler"), "{why}");
        room.save(&text("base/floors", 333));
        room.until(|new| matches!(new, News::Entities { .. }));
    }
}

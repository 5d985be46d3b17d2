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

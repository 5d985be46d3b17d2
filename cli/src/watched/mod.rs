//! Files of a map that is being made: what has been written, compiled or edited, on a thread of its own.
//!
//! A file is looked at every [`PAUSE`] (its time and its size), because events of the system are not sent for files of
//! network drives that another computer writes, and because they are sent before a file is complete.

mod compiler;
mod follower;
mod polled;
mod source_text;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, SystemTime};

pub use compiler::Compiler;
use follower::Follower;
pub use source_text::SourceText;

/// Time between two looks at the files.
const PAUSE: Duration = Duration::from_millis(100);

/// A compiled map, whole.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The file.
    pub bytes: Arc<[u8]>,
    /// Its place.
    pub place: PathBuf,
}

/// What has happened to the files.
#[derive(Clone, Debug)]
pub enum News {
    /// A compiled map has been written. `text`: the newest `.map`, if one is watched. `saved`: when its file was written;
    /// `None` if that was before the start.
    Map {
        map: Compiled,
        text: Option<Arc<SourceText>>,
        saved: Option<SystemTime>,
    },
    /// Entities of the `.map` have changed, and nothing that the compiler reads.
    Entities {
        text: Arc<SourceText>,
        saved: SystemTime,
    },
    /// The compiler has been started.
    Compiles,
    /// It has ended. `note`: what the mapper must know, such as a leak.
    Compiled { seconds: f32, note: Option<String> },
    /// Nothing new can be shown, and why: lines of text.
    Failed(String),
}

/// The files that are looked at.
#[derive(Clone, Debug)]
pub struct Files {
    /// The compiled map.
    pub bsp: PathBuf,
    /// Its source, with what compiles it.
    pub source: Option<(PathBuf, Option<Compiler>)>,
}

/// The thread that looks at the files; it ends with the value.
pub struct Watched {
    receiver: Receiver<News>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Watched {
    /// Begins. `wake` is called after each of the news.
    pub fn begin(files: Files, wake: impl Fn() + Send + 'static) -> Self {
        let (sender, receiver) = channel();
        let ends = Arc::new(AtomicBool::new(false));
        let end = Arc::clone(&ends);
        let thread = std::thread::spawn(move || {
            let mut follower = Follower::new(files);
            while !end.load(Ordering::Relaxed) {
                for news in follower.step() {
                    // the viewer may have ended
                    let _ = sender.send(news);
                    wake();
                }
                std::thread::sleep(PAUSE);
            }
        });
        Self {
            receiver,
            ends,
            thread: Some(thread),
        }
    }

    /// What has happened since the last call.
    pub fn take(&self) -> Vec<News> {
        self.receiver.try_iter().collect()
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // it ends its compiler
            let _ = thread.join();
        }
    }
}

//! Runs the mapper's own q3map2 in the background.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result};

/// Lines of the compiler's output that are shown after a failure.
const LAST_LINES: usize = 4;

/// Names of the program.
const NAMES: [&str; 3] = ["q3map2", "q3map2.exe", "q3map2.x86_64"];

/// A compiler with its arguments.
#[derive(Clone, Debug)]
pub struct Compiler {
    program: PathBuf,
    /// Arguments of each stage, the first `-meta` by default.
    stages: Vec<Vec<String>>,
    /// Arguments that name the game's files.
    game: Vec<String>,
    /// Folder for its files.
    folder: PathBuf,
}

impl Compiler {
    /// A compiler that reads these game folders, first the base game, and writes to a folder. `stages`: arguments, of one
    /// stage each.
    pub fn new(program: PathBuf, stages: &[String], games: &[PathBuf], folder: PathBuf) -> Self {
        let words = |text: &String| text.split_whitespace().map(str::to_owned).collect();
        let stages: Vec<Vec<String>> = match stages {
            [] => vec![vec!["-meta".to_owned()]],
            stages => stages.iter().map(words).collect(),
        };
        let names_game = |word: &String| word.starts_with("-fs_") || word == "-game";
        let game = match stages.iter().flatten().any(names_game) {
            true => Vec::new(),
            false => game_arguments(games),
        };
        Self {
            program,
            stages,
            game,
            folder,
        }
    }

    /// The program on the search path, if there is one.
    pub fn installed() -> Option<PathBuf> {
        let path = std::env::var_os("PATH")?;
        std::env::split_paths(&path)
            .flat_map(|folder| NAMES.map(|name| folder.join(name)))
            .find(|file| file.is_file())
    }

    /// Begins to compile a text under a name.
    ///
    /// # Errors
    /// The folder cannot be written, or the program does not start.
    pub fn begin(&self, text: &[u8], name: &str) -> Result<Run> {
        let folder = &self.folder;
        let source = folder.join(name).with_extension("map");
        std::fs::create_dir_all(folder)
            .and_then(|()| std::fs::write(&source, text))
            .with_context(|| format!("{}: cannot be written", source.display()))?;
        // one of an earlier run must not be taken for the result
        let bsp = source.with_extension("bsp");
        for extension in ["bsp", "prt", "lin"] {
            // most are absent
            let _ = std::fs::remove_file(source.with_extension(extension));
        }
        let mut run = Run {
            compiler: self.clone(),
            source,
            bsp,
            child: None,
            stage: 0,
            begun: Instant::now(),
        };
        run.start_stage()?;
        Ok(run)
    }
}

/// Arguments by which q3map2 finds the files of game folders.
fn game_arguments(games: &[PathBuf]) -> Vec<String> {
    let mut arguments: Vec<String> = Vec::new();
    let mut number = 0;
    for game in games {
        // a single pack lies in its game's folder
        let folder = match game.is_file() {
            true => game.parent().unwrap_or(game),
            false => game,
        };
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        let (Some(base), Some(name)) = (folder.parent(), folder.file_name()) else {
            continue;
        };
        let base = base.display().to_string();
        if !arguments.contains(&base) {
            arguments.extend(["-fs_basepath".to_owned(), base]);
        }
        let name = name.to_string_lossy().into_owned();
        if !arguments.contains(&name) {
            let option = if number == 0 {
                "-fs_basegame"
            } else {
                "-fs_game"
            };
            arguments.extend([option.to_owned(), name]);
        }
        number += 1;
    }
    arguments
}

/// A stage has ended well.
#[derive(Debug, PartialEq)]
pub struct Ended {
    /// Place of the compiled map.
    pub bsp: PathBuf,
    /// Seconds since the first stage began.
    pub seconds: f32,
    /// The line from an entity to the outside of the map, if it leaks.
    pub leak: Option<PathBuf>,
    /// No stage follows.
    pub last: bool,
}

/// A compiler at work; it is ended with the value.
#[derive(Debug)]
pub struct Run {
    compiler: Compiler,
    source: PathBuf,
    bsp: PathBuf,
    child: Option<Child>,
    stage: usize,
    begun: Instant,
}

impl Run {
    fn log(&self) -> PathBuf {
        self.source.with_extension("log")
    }

    fn start_stage(&mut self) -> Result<()> {
        let compiler = &self.compiler;
        let arguments = compiler
            .stages
            .get(self.stage)
            .map_or(&[][..], Vec::as_slice);
        let log = self.log();
        let output = File::create(&log).with_context(|| format!("{}", log.display()))?;
        let errors = output.try_clone()?;
        let child = Command::new(&compiler.program)
            .args(arguments)
            .args(&compiler.game)
            .arg(&self.source)
            .stdin(Stdio::null())
            .stdout(output)
            .stderr(errors)
            .spawn()
            .with_context(|| format!("{}: does not start", compiler.program.display()))?;
        self.child = Some(child);
        Ok(())
    }

    /// The end of a stage, if one has ended; starts the next.
    ///
    /// # Errors
    /// The stage has failed: the end of its output.
    pub fn poll(&mut self) -> Result<Option<Ended>, String> {
        let Some(child) = &mut self.child else {
            return Ok(None);
        };
        let status = match child.try_wait() {
            Ok(None) => return Ok(None),
            Ok(Some(status)) => status,
            Err(e) => return Err(e.to_string()),
        };
        self.child = None;
        let log = std::fs::read(self.log()).unwrap_or_default();
        let log = String::from_utf8_lossy(&log);
        if !status.success() || !self.bsp.is_file() {
            return Err(format!("q3map2: {}\n{}", ended(status), last_lines(&log)));
        }
        self.stage += 1;
        let last = self.stage >= self.compiler.stages.len();
        if !last {
            self.start_stage().map_err(|e| format!("{e:#}"))?;
        }
        let line = self.source.with_extension("lin");
        Ok(Some(Ended {
            bsp: self.bsp.clone(),
            seconds: self.begun.elapsed().as_secs_f32(),
            leak: line.is_file().then_some(line),
            last,
        }))
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // it may have ended
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

fn ended(status: std::process::ExitStatus) -> String {
    match status.code() {
        Some(0) => "wrote no .bsp".to_owned(),
        Some(code) => format!("failed ({code})"),
        None => "was ended".to_owned(),
    }
}

/// The last lines of an output that are not empty.
fn last_lines(output: &str) -> String {
    let lines: Vec<&str> = (output.lines().map(str::trim))
        .filter(|line| !line.is_empty())
        .collect();
    let from = lines.len().saturating_sub(LAST_LINES);
    lines.get(from..).unwrap_or_default().join("\n")
}

/// Copies the line of a leak beside the source, where editors read it.
pub fn copy_leak(line: &Path, source: &Path) -> Option<PathBuf> {
    let place = source.with_extension("lin");
    std::fs::copy(line, &place).ok().map(|_| place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn game_folders_become_arguments() {
        let games = ["/games/q3/baseq3", "/games/q3/mymod", "/home/me/oa/baseoa"];
        let games = games.map(PathBuf::from);
        let arguments = game_arguments(&games);
        let expected = "-fs_basepath /games/q3 -fs_basegame baseq3 -fs_game mymod -fs_basepath /home/me/oa -fs_game baseoa";
        assert_eq!(arguments.join(" "), expected);
        let stages = ["-meta -fs_basepath /x".to_owned(), "-vis -fast".to_owned()];
        let compiler = Compiler::new("q3map2".into(), &stages, &games, "/tmp".into());
        // the mapper's own arguments
        assert!(compiler.game.is_empty());
        assert_eq!(compiler.stages[1], ["-vis", "-fast"]);
        let compiler = Compiler::new("q3map2".into(), &[], &games, "/tmp".into());
        assert_eq!(compiler.stages, [["-meta"]]);
        assert!(!compiler.game.is_empty());
    }

    #[test]
    fn the_end_of_an_output_is_kept() {
        assert_eq!(last_lines("a\n\nb\n c \n\nd\ne\n\n"), "b\nc\nd\ne");
        assert_eq!(last_lines(""), "");
    }
}

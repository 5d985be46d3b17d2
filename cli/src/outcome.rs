//! Arguments, exit codes and error messages of a command.

use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};

use crate::messages;

/// Exit code for input that cannot be read: truncated, damaged, or of another format.
pub const BAD_INPUT: u8 = 2;

/// Exit code of clap for invalid arguments.
const BAD_ARGUMENTS: i32 = 2;

/// Exits quietly when the reader closes the pipe (`relight info | head`).
fn end_with_the_reader() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let text = panic.payload().downcast_ref::<String>();
        if text.is_some_and(|t| t.starts_with("failed printing to stdout: Broken pipe")) {
            std::process::exit(0);
        }
        usual(panic);
    }));
}

/// Runs a command and prints its error.
pub fn main(run: impl Fn() -> Result<ExitCode>) -> ExitCode {
    end_with_the_reader();
    messages::print_warnings();
    match run() {
        Ok(code) => code,
        Err(error) => {
            eprintln!("{}", one_sentence(&error));
            match is_bad_input(&error) {
                true => ExitCode::from(BAD_INPUT),
                false => ExitCode::FAILURE,
            }
        }
    }
}

/// The process arguments. Exits on invalid arguments and for `--help`.
///
/// `replaced`: subcommand, option (empty for the subcommand itself), replacement.
pub fn parse<C: Parser>(replaced: &[(&str, &str, &str)]) -> C {
    C::try_parse().unwrap_or_else(|error| {
        let name = C::command().get_name().to_owned();
        let words = std::env::args_os().skip(1);
        let words: Vec<_> = words.map(|w| w.to_string_lossy().into_owned()).collect();
        match replacement(&error, &words, replaced) {
            Some((subcommand, old, new)) => {
                let written = [&name, subcommand, old].join(" ");
                eprintln!("error: {} is now {new}", written.trim_end());
                std::process::exit(BAD_ARGUMENTS)
            }
            None => error.exit(),
        }
    })
}

/// The row of `replaced` for arguments that clap rejects. `words`: the arguments, the subcommand first.
fn replacement<'a>(
    error: &clap::Error,
    words: &[String],
    replaced: &[(&'a str, &'a str, &'a str)],
) -> Option<(&'a str, &'a str, &'a str)> {
    let unknown = match (error.kind(), error.get(ContextKind::InvalidArg)) {
        (ErrorKind::InvalidSubcommand, _) => "",
        (ErrorKind::UnknownArgument, Some(ContextValue::String(word))) => option_of(word, words)?,
        _ => return None,
    };
    let subcommand = words.first()?;
    let found = (replaced.iter()).find(|(of, old, _)| of == subcommand && *old == unknown);
    found.copied()
}

/// The option in `word`, or the option before it if `word` is a number: some options had several values.
fn option_of<'a>(word: &'a str, words: &'a [String]) -> Option<&'a str> {
    if word.parse::<f32>().is_err() {
        return Some(word);
    }
    let at = words.iter().position(|w| w == word)?;
    let before = words.get(..at)?.iter().map(String::as_str);
    before.rev().find(|w| w.starts_with("--"))
}

/// An error with its causes, without repetitions.
pub fn one_sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.ends_with(&cause) {
            continue;
        }
        if !text.is_empty() {
            text.push_str(": ");
        }
        text.push_str(&cause);
    }
    text
}

/// Whether the error is about input: an invalid file, or a missing map.
fn is_bad_input(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| {
        cause.is::<q3bsp::Error>()
            || matches!(
                cause.downcast_ref(),
                Some(relight::LoadError::Map { .. } | relight::LoadError::Absent { .. })
            )
            || matches!(
                cause.downcast_ref(),
                Some(relight::FileError::Pack { .. } | relight::FileError::Entry { .. })
            )
    })
}

//! The two commands: `relight` for users of maps, `relight-lab` for measurements of the renderer.
//!
//! Each subcommand is a module. Subcommands of `relight`, and code of both commands, are here; subcommands of
//! `relight-lab` are in [`lab`]. A binary calls [`relight()`] or [`relight_lab`]; nothing else is public.

#![forbid(unsafe_code)]

mod bake;
mod beside;
mod brought;
mod calibration;
mod cameras;
mod chosen;
mod command;
mod compare;
mod convert;
mod denoise;
mod game;
mod info;
mod lab;
mod lights;
mod lights_picture;
mod lit_maps;
mod material;
mod messages;
mod numbers;
mod outcome;
mod pictures;
mod render;
mod report;
mod sample;
mod scripts;
mod settings;
mod sharing;
mod surfaces;
mod table;
mod timings;
mod view;
mod viewer;
mod watch;
mod watched;

use std::process::ExitCode;

/// Runs `relight` with the arguments of the process.
pub fn relight() -> ExitCode {
    outcome::main(command::run)
}

/// Runs `relight-lab` with the arguments of the process.
pub fn relight_lab() -> ExitCode {
    outcome::main(lab::run)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use clap::{Arg, Command, CommandFactory};

    use super::{command, lab};

    /// Options whose description differs between commands, such as a file in one and a folder in another.
    const DESCRIBED_APART: [&str; 14] = [
        "cache",
        "calibrate",
        "compensate",
        "device",
        "frames",
        "gamma",
        "json",
        "look",
        "made",
        "output",
        "reference",
        "samples",
        "tracer",
        "view",
    ];

    /// Syntax of an option: short form, names of its values, and whether it takes any.
    fn spelling(option: &Arg) -> String {
        let values: Vec<&str> = option
            .get_value_names()
            .into_iter()
            .flatten()
            .map(|v| v.as_str())
            .collect();
        let taken = option.get_action().takes_values();
        format!(
            "{:?} {values:?} {taken} {:?}",
            option.get_short(),
            option.get_num_args()
        )
    }

    #[test]
    fn an_option_is_the_same_in_every_subcommand() {
        let mut known: BTreeMap<String, (String, String, String)> = BTreeMap::new();
        let mut shared = 0;
        for mut program in [command::Cli::command(), lab::Cli::command()] {
            program.build();
            for subcommand in program.get_subcommands() {
                for option in subcommand.get_arguments() {
                    let Some(long) = option.get_long().filter(|long| *long != "help") else {
                        continue;
                    };
                    let help = option
                        .get_help()
                        .map(ToString::to_string)
                        .unwrap_or_default();
                    let place = format!("{} {}", program.get_name(), subcommand.get_name());
                    let found = (spelling(option), help, place);
                    let first = known
                        .entry(long.to_owned())
                        .or_insert_with(|| found.clone());
                    shared += usize::from(first.2 != found.2);
                    assert_eq!(first.0, found.0, "--{long}: {} and {}", first.2, found.2);
                    assert!(
                        DESCRIBED_APART.contains(&long) || first.1 == found.1,
                        "--{long}: {}: {}; {}: {}",
                        first.2,
                        first.1,
                        found.2,
                        found.1
                    );
                }
            }
        }
        assert!(shared > 20, "{shared}");
    }

    #[test]
    fn help_of_a_subcommand_describes_it_and_has_an_example() {
        for program in [command::Cli::command(), lab::Cli::command()] {
            for subcommand in program.get_subcommands() {
                let about = subcommand.get_long_about().map(ToString::to_string);
                let about = about.unwrap_or_default();
                assert!(
                    about.contains(" relight"),
                    "{}: {about}",
                    subcommand.get_name()
                );
            }
        }
    }

    #[test]
    fn definitions_are_consistent() {
        command::Cli::command().debug_assert();
        lab::Cli::command().debug_assert();
    }

    #[test]
    fn no_short_option_has_two_meanings() {
        let mut known: BTreeMap<char, String> = BTreeMap::new();
        for program in [command::Cli::command(), lab::Cli::command()] {
            for option in program.get_subcommands().flat_map(Command::get_arguments) {
                let (Some(short), Some(long)) = (option.get_short(), option.get_long()) else {
                    continue;
                };
                assert_eq!(known.entry(short).or_insert_with(|| long.to_owned()), long);
            }
        }
        assert!(known.contains_key(&'o'));
    }
}

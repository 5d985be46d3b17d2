//! Whole files: finding the definitions, checking the structure, and recovering from unbalanced braces.
//!
//! The engine ignores a whole file whose structure is broken. Authors want more, so this reader reports the fault
//! with its place and goes on at the next definition:
//!
//! * A name without an opening brace, or a stray closing brace: everything up to the next *header* is passed. A
//!   header is a word that starts a line, is no keyword of the language, and has an opening brace as its next token.
//! * A definition that runs to the end of the file lacks a closing brace. Then, and from there on, a header inside a
//!   definition is taken for the start of the next one. Well-formed files are never read this way, because only a
//!   file that does not balance comes here.
//!
//! Every byte is looked at a fixed number of times, whatever the input.

mod condition;
mod definition;
mod stage;
mod values;

use crate::{
    diagnostic::{Diagnostic, Severity},
    shader::Shader,
    token::{Lexer, Position, Reading, Token},
};
pub use condition::Variables;
use definition::DefinitionParser;

/// What one file defines.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Script {
    /// All definitions in order, rejected and repeated ones too.
    pub shaders: Vec<Shader>,
    /// All faults, in order of discovery.
    pub diagnostics: Vec<Diagnostic>,
    /// Set when the engine's structural check fails, with the reason: the engine then uses nothing of this file.
    pub dropped: Option<String>,
}

/// Collects faults of one file.
pub(crate) struct Reporter<'a> {
    pub(crate) file: &'a str,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

impl Reporter<'_> {
    pub(crate) fn report(
        &mut self,
        severity: Severity,
        position: Position,
        shader: Option<&str>,
        message: impl Into<String>,
    ) {
        self.diagnostics.push(Diagnostic {
            file: self.file.to_owned(),
            line: position.line,
            column: position.column,
            severity,
            shader: shader.map(str::to_owned),
            message: message.into(),
        });
    }
}

/// Reads a script file.
///
/// `file` is the name that diagnostics and [`Location`](crate::Location)s carry. Never fails as a whole: faults are
/// in the result.
pub fn parse_script(file: &str, text: &[u8]) -> Script {
    parse_with(file, text, &|_| String::new())
}

/// [`parse_script`] with console variables, which conditions in `.shaderx` files compare.
pub(crate) fn parse_with(file: &str, text: &[u8], variables: Variables<'_>) -> Script {
    let mut reporter = Reporter {
        file,
        diagnostics: Vec::new(),
    };
    let mut shaders = Vec::new();
    let dropped = check_structure(text).err().map(|fault| {
        let reason = fault.message.clone();
        reporter.report(
            Severity::Error,
            fault.position,
            fault.shader.as_deref(),
            format!("{reason}; the engine ignores the whole file"),
        );
        reason
    });

    let mut lexer = Lexer::new(text, Reading::Compressed);
    let mut unbalanced = false;
    // Set while the words after a fault are passed, so that one fault is one message.
    let mut recovering = false;
    loop {
        let Some(name) = lexer.token() else {
            if lexer.at_end() {
                break;
            }
            continue;
        };
        let mut body = lexer;
        let opening = body.token();
        let opens = opening.as_ref().is_some_and(|token| token.text == "{") && !is_brace(&name);
        if !opens || (recovering && !is_header(&name, opening.as_ref())) {
            if !recovering && dropped.is_none() {
                // The raw reading was content: only comments glued to words can bring us here.
                reporter.report(
                    Severity::Error,
                    name.position,
                    None,
                    format!("'{}' is not followed by '{{'", name.text),
                );
            }
            recovering = true;
            continue;
        }
        recovering = false;

        // The definition's own parser checks the opening brace again, so it starts before it.
        let mut definition = lexer;
        lexer = body;
        let mut closed = !unbalanced && body.skip_section(1);
        if closed {
            lexer = body;
        } else {
            unbalanced = true;
            match find_end(&mut lexer) {
                End::Closed => closed = true,
                End::Header(next) => reporter.report(
                    Severity::Error,
                    name.position,
                    Some(&name.text),
                    format!(
                        "missing '}}' before the definition of '{}' in line {}",
                        next.text, next.position.line
                    ),
                ),
                End::File(position) => reporter.report(
                    Severity::Error,
                    name.position,
                    Some(&name.text),
                    format!(
                        "missing '}}' before the end of the file in line {}",
                        position.line
                    ),
                ),
            }
        }
        definition.cut_before(lexer.remaining());
        shaders
            .push(DefinitionParser::new(definition, &name, &mut reporter, variables).parse(closed));
    }
    if let (Some(start), None) = (lexer.unclosed_comment(), &dropped) {
        let lost = "this comment is never closed, so nothing after it is read, and the engine loses the scripts \
                    that it reads after this file, too; put */ where the comment ends";
        reporter.report(Severity::Warning, start, None, lost);
    }
    Script {
        shaders,
        diagnostics: reporter.diagnostics,
        dropped,
    }
}

/// Why the engine would ignore a file.
struct StructureFault {
    position: Position,
    shader: Option<String>,
    message: String,
}

/// The engine's check of a file before it is used: names, each with a balanced section, on the uncompressed text.
fn check_structure(text: &[u8]) -> Result<(), StructureFault> {
    let mut lexer = Lexer::new(text, Reading::Raw);
    while let Some(name) = lexer.token() {
        let opening = lexer.token();
        if opening.as_ref().is_none_or(|token| token.text != "{") {
            let found = opening.map_or("the end of the file".to_owned(), |token| {
                format!("'{}'", token.text)
            });
            return Err(StructureFault {
                position: name.position,
                message: if name.text == "}" {
                    "unmatched '}'".to_owned()
                } else {
                    format!("'{}': expected '{{', found {found}", name.text)
                },
                shader: (name.text != "}").then_some(name.text),
            });
        }
        if !lexer.skip_section(1) {
            return Err(StructureFault {
                position: name.position,
                message: "braces are not balanced up to the end of the file".to_owned(),
                shader: Some(name.text),
            });
        }
    }
    Ok(())
}

enum End {
    Closed,
    Header(Token),
    File(Position),
}

/// Passes a section whose opening brace is read, in a file that does not balance; stops before a header.
fn find_end(lexer: &mut Lexer) -> End {
    let mut depth = 1_u32;
    loop {
        let before = *lexer;
        let Some(token) = lexer.token() else {
            if lexer.at_end() {
                return End::File(lexer.position());
            }
            continue;
        };
        match token.text.as_str() {
            "{" => depth = depth.saturating_add(1),
            "}" => {
                depth = depth.saturating_sub(1);
                if depth == 0 {
                    return End::Closed;
                }
            }
            _ if token.starts_line => {
                let mut ahead = *lexer;
                if is_header(&token, ahead.token().as_ref()) {
                    *lexer = before;
                    return End::Header(token);
                }
            }
            _ => {}
        }
    }
}

fn is_brace(token: &Token) -> bool {
    token.text == "{" || token.text == "}"
}

/// Whether a word and the token after it look like the start of a definition.
fn is_header(name: &Token, next: Option<&Token>) -> bool {
    name.starts_line
        && !is_brace(name)
        && next.is_some_and(|token| token.text == "{")
        && !definition::is_keyword(&name.text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(script: &Script) -> Vec<&str> {
        script.shaders.iter().map(|s| s.name.as_str()).collect()
    }

    fn errors(script: &Script) -> Vec<String> {
        script.diagnostics.iter().map(|d| d.to_string()).collect()
    }

    #[test]
    fn an_empty_file_is_fine() {
        for text in ["", "// nothing\n", "/* */", "\n\n"] {
            assert_eq!(parse_script("f", text.as_bytes()), Script::default());
        }
    }

    #[test]
    fn a_missing_closing_brace_costs_one_definition() {
        let text = b"a\n{\n\t{\n\t\tmap x\n\t}\n\nb\n{\n\tnopicmip\n\t{\n\t\tmap y\n\t}\n}\nc\n{\n\t{\n\t\tmap z\n\t}\n}\n";
        let script = parse_script("f.shader", text);
        assert_eq!(names(&script), ["a", "b", "c"]);
        assert!(script.dropped.is_some());
        assert!(script.shaders[0].rejected.is_some());
        assert_eq!(script.shaders[0].stages.len(), 1);
        assert!(script.shaders[1].rejected.is_none());
        assert!(script.shaders[2].rejected.is_none());
        assert_eq!(
            errors(&script),
            [
                "f.shader:1:1: error: a: braces are not balanced up to the end of the file; the engine ignores the \
                 whole file",
                "f.shader:1:1: error: a: missing '}' before the definition of 'b' in line 7",
            ]
        );
    }

    #[test]
    fn a_missing_stage_brace_costs_one_definition() {
        let script = parse_script("f", b"a\n{\n{\nmap x\n}\nb {\n{\nmap y\n}\n}\n");
        assert_eq!(names(&script), ["a", "b"]);
        assert!(script.shaders[0].rejected.is_some());
        assert!(script.shaders[1].rejected.is_none());
    }

    #[test]
    fn a_stray_closing_brace_is_passed() {
        let script = parse_script("f", b"a\n{\n{\nmap x\n}\n}\n}\nb\n{\n{\nmap y\n}\n}\n");
        assert_eq!(names(&script), ["a", "b"]);
        assert!(script.shaders.iter().all(|s| s.rejected.is_none()));
        assert_eq!(
            errors(&script),
            ["f:7:1: error: unmatched '}'; the engine ignores the whole file"]
        );
    }

    #[test]
    fn a_missing_opening_brace_is_passed() {
        let script = parse_script(
            "f",
            b"a\nsurfaceparm trans\n{\nmap x\n}\n}\nb\n{\n{\nmap y\n}\n}\n",
        );
        assert_eq!(names(&script), ["b"]);
        assert_eq!(errors(&script).len(), 1);
        assert!(
            errors(&script)[0]
                .starts_with("f:1:1: error: a: 'a': expected '{', found 'surfaceparm'")
        );
    }

    #[test]
    fn the_last_definition_may_be_open() {
        let script = parse_script("f", b"a\n{\n{\nmap x\n}\n}\nb\n{\n{\nmap y\n");
        assert_eq!(names(&script), ["a", "b"]);
        assert!(script.shaders[0].rejected.is_none());
        assert!(script.shaders[1].rejected.is_some());
    }

    #[test]
    fn the_opening_brace_may_stand_on_the_name_line() {
        let script = parse_script("f", b"a {\n{\nmap x\n}\n}\n\"b c\" {\n{ map y\n}\n}");
        assert_eq!(names(&script), ["a", "b c"]);
        assert_eq!(script.dropped, None);
        assert_eq!(script.diagnostics, []);
    }
}

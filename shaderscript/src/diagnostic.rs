//! Faults found in scripts, with their place.

use std::fmt;

/// How bad a fault is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Severity {
    /// Worth telling an author; nothing is drawn differently.
    Note,
    /// The engine goes on, but probably not with what the author meant.
    Warning,
    /// The engine rejects the definition or the whole file.
    Error,
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        })
    }
}

/// One fault: where it is and what is wrong.
///
/// Displays as `file:line:column: severity: shader: message`, the form editors jump to.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Diagnostic {
    /// Name of the script file, as given by the caller.
    pub file: String,
    /// Line, counted from 1; CR, LF and CR LF each end one.
    pub line: u32,
    /// Column in bytes, counted from 1.
    pub column: u32,
    /// How bad it is.
    pub severity: Severity,
    /// The definition that it is in, when it is in one.
    pub shader: Option<String>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}:{}:{}: {}: ",
            self.file, self.line, self.column, self.severity
        )?;
        if let Some(shader) = &self.shader {
            write!(f, "{shader}: ")?;
        }
        f.write_str(&self.message)
    }
}

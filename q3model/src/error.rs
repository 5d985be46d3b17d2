//! What can be wrong with a model or font file, and where.

/// Why a file cannot be used. The file's name is the caller's to add.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Not the format read here.
    #[error("file is {found}, not {expected}")]
    WrongFormat {
        /// Identification and version found.
        found: String,
        /// What they should be.
        expected: &'static str,
    },
    /// The file ends too early, or an offset leads outside it.
    #[error(
        "{what}: {length} bytes at offset {offset} lie outside the file of {file_length} bytes"
    )]
    OutsideFile {
        /// What should be there.
        what: String,
        /// Where, bytes from the start of the file.
        offset: i64,
        /// How many bytes are needed.
        length: u64,
        /// Bytes in the file.
        file_length: usize,
    },
    /// A number that makes no sense.
    #[error("{what} is {value}, {expected}")]
    Value {
        /// Which number.
        what: String,
        /// What it is.
        value: i64,
        /// What it should be.
        expected: String,
    },
    /// Surfaces overlap so much that reading them would take far more memory than the file has.
    #[error("surfaces claim {claimed} bytes of a file of {file_length}")]
    TooMuchSharing {
        /// Sum of the bytes that all surfaces claim.
        claimed: u64,
        /// Bytes in the file.
        file_length: usize,
    },
}

//! What every file must lead to: a map that works, or an error that can be shown.

use crate::exercise::exercise;
use q3bsp::{Bsp, Format};

/// Reads the file and uses all of the map. The written map is the file again, or for the formats that are converted
/// one that reads back. False when the file is refused.
pub fn survive(bytes: &[u8]) -> bool {
    match Bsp::parse(bytes) {
        Ok(bsp) => {
            exercise(&bsp);
            let written = bsp.write();
            if bsp.format.is_quake() {
                let again = Bsp::parse(&written).expect("a converted map reads back");
                assert_eq!(again.format, Format::Fbsp);
            } else {
                assert!(written == bytes, "not written back as it was");
            }
            true
        }
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
    }
}

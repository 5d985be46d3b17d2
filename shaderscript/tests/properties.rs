//! Whatever the input, reading and evaluating neither panics nor loses its bearings.

use proptest::prelude::*;
use shaderscript::{
    parse_script,
    token::{Lexer, MAX_TOKEN_BYTES, Reading},
};
use survive::survive;

#[path = "common/survive.rs"]
mod survive;

/// Words that mean something, so that random texts get past the first one.
const WORDS: &[&str] = &[
    "{",
    "}",
    "(",
    ")",
    "\n",
    "\r",
    "\r\n",
    " ",
    "\"",
    "//",
    "/*",
    "*/",
    "a/b",
    "map",
    "clampmap",
    "animMap",
    "videoMap",
    "$lightmap",
    "$whiteimage",
    "blendFunc",
    "add",
    "filter",
    "GL_ONE",
    "GL_DST_COLOR",
    "GL_SRC_ALPHA",
    "rgbGen",
    "alphaGen",
    "wave",
    "sin",
    "noise",
    "const",
    "vertex",
    "portal",
    "tcGen",
    "vector",
    "environment",
    "tcMod",
    "scroll",
    "turb",
    "stretch",
    "rotate",
    "transform",
    "alphaFunc",
    "GE128",
    "depthWrite",
    "depthFunc",
    "equal",
    "detail",
    "deformVertexes",
    "move",
    "bulge",
    "autosprite",
    "autosprite2",
    "text3",
    "normal",
    "projectionShadow",
    "surfaceparm",
    "sky",
    "fog",
    "trans",
    "water",
    "skyParms",
    "-",
    "fogParms",
    "cull",
    "none",
    "sort",
    "additive",
    "nopicmip",
    "polygonOffset",
    "clampTime",
    "q3map_sun",
    "q3map_surfacelight",
    "q3map_skylight",
    "qer_editorimage",
    "0",
    "1",
    "-2.5",
    "1e30",
    "nan",
    "inf",
    "\u{e9}",
    "\0",
];

fn script_text() -> impl Strategy<Value = Vec<u8>> {
    let words = prop::collection::vec((prop::sample::select(WORDS), any::<bool>()), 0..200)
        .prop_map(|words| {
            let mut text = Vec::new();
            for (word, blank) in words {
                text.extend_from_slice(word.as_bytes());
                if blank {
                    text.push(b' ');
                }
            }
            text
        });
    prop_oneof![words, prop::collection::vec(any::<u8>(), 0..400)]
}

proptest! {
    #![proptest_config(testkit::cases(512))]

    #[test]
    fn any_text_is_read_and_evaluated(
        text in script_text(),
        time in prop_oneof![Just(0.0), -1e6..1e6, Just(f64::MAX)],
    ) {
        survive(&text, time);
    }

    #[test]
    fn lexers_only_go_forward(text in script_text(), compressed in any::<bool>()) {
        let reading = if compressed { Reading::Compressed } else { Reading::Raw };
        let mut lexer = Lexer::new(&text, reading);
        let mut last = lexer.position();
        let mut tokens = 0;
        while !lexer.at_end() {
            if let Some(token) = lexer.token() {
                prop_assert!(!token.text.is_empty());
                prop_assert!(token.text.len() <= 3 * MAX_TOKEN_BYTES);
                prop_assert!(token.position >= last);
                last = token.position;
            }
            tokens += 1;
            prop_assert!(tokens <= text.len());
        }
    }

    /// Cutting a well-formed file anywhere keeps every definition that was complete before the cut.
    #[test]
    fn truncation_keeps_what_was_complete(cut in 0_usize..1000) {
        let definition = |i: usize| format!("textures/t{i}\n{{\n\tsurfaceparm trans\n\t{{\n\t\tmap a\n\t}}\n}}\n");
        let whole: String = (0..10).map(definition).collect();
        let cut = cut.min(whole.len());
        let script = parse_script("f", &whole.as_bytes()[..cut]);
        let complete = (0..10)
            .scan(0, |end, i| {
                *end += definition(i).len();
                Some(*end)
            })
            // The last line end may be missing.
            .filter(|&end| end <= cut + 1)
            .count();
        let good = script.shaders.iter().filter(|s| s.rejected.is_none()).count();
        prop_assert_eq!(good, complete);
        prop_assert!(script.shaders.len() <= complete + 1);
    }
}

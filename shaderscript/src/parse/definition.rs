//! One definition: keywords outside its stages.

use super::{
    Reporter, Variables,
    condition::Chain,
    stage::Read,
    values::{lookup, number_at},
};
use crate::{
    diagnostic::Severity,
    reflection::GlossType,
    shader::{Cull, Deform, Fog, Location, Shader, Sky, Sun, UnknownDirective, sort},
    stage::TcGen,
    surface_params::{CONTENTS_FOG, surface_param},
    token::{Lexer, Position, Token, number, words},
};
use glam::Vec3;

/// Stages that the engine allows.
const MAX_STAGES: usize = 8;
/// Deformations that the engine allows.
const MAX_DEFORMS: usize = 3;

/// Faults reported for one definition; a generated file of nothing but faults must not fill the memory with them.
const MAX_REPORTS: usize = 64;

/// Reason why the engine rejects a definition.
pub(super) struct Rejection(pub(super) String);

/// An intended reason: tools' materials (clip, caulk ...) are written so, and the engine prints no message.
const NOTHING_TO_DRAW: &str = "no stages, and neither sky nor fog";

/// Reads one definition.
pub(super) struct DefinitionParser<'text, 'reporter, 'file> {
    pub(super) lexer: Lexer<'text>,
    pub(super) shader: Shader,
    reporter: &'reporter mut Reporter<'file>,
    /// Place of the keyword being read, for messages.
    pub(super) at: Position,
    /// Braces open around the keyword being read.
    pub(super) depth: u32,
    /// Faults reported so far.
    reports: usize,
    /// The file is a `.shaderx`, whose further keywords only Quake3e knows.
    pub(super) extended: bool,
    /// Words of reflection mean what they mean with `r_pbr 1`.
    pub(super) pbr: bool,
    /// What a gloss means.
    pub(super) gloss: GlossType,
    pub(super) variables: Variables<'text>,
    pub(super) chain: Chain,
}

/// Keywords that may stand alone on a line before a stage, and all others; `q3map` and `qer` are prefixes.
pub(super) fn is_keyword(word: &str) -> bool {
    const KEYWORDS: [&str; 14] = [
        "surfaceparm",
        "deformVertexes",
        "tesssize",
        "clampTime",
        "nomipmaps",
        "nopicmip",
        "polygonOffset",
        "entityMergable",
        "fogParms",
        "portal",
        "skyParms",
        "light",
        "cull",
        "sort",
    ];
    KEYWORDS
        .iter()
        .any(|keyword| keyword.eq_ignore_ascii_case(word))
        || has_prefix(word, "q3map")
        || has_prefix(word, "qer")
}

fn has_prefix(word: &str, prefix: &str) -> bool {
    word.get(..prefix.len())
        .is_some_and(|start| start.eq_ignore_ascii_case(prefix))
}

fn has_ending(name: &str, ending: &str) -> bool {
    let start = name.len().saturating_sub(ending.len());
    name.get(start..)
        .is_some_and(|end| end.eq_ignore_ascii_case(ending))
}

impl<'text, 'reporter, 'file> DefinitionParser<'text, 'reporter, 'file> {
    /// Prepares to read the text that follows a name.
    pub(super) fn new(
        lexer: Lexer<'text>,
        name: &Token,
        reporter: &'reporter mut Reporter<'file>,
        variables: Variables<'text>,
    ) -> Self {
        let mut shader = Shader::new(name.text.clone());
        shader.location = Location {
            file: reporter.file.to_owned(),
            line: name.position.line,
        };
        let extended = has_ending(reporter.file, ".shaderx");
        DefinitionParser {
            lexer,
            shader,
            reporter,
            at: name.position,
            depth: 0,
            reports: 0,
            extended,
            pbr: number(&variables("r_pbr")) != 0.0,
            gloss: GlossType::of_variable(&variables("r_glossType")),
            variables,
            chain: None,
        }
    }

    /// Reads to the end. `closed` is false when the caller already reported a missing brace.
    pub(super) fn parse(mut self, closed: bool) -> Shader {
        if let Err(Rejection(reason)) = self.body() {
            if closed {
                let severity = if reason == NOTHING_TO_DRAW {
                    Severity::Note
                } else {
                    Severity::Error
                };
                self.report(
                    severity,
                    format!("{reason}; the engine rejects the definition"),
                );
            }
            self.shader.rejected = Some(reason);
            self.salvage();
        }
        self.shader
    }

    fn report(&mut self, severity: Severity, message: String) {
        self.reports += 1;
        let name = Some(self.shader.name.as_str());
        // An error is the last fault of a definition and is always reported.
        if self.reports <= MAX_REPORTS || severity == Severity::Error {
            self.reporter.report(severity, self.at, name, message);
        } else if self.reports == MAX_REPORTS + 1 {
            let message = "further faults of this definition are not listed";
            self.reporter.report(Severity::Note, self.at, name, message);
        }
    }

    pub(super) fn warn(&mut self, message: impl Into<String>) {
        self.report(Severity::Warning, message.into());
    }

    fn body(&mut self) -> Result<(), Rejection> {
        let missing_brace = || Rejection("no closing '}'".to_owned());
        if self.lexer.token().is_none_or(|t| !t.text.starts_with('{')) {
            return Err(Rejection("expected '{'".to_owned()));
        }
        self.depth = 1;
        let mut stages_seen = 0_usize;
        // A stage without an image ends the list that is drawn.
        let mut list_ended = false;
        // Line feeds before the last keyword or brace; what follows the opening brace begins a line for compilers.
        let mut before = None;
        loop {
            let token = self.lexer.token().ok_or_else(missing_brace)?;
            let feeds = Some(self.lexer.line_feeds());
            let starts_line = std::mem::replace(&mut before, feeds) != feeds;
            self.at = token.position;
            if token.text.starts_with('}') {
                self.depth = 0;
                break;
            }
            if token.text.starts_with('{') {
                if stages_seen == MAX_STAGES {
                    self.depth = 2;
                    return Err(Rejection(format!("more than {MAX_STAGES} stages")));
                }
                stages_seen += 1;
                self.depth = 2;
                let stage = self.stage()?;
                self.depth = 1;
                before = Some(self.lexer.line_feeds());
                match stage {
                    Some(stage) if !list_ended => self.take(stage),
                    Some(_) => {}
                    None => {
                        self.at = token.position;
                        self.warn("stage without an image; it and all later ones are not drawn");
                        list_ended = true;
                    }
                }
                continue;
            }
            self.keyword(&token, starts_line)?;
        }
        if stages_seen == 0
            && self.shader.sky.is_none()
            && self.shader.content_flags & CONTENTS_FOG == 0
        {
            return Err(Rejection(NOTHING_TO_DRAW.to_owned()));
        }
        Ok(())
    }

    /// Adds a stage. Maps of the reflection belong to the first stage of colour, which must stand before them.
    fn take(&mut self, stage: Read) {
        let reflection = &mut self.shader.reflection;
        let mut colors =
            (self.shader.stages.iter()).filter(|stage| stage.tc_gen != TcGen::Lightmap);
        let after_color = colors.next().is_some();
        match stage {
            Read::Color(stage, specular) => {
                let first = !after_color && stage.tc_gen != TcGen::Lightmap;
                if first && !specular.is_empty() {
                    reflection.specular = Some(specular);
                }
                self.shader.stages.push(stage);
            }
            Read::Normals(normals) if after_color => {
                reflection.normals.get_or_insert(normals);
            }
            Read::Specular(specular) if after_color => {
                if reflection
                    .specular
                    .as_ref()
                    .is_none_or(|s| s.image.is_none())
                {
                    reflection.specular = Some(specular);
                }
            }
            Read::Normals(_) | Read::Specular(_) => {
                self.warn("a map of normals or reflection before the image that it belongs to is not used");
            }
        }
    }

    fn keyword(&mut self, token: &Token, starts_line: bool) -> Result<(), Rejection> {
        // The order of the first three tests is the engine's.
        if has_prefix(&token.text, "qer") {
            self.directive(token, starts_line);
            return Ok(());
        }
        if token.is("q3map_sun") || token.is("q3map_sunExt") {
            self.sun(token);
            return Ok(());
        }
        if has_prefix(&token.text, "q3map") {
            self.directive(token, starts_line);
            return Ok(());
        }
        match token.text.to_ascii_lowercase().as_str() {
            "surfaceparm" => self.surface_param(),
            "deformvertexes" => self.deform(),
            "tesssize" => {
                self.lexer.rest_of_line();
            }
            "clamptime" => {
                let seconds = self.lexer.token_on_line().map(|t| t.number());
                // The engine tests for zero, so a clamp at 0 is none.
                self.shader.clamp_time = seconds.filter(|&s| s != 0.0);
            }
            "nomipmaps" => {
                self.shader.no_mipmaps = true;
                self.shader.no_picmip = true;
            }
            "nopicmip" => self.shader.no_picmip = true,
            "polygonoffset" => self.shader.polygon_offset = true,
            "entitymergable" => self.shader.entity_mergable = true,
            "fogparms" => self.fog()?,
            "portal" => {
                self.shader.portal = true;
                self.shader.sort = Some(sort::PORTAL);
            }
            "skyparms" => self.sky(),
            "light" => {
                self.shader.light.light = self.lexer.token_on_line().map(|t| t.number());
            }
            "cull" => self.cull(),
            "sort" => self.sort(),
            // nothing is merged that it would keep apart
            "novlcollapse" if self.extended => {}
            word @ ("if" | "elif" | "else") if self.extended => self.branch(word)?,
            _ => {
                self.shader.unknown.push(UnknownDirective {
                    keyword: token.text.clone(),
                    arguments: Vec::new(),
                    line: token.position.line,
                });
                return Err(Rejection(format!("unknown keyword '{}'", token.text)));
            }
        }
        Ok(())
    }

    fn surface_param(&mut self) {
        let Some(token) = self.lexer.token_on_line() else {
            self.warn("surfaceparm without a name");
            return;
        };
        match surface_param(&token.text) {
            Some(param) => {
                self.shader.surface_flags |= param.surface_flags;
                self.shader.content_flags |= param.content_flags;
            }
            None => self.report(
                Severity::Note,
                format!("unknown surfaceparm '{}'", token.text),
            ),
        }
        self.shader
            .surface_params
            .push(token.text.to_ascii_lowercase());
    }

    fn deform(&mut self) {
        let Some(kind) = self.lexer.token_on_line() else {
            self.warn("deformVertexes without a kind");
            return;
        };
        if self.shader.deforms.len() >= MAX_DEFORMS {
            // Its arguments stay unread, as in the engine, and are the next keywords.
            self.warn(format!(
                "more than {MAX_DEFORMS} deformVertexes; '{}' is ignored",
                kind.text
            ));
            return;
        }
        match self.deform_of(&kind.text) {
            Ok(deform) => self.shader.deforms.push(deform),
            Err(fault) => self.warn(fault),
        }
    }

    fn deform_of(&mut self, kind: &str) -> Result<Deform, String> {
        if has_prefix(kind, "text") {
            let digit = kind.as_bytes().get(4).map_or(0, |b| b.wrapping_sub(b'0'));
            return Ok(Deform::Text(if digit <= 7 { digit } else { 0 }));
        }
        let argument = |parser: &mut Self| {
            parser
                .lexer
                .token_on_line()
                .map(|t| t.number())
                .ok_or_else(|| format!("deformVertexes {kind}: missing argument"))
        };
        match kind.to_ascii_lowercase().as_str() {
            "projectionshadow" => Ok(Deform::ProjectionShadow),
            "autosprite" => Ok(Deform::AutoSprite),
            "autosprite2" => Ok(Deform::AutoSprite2),
            "bulge" => Ok(Deform::Bulge {
                width: argument(self)?,
                height: argument(self)?,
                speed: argument(self)?,
            }),
            "wave" => {
                let div = argument(self)?;
                let spread = if div != 0.0 {
                    // Finite even for the smallest number, since infinity times zero is not.
                    (1.0 / div).clamp(f32::MIN, f32::MAX)
                } else {
                    self.warn("deformVertexes wave: a div of 0 is not allowed, using 0.01");
                    100.0
                };
                Ok(Deform::Wave {
                    spread,
                    wave: self.wave("deformVertexes wave", false),
                })
            }
            "normal" => Ok(Deform::Normal {
                amplitude: argument(self)?,
                frequency: argument(self)?,
            }),
            "move" => {
                let direction = Vec3::new(argument(self)?, argument(self)?, argument(self)?);
                Ok(Deform::Move {
                    direction,
                    wave: self.wave("deformVertexes move", false),
                })
            }
            _ => Err(format!("unknown deformVertexes '{kind}'")),
        }
    }

    fn fog(&mut self) -> Result<(), Rejection> {
        let mut color = Vec3::ZERO;
        self.vector(&mut color)
            .map_err(|fault| Rejection(format!("fogParms: {fault}")))?;
        let depth = self.lexer.token_on_line();
        self.shader.fog = Some(Fog {
            color,
            depth: depth.as_ref().map_or(0.0, Token::number),
        });
        if depth.is_some() {
            // Old scripts go on with directions of a gradient.
            self.lexer.rest_of_line();
        } else {
            self.warn("fogParms without a depth");
        }
        Ok(())
    }

    fn sky(&mut self) {
        let mut argument = || self.lexer.token_on_line().map(|t| t.text);
        // Reads nothing after the line's end: that would be the next line's.
        let mut arguments = || Some((argument()?, argument()?, argument()?));
        let Some((outer, height, inner)) = arguments() else {
            self.warn("skyParms needs three arguments; this is not a sky");
            return;
        };
        let name = |word: String| (word != "-").then_some(word);
        let height = number(&height);
        self.shader.sky = Some(Sky {
            outer: name(outer),
            cloud_height: if height == 0.0 { 512.0 } else { height },
            inner: name(inner),
        });
    }

    fn cull(&mut self) {
        const NAMES: [(&str, Cull); 6] = [
            ("none", Cull::None),
            ("twosided", Cull::None),
            ("disable", Cull::None),
            ("back", Cull::Back),
            ("backside", Cull::Back),
            ("backsided", Cull::Back),
        ];
        match self.lexer.token_on_line() {
            None => self.warn("cull without a side"),
            Some(side) => match lookup(&NAMES, &side.text) {
                Some(cull) => self.shader.cull = cull,
                None => self.warn(format!("unknown cull side '{}'; unchanged", side.text)),
            },
        }
    }

    fn sort(&mut self) {
        const NAMES: [(&str, f32); 9] = [
            ("portal", sort::PORTAL),
            ("sky", sort::SKY),
            ("opaque", sort::OPAQUE),
            ("decal", sort::DECAL),
            ("seeThrough", sort::SEE_THROUGH),
            ("banner", sort::BANNER),
            ("additive", sort::ADDITIVE),
            ("nearest", sort::NEAREST),
            ("underwater", sort::UNDERWATER),
        ];
        let Some(word) = self.lexer.token_on_line() else {
            self.warn("sort without a value");
            return;
        };
        let value = lookup(&NAMES, &word.text).unwrap_or_else(|| word.number());
        // Zero means "not set" to the engine.
        self.shader.sort = (value != 0.0).then_some(value);
    }

    /// `q3map_sun` and `q3map_sunExt`, the only light directives that the engine reads too.
    fn sun(&mut self, keyword: &Token) {
        let mut arguments = Vec::new();
        let mut missing = false;
        for _ in 0..6 {
            // Read on even past a line end, as the engine does.
            match self.lexer.token_on_line() {
                Some(token) => arguments.push(token.text),
                None => {
                    missing = true;
                    arguments.push(String::new());
                }
            }
        }
        arguments.extend(words(&self.lexer.rest_of_line()));
        if missing {
            self.warn(format!(
                "{} needs a colour, an intensity, degrees and an elevation",
                keyword.text
            ));
        }
        let value = |i: usize| number_at(&arguments, i).unwrap_or(0.0);
        let (azimuth, elevation) = (value(4).to_radians(), value(5).to_radians());
        let extended = keyword.is("q3map_sunExt");
        let sun = Sun {
            color: Vec3::new(value(0), value(1), value(2)),
            intensity: value(3),
            direction: Vec3::new(
                azimuth.cos() * elevation.cos(),
                azimuth.sin() * elevation.cos(),
                elevation.sin(),
            ),
            deviance_degrees: if extended { value(6) } else { 0.0 },
            samples: if extended {
                (value(7) as i32).max(1)
            } else {
                1
            },
        };
        self.shader.sun = Some(sun);
        self.shader.suns.push(sun);
        self.remember(keyword, arguments);
    }

    /// A line for another program. Map compilers read one directive a line and pass what follows it.
    fn directive(&mut self, keyword: &Token, starts_line: bool) {
        let arguments = words(&self.lexer.rest_of_line());
        if !starts_line {
            self.remember(keyword, arguments);
            return;
        }
        let light = &mut self.shader.light;
        let mut not_a_number = None;
        let mut read = |i: usize| {
            let value = number_at(&arguments, i);
            if value.is_none() {
                // An argument that is missing is shown as empty.
                not_a_number = Some(arguments.get(i).cloned().unwrap_or_default());
            }
            value
        };
        match keyword.text.to_ascii_lowercase().as_str() {
            // An argument that is no number keeps the value of an earlier line.
            "q3map_surfacelight" => light.surface_light = read(0).or(light.surface_light),
            "q3map_lightimage" => light.light_image = arguments.first().cloned(),
            "q3map_lightrgb" => {
                light.light_rgb = (|| Some(Vec3::new(read(0)?, read(1)?, read(2)?)))();
            }
            "q3map_lightsubdivide" => light.light_subdivide = read(0),
            "q3map_skylight" => {
                // Without iterations the compiler takes the fewest that it allows.
                let iterations = number_at(&arguments, 1).map_or(2, |n| (n as i32).max(2));
                light.sky_light = read(0).map(|value| (value, iterations));
            }
            "q3map_backsplash" => {
                light.backsplash = (|| Some((read(0)?, read(1)?)))();
            }
            "q3map_bouncescale" | "q3map_bounce" => light.bounce_scale = read(0),
            "q3map_lightmapbrightness" | "q3map_lightmapgamma" => {
                let so_far = light.lightmap_brightness.unwrap_or(1.0);
                let factor = read(0).map(|value| so_far * value);
                light.lightmap_brightness = factor
                    .map(|f| if f > 0.0 { f } else { 1.0 })
                    .or(light.lightmap_brightness);
            }
            "q3map_flare" | "q3map_flareshader" => light.flare = arguments.first().cloned(),
            "qer_editorimage" => light.editor_image = arguments.first().cloned(),
            _ => {}
        }
        if let Some(word) = not_a_number {
            self.warn(format!("{}: '{word}' is not a number", keyword.text));
        }
        self.remember(keyword, arguments);
    }

    fn remember(&mut self, keyword: &Token, arguments: Vec<String>) {
        self.shader.unknown.push(UnknownDirective {
            keyword: keyword.text.clone(),
            arguments,
            line: keyword.position.line,
        });
    }

    /// After a rejection: goes to the end of the definition for its light directives, because the map compiler,
    /// which wrote the lightmaps, did not reject it.
    fn salvage(&mut self) {
        let mut before = self.lexer.line_feeds();
        while self.depth > 0 {
            let Some(token) = self.lexer.token() else {
                if self.lexer.at_end() {
                    return;
                }
                continue;
            };
            let feeds = self.lexer.line_feeds();
            let starts_line = std::mem::replace(&mut before, feeds) != feeds;
            match token.text.as_str() {
                "{" => self.depth = self.depth.saturating_add(1),
                "}" => self.depth -= 1,
                _ if self.depth > 1 || !starts_line => {}
                _ => {
                    self.at = token.position;
                    if token.is("q3map_sun") || token.is("q3map_sunExt") {
                        self.sun(&token);
                    } else if has_prefix(&token.text, "q3map") || has_prefix(&token.text, "qer") {
                        self.directive(&token, true);
                    }
                }
            }
        }
    }
}

//! Converts the formats' drawing rules to materials: by the first letters of names in Quake, by flags in
//! Quake II.

use super::textures::{EmbeddedTexture, TextureUse, name_of, quake2_flags};
use super::{QuakeMap, Texinfo};
use crate::format::Format;
use crate::{Bsp, content_flags, surface_flags};
use std::collections::HashSet;
use std::fmt::Write;

/// Pictures per second of Quake's animations.
const QUAKE_RATE: f32 = 5.0;

/// Pictures per second of Quake II's animations.
const QUAKE2_RATE: f32 = 2.0;

/// Repetitions per second that a flowing face of Quake II moves by.
const FLOW: f32 = -1.6;

/// Most pictures of an animation of Quake II; texinfos may go round in circles.
const MAX_FRAMES: usize = 64;

/// A material and what it is to the map: its description, surface flags and content flags.
pub(super) struct Described {
    pub texture: TextureUse,
    pub surface_flags: u32,
    pub content_flags: u32,
}

fn path(name: &str) -> String {
    format!("textures/{name}")
}

impl QuakeMap {
    /// The material of a texinfo. `names` are those of all textures; `contents` are those of the brush in Quake II, 0 if not known.
    pub(super) fn describe(
        &self,
        texinfo: &Texinfo,
        textures: &[Option<EmbeddedTexture>],
        names: &HashSet<&str>,
        contents: u32,
        sky_box: Option<&str>,
    ) -> Described {
        if self.format.is_quake2() {
            return self.describe_quake2(texinfo, contents, sky_box);
        }
        let texture = usize::try_from(texinfo.texture)
            .ok()
            .and_then(|at| textures.get(at)?.as_ref());
        match texture {
            Some(texture) => self.describe_quake(texture, names, sky_box),
            None => Described {
                texture: TextureUse {
                    material: path("missing"),
                    frames: vec![path("missing")],
                    opacity: 1.0,
                    ..TextureUse::default()
                },
                surface_flags: 0,
                content_flags: content_flags::SOLID,
            },
        }
    }

    fn describe_quake(
        &self,
        texture: &EmbeddedTexture,
        names: &HashSet<&str>,
        sky_box: Option<&str>,
    ) -> Described {
        let name = texture.name.as_str();
        let mut described = Described {
            texture: TextureUse {
                material: path(name),
                frames: vec![path(name)],
                rate: QUAKE_RATE,
                opacity: 1.0,
                ..TextureUse::default()
            },
            surface_flags: 0,
            content_flags: content_flags::SOLID,
        };
        let gold_src = self.format == Format::GoldSrc;
        let use_ = &mut described.texture;
        if name.starts_with("sky") {
            described.surface_flags = surface_flags::SKY | surface_flags::NOLIGHTMAP;
            use_.parameters = vec!["sky", "nolightmap"];
            match sky_box {
                Some(sky) if gold_src => use_.sky_box = Some(format!("gfx/env/{sky}")),
                _ if texture.indices.is_some() => {
                    use_.layered_sky = true;
                    use_.frames = vec![
                        path(&format!("{name}_back")),
                        path(&format!("{name}_front")),
                    ];
                }
                _ => {}
            }
        } else if name.starts_with('*') || gold_src && name.starts_with('!') {
            use_.warps = true;
            (described.content_flags, use_.parameters) = if name.contains("lava") {
                (content_flags::LAVA, vec!["lava", "nolightmap"])
            } else if name.contains("slime") {
                (content_flags::SLIME, vec!["slime", "nolightmap"])
            } else if name.contains("tele") {
                (0, vec!["nolightmap"])
            } else {
                (content_flags::WATER, vec!["water", "nolightmap"])
            };
        } else {
            use_.holes = name.starts_with('{');
            use_.glow = (!gold_src && texture.glows()).then(|| path(&format!("{name}_glow")));
            if let Some(family) = name.strip_prefix('+').and_then(|rest| rest.get(1..)) {
                let frame = |digit| format!("+{digit}{family}");
                let exists = |name: &String| names.contains(name.as_str());
                let frames: Vec<String> = (0..10).map(frame).take_while(exists).collect();
                if frames.len() > 1 {
                    use_.frames = frames.iter().map(|frame| path(frame)).collect();
                }
            }
        }
        described
    }

    fn describe_quake2(
        &self,
        texinfo: &Texinfo,
        contents: u32,
        sky_box: Option<&str>,
    ) -> Described {
        use quake2_flags::{FLOWING, LIGHT, SKY, TRANS33, TRANS66, WARP};
        let name = name_of(&texinfo.name);
        let has = |flag: u32| texinfo.flags & flag != 0;
        let mut use_ = TextureUse {
            material: path(&name),
            frames: vec![path(&name)],
            rate: QUAKE2_RATE,
            opacity: 1.0,
            ..TextureUse::default()
        };
        if has(SKY) {
            use_.parameters = vec!["sky", "nolightmap"];
            use_.sky_box = sky_box.map(|sky| format!("env/{sky}"));
        } else {
            use_.warps = has(WARP);
            use_.opacity = match (has(TRANS33), has(TRANS66)) {
                (true, _) => 0.33,
                (_, true) => 0.66,
                _ => 1.0,
            };
            use_.flow = if has(FLOWING) { FLOW } else { 0.0 };
            if use_.opacity < 1.0 {
                use_.parameters.push("trans");
            }
            if use_.warps || use_.opacity < 1.0 {
                use_.parameters.push("nolightmap");
            }
        }
        if has(LIGHT) && texinfo.value > 0 {
            use_.light = texinfo.value as f32;
        }
        let mut next = texinfo.next;
        while let Some(info) = usize::try_from(next)
            .ok()
            .and_then(|at| self.texinfos.get(at))
        {
            let frame = path(&name_of(&info.name));
            if use_.frames.len() >= MAX_FRAMES || use_.frames.contains(&frame) {
                break;
            }
            use_.frames.push(frame);
            next = info.next;
        }
        let content_flags = contents_of_quake2(contents);
        for (flag, word) in [
            (content_flags::WATER, "water"),
            (content_flags::LAVA, "lava"),
            (content_flags::SLIME, "slime"),
        ] {
            if content_flags & flag != 0 {
                use_.parameters.push(word);
            }
        }
        // One name may be used in several ways.
        for (used, suffix) in [
            (use_.warps, "+warp".to_owned()),
            (
                use_.opacity < 1.0,
                format!("+{}", (use_.opacity * 100.0) as u32),
            ),
            (use_.flow != 0.0, "+flow".to_owned()),
            (use_.light > 0.0, format!("+light{}", use_.light as i32)),
        ] {
            if used {
                use_.material.push_str(&suffix);
            }
        }
        Described {
            texture: use_,
            // The bits that both engines have mean the same.
            surface_flags: texinfo.flags
                & (surface_flags::SLICK
                    | surface_flags::SKY
                    | surface_flags::NODRAW
                    | surface_flags::HINT
                    | surface_flags::SKIP),
            content_flags,
        }
    }
}

/// Content flags of Quake II in the bits used here.
fn contents_of_quake2(contents: u32) -> u32 {
    const WINDOW: u32 = 0x2;
    const TRANSLUCENT: u32 = 0x1000_0000;
    const SAME: u32 = content_flags::SOLID
        | content_flags::LAVA
        | content_flags::SLIME
        | content_flags::WATER
        | content_flags::AREAPORTAL
        | content_flags::PLAYERCLIP
        | content_flags::MONSTERCLIP
        | content_flags::ORIGIN
        | content_flags::DETAIL;
    let mut ours = contents & SAME;
    if contents & WINDOW != 0 {
        ours |= content_flags::SOLID;
    }
    if contents & TRANSLUCENT != 0 {
        ours |= content_flags::TRANSLUCENT;
    }
    ours
}

impl TextureUse {
    /// Whether a bare picture with a lightmap is all there is to it.
    fn is_plain(&self) -> bool {
        self.frames.len() == 1
            && !self.warps
            && !self.holes
            && self.opacity >= 1.0
            && self.flow == 0.0
            && self.light == 0.0
            && self.glow.is_none()
            && self.parameters.is_empty()
    }

    /// The material as a shader script, without its name; `None` if a bare picture is equivalent.
    fn script(&self) -> Option<String> {
        if self.is_plain() {
            return None;
        }
        let mut out = String::from("{\n");
        // Writing to a string does not fail.
        let mut line = |text: std::fmt::Arguments<'_>| {
            let _ = writeln!(out, "\t{text}");
        };
        for word in &self.parameters {
            line(format_args!("surfaceparm {word}"));
        }
        if self.light > 0.0 {
            line(format_args!("q3map_surfacelight {}", self.light));
        }
        let map = match self.frames.as_slice() {
            [one] => format!("map {one}"),
            // The most that the engine takes.
            many => {
                let shown: Vec<&str> = many.iter().take(8).map(String::as_str).collect();
                format!("animMap {} {}", self.rate, shown.join(" "))
            }
        };
        let flow = match self.flow {
            0.0 => String::new(),
            flow => format!(" tcMod scroll {flow} 0"),
        };
        let stage = |text: String| format!("{{ {text} }}").replace(" tcMod", "\n\ttcMod");
        if let Some(sky) = &self.sky_box {
            line(format_args!("skyparms {sky} - -"));
        } else if let ([back, front], true) = (self.frames.as_slice(), self.layered_sky) {
            line(format_args!("skyparms - 512 -"));
            line(format_args!(
                "{{\n\tmap {back}\n\ttcMod scroll 0.0625 0.0625\n\t}}"
            ));
            line(format_args!(
                "{{\n\tmap {front}\n\tblendFunc blend\n\ttcMod scroll 0.125 0.125\n\t}}"
            ));
        } else if self.warps || self.opacity < 1.0 {
            let mut text = format!("{map}\n");
            if self.opacity < 1.0 {
                text += &format!("\tblendFunc blend\n\talphaGen const {}\n", self.opacity);
            }
            text += "\trgbGen identity\n";
            if self.warps {
                text += "\ttcMod turb 0 0.0625 0 0.25\n";
            }
            text += &flow.replace(" tcMod", "\ttcMod");
            line(format_args!("{{\n\t{text}\n\t}}"));
        } else if self.holes {
            line(format_args!(
                "{{\n\t{map}\n\talphaFunc GE128\n\tdepthWrite\n\trgbGen identity\n\t}}"
            ));
            line(format_args!(
                "{{\n\tmap $lightmap\n\tblendFunc filter\n\tdepthFunc equal\n\t}}"
            ));
        } else if !self.parameters.contains(&"sky") {
            line(format_args!("{{\n\tmap $lightmap\n\trgbGen identity\n\t}}"));
            let text = stage(format!("{map}{flow}\n\tblendFunc filter\n\t"));
            line(format_args!("{}", text.replacen("{ ", "{\n\t", 1)));
        }
        if let Some(glow) = &self.glow {
            let depth = if self.holes {
                "\n\tdepthFunc equal"
            } else {
                ""
            };
            line(format_args!(
                "{{\n\tmap {glow}\n\tblendFunc add{depth}\n\t}}"
            ));
        }
        out.push_str("}\n");
        Some(out)
    }
}

impl Bsp {
    /// The shader script of a map that was converted from a format without scripts: what its engine did by names and
    /// flags of textures, as materials. Empty for other maps. Materials equivalent to a bare picture are left
    /// out.
    pub fn material_script(&self) -> String {
        let mut out = String::new();
        for texture in &self.texture_uses {
            if let Some(body) = texture.script() {
                out.push_str(&texture.material);
                out.push('\n');
                out.push_str(&body);
            }
        }
        out
    }
}

//! What a material's stages show without incident light (emission), and what they show of incident light
//! (reflectance).

use super::Shade;
use crate::image::Image;
use crate::materials::light::{
    LightLinear, StageSample, compose, compose_encoded, glow_stages, is_gloss, is_reflection,
};
use crate::overbright;
use crate::overbright::luminance;
use glam::{Vec2, Vec3, Vec4};
use shaderscript::eval::{self, ColorContext};
use shaderscript::{ImplicitKind, RgbGen, Shader, Stage, StageImage, TcGen};
use support::slice;

/// Samples along each side of a texture.
const GRID: u32 = 16;

/// Number of classes of brightness of a texture.
const SHADES: usize = 16;

/// Times at which an animated material is evaluated, seconds: uneven, so that no common period hides a blinking
/// lamp.
const TIMES: [f64; 12] = [
    0.0, 0.31, 0.73, 1.07, 1.39, 1.83, 2.21, 2.69, 3.17, 3.71, 4.33, 5.09,
];

/// Mean emission of a material's stages over texture and time, linear; zero for stages that only reflect.
///
/// Vertex colours of world surfaces are light and are left out. Environment-mapped stages show surroundings and
/// count as black. `image` returns a picture by name; unknown ones are black.
pub(super) fn mean_emission<'a>(
    shader: &Shader,
    image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec3 {
    if glow_stages(shader, true).is_empty() {
        return Vec3::ZERO;
    }
    let sum = Sum {
        table: &overbright::byte_table(),
        compose,
        corners: [255; 4],
        roles: shader.stages.iter().map(emission_role).collect(),
    };
    let drawn = sum.drawn(shader, &TIMES, image);
    let count = drawn.len().max(1) as f32;
    let whole: Vec3 = drawn.into_iter().map(|d| d.emission.max(Vec3::ZERO)).sum();
    let mean = whole / count;
    if mean.is_finite() { mean } else { Vec3::ZERO }
}

/// Reflectance of a material at time 0: the brightness classes of its texture from dark to bright, equal parts of
/// the texture each. `lighting`: how its surfaces are lit; `corners`: mean colour of their vertices, encoded.
pub(super) fn shades<'a>(
    shader: &Shader,
    lighting: ImplicitKind,
    corners: [u8; 4],
    image: impl FnMut(&str) -> Option<&'a Image>,
) -> Vec<Shade> {
    let start = slice::part(&TIMES, ..1);
    // Stages are composed display-encoded, as in the shaders.
    let sum = Sum {
        table: &std::array::from_fn(|byte| byte as f32 / 255.0),
        compose: compose_encoded,
        corners,
        roles: (0..shader.stages.len())
            .map(|index| light_role(shader, index, lighting))
            .collect(),
    };
    let known = |color: Vec3| {
        let color = color.max(Vec3::ZERO);
        if color.is_finite() { color } else { Vec3::ZERO }
    };
    let mut all: Vec<Shade> = sum
        .drawn(shader, start, image)
        .into_iter()
        .map(|drawn| {
            let encoded = known(drawn.lit);
            Shade {
                linear: overbright::colour_to_linear(encoded),
                encoded,
                mirrored: overbright::colour_to_linear(known(drawn.reflected)),
            }
        })
        .collect();
    all.sort_by(|a, b| luminance(a.linear).total_cmp(&luminance(b.linear)));
    let mean = |group: &[Shade]| {
        let part = 1.0 / group.len().max(1) as f32;
        Shade {
            linear: group.iter().map(|s| s.linear).sum::<Vec3>() * part,
            encoded: group.iter().map(|s| s.encoded).sum::<Vec3>() * part,
            mirrored: group.iter().map(|s| s.mirrored).sum::<Vec3>() * part,
        }
    };
    all.chunks(all.len().div_ceil(SHADES).max(1))
        .map(mean)
        .collect()
}

/// How a stage uses its image; the same cases as `run_stages` of `trace/layer.glsl`.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    /// Black.
    Nothing,
    /// The image.
    Texture,
    /// A picture of an environment that stands for a mirror alone.
    Mirror,
    /// One that shows light as a texture does, and mirrors besides. `masked`: where the colours of the corners say so,
    /// which are no light then.
    Gloss { masked: bool },
}

/// Role of a stage without incident light: environment-mapped stages emit nothing.
fn emission_role(stage: &Stage) -> Role {
    match stage.tc_gen {
        TcGen::Environment => Role::Nothing,
        _ => Role::Texture,
    }
}

/// Role of a stage on surfaces that are lit in this manner.
fn light_role(shader: &Shader, index: usize, lighting: ImplicitKind) -> Role {
    let Some(stage) = slice::get(&shader.stages, index) else {
        return Role::Nothing;
    };
    if !is_reflection(shader, stage) {
        return Role::Texture;
    }
    if !is_gloss(shader, index, lighting == ImplicitKind::Vertex) {
        return Role::Mirror;
    }
    let of_corners = matches!(stage.rgb_gen, RgbGen::Vertex | RgbGen::ExactVertex);
    Role::Gloss {
        masked: of_corners && lighting == ImplicitKind::Lightmapped,
    }
}

/// Composes the stages of a material.
type Compose = fn(&[Stage], &[StageSample], bool) -> LightLinear;

/// Evaluation of a material's stages.
struct Sum<'a> {
    /// The numbers that bytes stand for.
    table: &'a [f32; 256],
    compose: Compose,
    /// The colour of the surface's corners.
    corners: [u8; 4],
    /// What each stage shows.
    roles: Vec<Role>,
}

impl Sum<'_> {
    /// Results all over the texture at some times. `image` returns a picture by name.
    fn drawn<'i>(
        &self,
        shader: &Shader,
        times: &[f64],
        mut image: impl FnMut(&str) -> Option<&'i Image>,
    ) -> Vec<LightLinear> {
        let stages = &shader.stages;
        let pictures: Vec<Vec<Option<&Image>>> = stages
            .iter()
            .map(|s| s.image.names().iter().map(|name| image(name)).collect())
            .collect();
        let mut drawn = Vec::with_capacity((GRID * GRID) as usize * times.len());
        let mut samples = Vec::with_capacity(stages.len());
        for &time in times {
            let colors: Vec<Vec4> = stages.iter().map(|stage| self.color(stage, time)).collect();
            let means: Vec<Vec4> = stages
                .iter()
                .zip(&pictures)
                .map(|(stage, pictures)| self.mean_texel(stage, pictures, time))
                .collect();
            for st in grid() {
                samples.clear();
                for (i, stage) in stages.iter().enumerate() {
                    let [color, mean] = [&colors, &means].map(|of| of.get(i).copied());
                    let pictures = pictures.get(i).map_or(&[][..], Vec::as_slice);
                    let texture = texel(stage, pictures, st, time, self.table);
                    let role = self.roles.get(i).copied().unwrap_or(Role::Texture);
                    let seen = (texture, mean.unwrap_or(texture));
                    samples.push(sample(stage, role, seen, color.unwrap_or(Vec4::ONE)));
                }
                drawn.push((self.compose)(stages, &samples, true));
            }
        }
        drawn
    }

    /// Colour of a stage at a time.
    fn color(&self, stage: &Stage, time: f64) -> Vec4 {
        let context = ColorContext {
            time,
            ..ColorContext::default()
        };
        let color = eval::vertex_color(stage, &context, Vec3::ZERO, Vec3::Z, self.corners);
        let [r, g, b, a] = color;
        let number = |byte: u8| self.table[usize::from(byte)];
        Vec4::new(number(r), number(g), number(b), f32::from(a) / 255.0)
    }

    /// Mean of an environment image; not needed for other images.
    fn mean_texel(&self, stage: &Stage, pictures: &[Option<&Image>], time: f64) -> Vec4 {
        if stage.tc_gen != TcGen::Environment {
            return Vec4::ZERO;
        }
        let sum: Vec4 = grid()
            .map(|st| texel(stage, pictures, st, time, self.table))
            .sum();
        sum / (GRID * GRID) as f32
    }
}

/// Positions all over a texture.
fn grid() -> impl Iterator<Item = Vec2> {
    (0..GRID * GRID)
        .map(|cell| Vec2::new((cell % GRID) as f32 + 0.5, (cell / GRID) as f32 + 0.5) / GRID as f32)
}

/// Contribution of a stage at a position: `texture` there, `mean` over its image.
fn sample(stage: &Stage, role: Role, (texture, mean): (Vec4, Vec4), color: Vec4) -> StageSample {
    let shown = StageSample {
        texture,
        color,
        ..StageSample::WHITE
    };
    let own = color.truncate();
    let lit = matches!(
        stage.rgb_gen,
        RgbGen::LightingDiffuse | RgbGen::Vertex | RgbGen::ExactVertex
    );
    match role {
        Role::Texture => shown,
        Role::Nothing => StageSample {
            texture: Vec4::ZERO,
            ..shown
        },
        Role::Mirror => StageSample {
            texture: Vec4::W * mean.w,
            mirrored: mean.truncate() * if lit { Vec3::ONE } else { own },
            ..shown
        },
        Role::Gloss { masked: true } => StageSample {
            texture: (texture.truncate() * own).extend(texture.w),
            mirrored: mean.truncate() * own,
            ..shown
        },
        Role::Gloss { masked: false } => StageSample {
            mirrored: mean.truncate() * if lit { Vec3::ONE } else { own },
            ..shown
        },
    }
}

/// Texel of a stage's image at a position.
fn texel(
    stage: &Stage,
    pictures: &[Option<&Image>],
    st: Vec2,
    time: f64,
    table: &[f32; 256],
) -> Vec4 {
    match stage.image {
        StageImage::White | StageImage::Lightmap => return Vec4::ONE,
        // The content of a cinematic is unknown.
        StageImage::Video(_) => return Vec4::splat(0.5),
        _ => {}
    }
    let Some(picture) = pictures.get(stage.image.frame(time)).copied().flatten() else {
        // The image is missing.
        return Vec4::ZERO;
    };
    let st = eval::apply_tc_mods(&stage.tc_mods, st, Vec3::ZERO, time, Vec2::ZERO);
    let clamp = matches!(stage.image, StageImage::ClampMap(_));
    picture.linear_texel(st, clamp, table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shaderscript::parse_script;

    /// The shades of a material: its picture `e` has a black and a white half, and `a` is grey with holes of a
    /// quarter.
    fn shades_of(body: &str, lighting: ImplicitKind, corners: [u8; 4]) -> Vec<Shade> {
        let script = parse_script("test", format!("t\n{{\n{body}\n}}\n").as_bytes());
        let pixels = |all: &[[u8; 4]]| Image::from_rgba(all.len() as u32, 1, all.concat()).unwrap();
        let halves = pixels(&[[0, 0, 0, 255], [255; 4]]);
        let grey = pixels(&[[128, 128, 128, 191]]);
        shades(&script.shaders[0], lighting, corners, |name| match name {
            "e" => Some(&halves),
            "a" => Some(&grey),
            _ => None,
        })
    }

    /// Means of what is shown, encoded, and of what is mirrored, encoded.
    fn means(shades: &[Shade]) -> (f32, f32) {
        let part = 1.0 / shades.len() as f32;
        let mirrored = |s: &Shade| overbright::from_linear(s.mirrored.x);
        (
            shades.iter().map(|s| s.encoded.x).sum::<f32>() * part,
            shades.iter().map(mirrored).sum::<f32>() * part,
        )
    }

    fn near(found: (f32, f32), meant: (f32, f32)) {
        let off = (found.0 - meant.0).abs().max((found.1 - meant.1).abs());
        assert!(off < 5e-3, "{found:?} {meant:?}");
    }

    const PICTURE: &str = "map e\ntcGen environment";
    const PAINT: &str = "{\nmap a\nblendFunc blend\n}";
    const LIGHT: &str = "{\nmap $lightmap\nblendFunc filter\n}";

    #[test]
    fn metal_shows_light_by_its_picture_and_mirrors_its_mean() {
        let metal = format!("{{\n{PICTURE}\n}}\n{PAINT}\n{LIGHT}");
        let found = shades_of(&metal, ImplicitKind::Lightmapped, [255; 4]);
        near(means(&found), (0.25 * 0.5 + 0.75 * 0.5, 0.25 * 0.5));
        // its halves differ as much as the paint permits
        let ends = [found.first().unwrap(), found.last().unwrap()].map(|s| s.encoded.x);
        assert!((ends[1] - ends[0] - 0.25).abs() < 5e-3, "{ends:?}");
        // what no light reaches is a mirror alone
        let mirror = format!("{PAINT_BODY}\n{{\n{PICTURE}\nblendFunc add\n}}");
        let found = shades_of(&mirror, ImplicitKind::Lightmapped, [255; 4]);
        near(means(&found), (0.0, 0.5));
    }

    const PAINT_BODY: &str = "{\nmap a\n}";

    #[test]
    fn corners_say_where_metal_shows() {
        let metal = format!("{{\n{PICTURE}\nrgbGen vertex\n}}\n{PAINT}\n{LIGHT}");
        let corners = [102, 102, 102, 255];
        let masked = shades_of(&metal, ImplicitKind::Lightmapped, corners);
        near(means(&masked), (0.4 * 0.125 + 0.375, 0.4 * 0.125));
        // where corners are the light there is none besides
        let lit = format!(
            "{{\n{PICTURE}\nrgbGen vertex\n}}\n{{\nmap a\nrgbGen vertex\nblendFunc blend\n}}"
        );
        let found = shades_of(&lit, ImplicitKind::Vertex, corners);
        near(means(&found), (0.5, 0.125));
    }

    #[test]
    fn pictures_that_shade_do_so_as_any_other() {
        let cloth = format!("{PAINT_BODY}\n{{\n{PICTURE}\nblendFunc filter\n}}\n{LIGHT}");
        let found = shades_of(&cloth, ImplicitKind::Lightmapped, [255; 4]);
        near(means(&found), (0.25, 0.0));
    }
}

//! What formats of other programs have no words for, as JSON: whole materials, entities with all their keys.

use crate::materials::finish::{Finish, Glow, NormalMap, SurfaceMap};
use crate::world::{StyleLight, StyleStrength, WorldMaterial};
use glam::{Vec2, Vec3};
use q3bsp::Entity;
use serde_json::{Map, Value, json};
use shaderscript::{
    AlphaGen, Cull, Deform, DepthFunc, RgbGen, Shader, Stage, StageImage, TcGen, TcMod, Wave,
};

/// A material: its flags in the map, the content of its script, and what is stated about its reflection.
pub fn material(material: &WorldMaterial, finish: &Finish) -> Value {
    let shader = &material.resolved.shader;
    let mut out = json!({
        "name": material.name,
        "surfaceFlags": material.surface_flags,
        "contentFlags": material.content_flags,
        "lighting": format!("{:?}", material.lighting),
        "class": format!("{:?}", material.class.class),
        "stages": shader.stages.iter().map(stage).collect::<Vec<_>>(),
    });
    let definition = material.resolved.definition();
    if material.resolved.script.is_some() {
        let place = &definition.location;
        out["script"] = json!(format!("{}:{}", place.file, place.line));
    }
    if !material.baked.styles.is_empty() {
        let style = |style: &StyleLight| {
            json!({
                "strength": style_strength(style.strength),
                "tcMod": style.tc_mods.iter().map(tc_mod).collect::<Vec<_>>(),
            })
        };
        let styles: Vec<_> = material.baked.styles.iter().map(style).collect();
        out["lightStyles"] = json!(styles);
    }
    if let Some(fault) = &material.resolved.fault {
        out["fault"] = json!(fault);
    }
    directives(definition, &mut out);
    let reflection = reflection(finish);
    if !reflection.is_empty() {
        out["reflection"] = json!(reflection);
    }
    out
}

/// What packs and files by hand state about reflection.
fn reflection(finish: &Finish) -> Map<String, Value> {
    let mut map = Map::new();
    let mut put = |key: &str, value: Option<Value>| {
        map.extend(value.map(|value| (key.to_owned(), value)));
    };
    put("roughness", finish.roughness.map(|r| json!(r)));
    put("reflectance", finish.reflectance.map(vector));
    put("metal", finish.metal.map(|m| json!(m)));
    put("mirror", finish.mirror.map(vector));
    let glass = |(index, part)| json!({"index": index, "through": vector(part)});
    put("glass", finish.glass.map(glass));
    let normals = |n: &NormalMap| json!({"image": n.image, "scale": n.scale.to_array()});
    put("normals", finish.normals.as_ref().map(normals));
    let surface = |map: &SurfaceMap| json!(map.to_string());
    put("surface", finish.surface.as_ref().map(surface));
    let glow = |g: &Glow| json!({"image": g.image, "radiance": g.radiance});
    put("glow", finish.glow.as_ref().map(glow));
    put("plain", finish.plain.then_some(Value::Bool(true)));
    map
}

/// Keywords of a script outside its stages, without those at their defaults.
fn directives(shader: &Shader, out: &mut Value) {
    let mut put = |key: &str, value: Value| {
        out[key] = value;
    };
    if !shader.surface_params.is_empty() {
        put("surfaceParams", json!(shader.surface_params));
    }
    if shader.cull != Cull::Front {
        put(
            "cull",
            json!(if shader.cull == Cull::None {
                "none"
            } else {
                "back"
            }),
        );
    }
    if let Some(sort) = shader.sort {
        put("sort", json!(sort));
    }
    if !shader.deforms.is_empty() {
        put(
            "deformVertexes",
            shader.deforms.iter().map(deform).collect(),
        );
    }
    if let Some(sky) = &shader.sky {
        put(
            "skyParms",
            json!({"outer": sky.outer, "cloudHeight": sky.cloud_height, "inner": sky.inner}),
        );
    }
    if let Some(fog) = &shader.fog {
        put(
            "fogParms",
            json!({"color": fog.color.to_array(), "depth": fog.depth}),
        );
    }
    for (set, key) in [
        (shader.polygon_offset, "polygonOffset"),
        (shader.no_mipmaps, "noMipMaps"),
        (shader.no_picmip, "noPicMip"),
        (shader.entity_mergable, "entityMergable"),
        (shader.portal, "portal"),
    ] {
        if set {
            put(key, json!(true));
        }
    }
    if let Some(seconds) = shader.clamp_time {
        put("clampTime", json!(seconds));
    }
    if !shader.unknown.is_empty() {
        let line = |u: &shaderscript::UnknownDirective| {
            let mut words = vec![u.keyword.clone()];
            words.extend(u.arguments.iter().cloned());
            words.join(" ")
        };
        put(
            "directives",
            shader.unknown.iter().map(|u| json!(line(u))).collect(),
        );
    }
}

/// A stage; what is at its default is left out.
fn stage(stage: &Stage) -> Value {
    let mut map = Map::new();
    let mut put = |key: &str, value: Value| {
        map.insert(key.to_owned(), value);
    };
    match &stage.image {
        StageImage::Map(name) => put("map", json!(name)),
        StageImage::ClampMap(name) => put("clampMap", json!(name)),
        StageImage::Animation { frequency, images } => {
            put("animMap", json!({"frequency": frequency, "images": images}));
        }
        StageImage::Video(name) => put("videoMap", json!(name)),
        StageImage::Lightmap => put("map", json!("$lightmap")),
        StageImage::White => put("map", json!("$whiteimage")),
    }
    if let Some((source, destination)) = stage.blend {
        put(
            "blend",
            json!([format!("{source:?}"), format!("{destination:?}")]),
        );
    }
    if let Some(func) = stage.alpha_func {
        put("alphaFunc", json!(format!("{func:?}")));
    }
    if stage.depth_write != stage.blend.is_none() {
        put("depthWrite", json!(stage.depth_write));
    }
    if stage.depth_func != DepthFunc::LessEqual {
        put("depthFunc", json!(format!("{:?}", stage.depth_func)));
    }
    if stage.detail {
        put("detail", json!(true));
    }
    match &stage.rgb_gen {
        RgbGen::IdentityLighting => {}
        RgbGen::Wave(w) => put("rgbGen", json!({"wave": wave(w)})),
        RgbGen::Const(color) => put("rgbGen", json!({"const": color.to_array()})),
        other => put("rgbGen", json!(format!("{other:?}"))),
    }
    match &stage.alpha_gen {
        AlphaGen::Identity => {}
        AlphaGen::Wave(w) => put("alphaGen", json!({"wave": wave(w)})),
        AlphaGen::Const(alpha) => put("alphaGen", json!({"const": alpha})),
        AlphaGen::Portal { range } => put("alphaGen", json!({"portal": range})),
        other => put("alphaGen", json!(format!("{other:?}"))),
    }
    match &stage.tc_gen {
        TcGen::Base => {}
        TcGen::Vector(s, t) => put("tcGen", json!({"vector": [s.to_array(), t.to_array()]})),
        other => put("tcGen", json!(format!("{other:?}"))),
    }
    if !stage.tc_mods.is_empty() {
        put("tcMod", stage.tc_mods.iter().map(tc_mod).collect());
    }
    Value::Object(map)
}

fn wave(wave: &Wave) -> Value {
    json!({
        "function": format!("{:?}", wave.function),
        "base": wave.base,
        "amplitude": wave.amplitude,
        "phase": wave.phase,
        "frequency": wave.frequency,
    })
}

/// How strong the light of a style is: a number, or a wave.
pub fn style_strength(strength: StyleStrength) -> Value {
    match strength {
        StyleStrength::Steady(factor) => json!(factor),
        StyleStrength::Wave(w) => json!({"wave": wave(&w)}),
    }
}

fn tc_mod(tc_mod: &TcMod) -> Value {
    let pair = |v: &Vec2| json!(v.to_array());
    match tc_mod {
        TcMod::Turbulent {
            base,
            amplitude,
            phase,
            frequency,
        } => {
            json!({"turb": {"base": base, "amplitude": amplitude, "phase": phase, "frequency": frequency}})
        }
        TcMod::Scale(scale) => json!({"scale": pair(scale)}),
        TcMod::Scroll(speed) => json!({"scroll": pair(speed)}),
        TcMod::Stretch(w) => json!({"stretch": wave(w)}),
        TcMod::Transform { matrix, translate } => {
            json!({"transform": {"matrix": matrix, "translate": pair(translate)}})
        }
        TcMod::Rotate(degrees) => json!({"rotate": degrees}),
        TcMod::EntityTranslate => json!("entityTranslate"),
    }
}

fn deform(deform: &Deform) -> Value {
    match deform {
        Deform::Wave { spread, wave: w } => json!({"wave": {"spread": spread, "wave": wave(w)}}),
        Deform::Normal {
            amplitude,
            frequency,
        } => json!({"normal": {"amplitude": amplitude, "frequency": frequency}}),
        Deform::Bulge {
            width,
            height,
            speed,
        } => json!({"bulge": {"width": width, "height": height, "speed": speed}}),
        Deform::Move { direction, wave: w } => {
            json!({"move": {"direction": direction.to_array(), "wave": wave(w)}})
        }
        Deform::AutoSprite => json!("autoSprite"),
        Deform::AutoSprite2 => json!("autoSprite2"),
        Deform::ProjectionShadow => json!("projectionShadow"),
        Deform::Text(number) => json!({"text": number}),
    }
}

/// An entity's keys. Of keys that occur twice, which JSON has no words for, the first value stands under the key, as the
/// game looks them up, and all pairs in order under `_pairs`.
pub fn entity(entity: &Entity) -> Value {
    let mut map = Map::new();
    let mut repeated = false;
    for (key, value) in &entity.pairs {
        if map.contains_key(key) {
            repeated = true;
        } else {
            map.insert(key.clone(), json!(value));
        }
    }
    if repeated {
        map.insert("_pairs".into(), json!(entity.pairs));
    }
    Value::Object(map)
}

/// Three numbers.
pub fn vector(v: Vec3) -> Value {
    json!(v.to_array())
}

//! Models of every kind: key frames, bones, joints; their skins, levels of detail, tags and bounds.

mod answers;
mod placed;

use glam::Vec3;

use super::board::{Board, MAP};
use super::{File, Scene, Stage, scene_list, tube};
use crate::engine::abi::refEntity_t;
use crate::engine::{Raised, View};

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "models-kinds": "A tube as MD3, MDR, compressed MDR and IQM, in frames and between them.",
            calls(kinds), files: files, quick: true;
        "models-odd": "An IQM without poses, and one whose joints are bound unevenly.", calls(odd), files: files;
        "models-surfaces": "Skins, skin numbers, the entity's own shader, colours of vertices, on every kind of model.",
            calls(surfaces), files: files;
        "models-frames": "Frames that do not exist, wrapped ones, axes that are not of length 1 or not square.",
            calls(frames), files: files;
        "models-lods": "Levels of detail by distance, by r_lodbias and r_lodscale.", calls(levels), files: files;
        "models-volumes": "Stencil shadows of every kind of model, and of those that ask for none.",
            calls(placed::shadows), files: files, cvars: &[("cg_shadows", "2"), ("r_stencilbits", "8")];
        "models-planes": "Planar shadows of every kind of model, seen or not.",
            calls(placed::shadows), files: files, cvars: &[("cg_shadows", "3")];
        "models-player": "A player of the game put together by tags, in a map and in a view without one.",
            calls(placed::player), files: files, packs: true;
        "models-answers": "Tags between frames and bounds of every kind of model.",
            calls(answers::answers), files: files, quick: true;
    }
}

/// Every kind of model under the name that its file has.
pub(super) const KINDS: [&str; 5] = [
    "m/key.md3",
    "m/bone.mdr",
    "m/small.mdr",
    "m/joint.iqm",
    "m/stretch.iqm",
];

const SCRIPT: &str = "
tube/upper
{
    {
        map g/env.tga
        rgbGen lightingDiffuse
    }
}
projectionShadow
{
    polygonOffset
    deformVertexes projectionShadow
    {
        map g/black.tga
        blendFunc blend
        rgbGen const ( 0 0 0 )
        alphaGen const 0.5
    }
}
tube/vertex
{
    cull none
    {
        map g/base.tga
        rgbGen exactVertex
    }
}
tube/glow
{
    {
        map g/env.tga
        tcGen environment
        rgbGen entity
    }
}
";

fn board() -> Board {
    Board::empty(SCRIPT)
}

fn files() -> Vec<File> {
    let mut files = board().files();
    files.extend(model_files());
    files
}

/// The models and their skins.
pub(super) fn model_files() -> Vec<File> {
    let own = [
        ("m/key.md3", tube::md3(2)),
        ("m/key_1.md3", tube::md3(1)),
        ("m/bone.mdr", tube::mdr(false)),
        ("m/small.mdr", tube::mdr(true)),
        ("m/joint.iqm", tube::iqm(false)),
        ("m/stretch.iqm", tube::iqm(true)),
        ("m/rigid.iqm", tube::rigid_iqm()),
        ("m/skewed.iqm", tube::skewed_iqm()),
        ("m/broken.iqm", b"INTERQUAKEMODEL\0 and no more".to_vec()),
        ("m/broken.md3", tube::md3(2)),
        ("m/skin.skin", b"upper,g/base\nLOWER,tube/glow\n".to_vec()),
        ("m/half.skin", b"upper,g/env\n".to_vec()),
    ];
    own.map(|(name, bytes)| (name.to_string(), bytes)).to_vec()
}

/// A row of models, the first at the left.
fn row(at: usize, of: usize) -> Vec3 {
    Vec3::new(0.0, (of as f32 / 2.0 - 0.5 - at as f32) * 44.0, 0.0)
}

fn place(entity: &mut refEntity_t, at: Vec3) {
    entity.origin = at.to_array();
}

/// Axes turned about z by `yaw` degrees.
pub(super) fn turned(yaw: f32) -> [[f32; 3]; 3] {
    let (s, c) = yaw.to_radians().sin_cos();
    [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]
}

/// Keeps a row of models of the kinds that are `shown`, as entities like `entity`.
fn keep_kinds(
    stage: &mut Stage,
    name: &str,
    view: &View,
    entity: refEntity_t,
    shown: impl Fn(&str) -> bool,
) -> Result<(), Raised> {
    let mut all = Vec::new();
    for (at, kind) in KINDS.into_iter().enumerate() {
        if shown(kind) {
            all.push(refEntity_t {
                hModel: stage.register_model(kind)?,
                origin: row(at, KINDS.len()).to_array(),
                ..entity
            });
        }
    }
    stage.keep_entities(name, view, &all)
}

fn kinds(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    for (name, frame, oldframe, backlerp) in [
        ("first", 0, 0, 0.0),
        ("bent", 1, 1, 0.7),
        ("twisted", 2, 2, 0.0),
        ("between", 1, 0, 0.4),
        ("back", 1, 2, 0.75),
    ] {
        let entity = refEntity_t {
            frame,
            oldframe,
            backlerp,
            axis: turned(25.0),
            ..refEntity_t::default()
        };
        keep_kinds(stage, name, &view, entity, |_| true)?;
    }
    Ok(())
}

/// Models that no other kind has the like of: without poses, and bound in a way that cannot be undone.
fn odd(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let mut all = Vec::new();
    let models = ["rigid", "skewed", "skewed", "skewed"];
    for (at, (name, frame)) in models.into_iter().zip([1, 0, 1, 2]).enumerate() {
        let mut entity = refEntity_t {
            hModel: stage.register_model(&format!("m/{name}.iqm"))?,
            frame,
            oldframe: frame / 2,
            backlerp: 0.4,
            axis: turned(25.0),
            ..refEntity_t::default()
        };
        place(&mut entity, row(at, models.len()));
        all.push(entity);
    }
    stage.keep_entities("row", &view, &all)
}

fn surfaces(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let plain = refEntity_t {
        frame: 1,
        oldframe: 1,
        axis: turned(25.0),
        shaderRGBA: [255, 160, 80, 200],
        ..refEntity_t::default()
    };
    let skin = stage.register_skin("m/skin.skin")?;
    let half = stage.register_skin("m/half.skin")?;
    let single = stage.register_skin("g/env")?;
    let missing = stage.register_skin("m/none.skin")?;
    let vertex = stage.register_shader("tube/vertex")?;
    stage.fact(
        "skins",
        format!("{} {} {} {missing}", skin > 0, half > 0, single > 0),
    );
    let skinned = |skin, number, shader| refEntity_t {
        customSkin: skin,
        skinNum: number,
        customShader: shader,
        ..plain
    };
    let variants = [
        ("skin", skinned(skin, 0, 0)),
        ("half", skinned(half, 0, 0)),
        ("single", skinned(single, 0, 0)),
        ("bad-skin", skinned(999, 0, 0)),
        ("number1", skinned(0, 1, 0)),
        ("number5", skinned(0, 5, 0)),
        ("shader", skinned(skin, 0, vertex)),
        ("bad-shader", skinned(0, 0, 99_999)),
    ];
    for (name, variant) in variants {
        // vertices of the other kinds have what colours the reference drew last
        let shown = |kind: &str| name != "shader" || kind.ends_with("iqm");
        keep_kinds(stage, name, &view, variant, shown)?;
    }
    Ok(())
}

fn frames(stage: &mut Stage) -> Result<(), Raised> {
    const WRAP_FRAMES: i32 = 0x200;
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-110.0, 0.0, 10.0), 0.0);
    let plain = refEntity_t {
        axis: turned(25.0),
        ..refEntity_t::default()
    };
    let framed = |frame, oldframe, renderfx| refEntity_t {
        frame,
        oldframe,
        backlerp: 0.25,
        renderfx,
        ..plain
    };
    let scaled = |scale: [f32; 3], announced, number| refEntity_t {
        axis: std::array::from_fn(|i| plain.axis[i].map(|v| v * scale[i])),
        nonNormalizedAxes: announced,
        skinNum: number,
        ..plain
    };
    let variants = [
        ("beyond", framed(7, 1, 0)),
        ("beyond-old", framed(1, 3, 0)),
        ("wrapped", framed(7, 5, WRAP_FRAMES)),
        ("scaled", scaled([1.3, 1.3, 1.3], 1, 2)),
        ("squeezed", scaled([1.0, 0.5, 1.2], 1, 2)),
        ("unannounced", scaled([1.4, 1.4, 0.8], 0, 2)),
        ("mirrored", scaled([1.0, -1.0, 1.0], 0, 0)),
        ("flat", scaled([0.0, 1.0, 1.0], 1, 0)),
    ];
    for (name, variant) in variants {
        keep_kinds(stage, name, &view, variant, |_| true)?;
    }
    Ok(())
}

fn levels(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let view = stage.view(Vec3::new(-280.0, 0.0, 0.0), 0.0);
    let models = [
        stage.register_model("m/key.md3")?,
        stage.register_model("m/bone.mdr")?,
    ];
    for (name, bias, scale) in [
        ("plain", "0", "5"),
        ("mixed", "0", "2"),
        ("coarser", "1", "5"),
        ("finer", "-1", "0"),
        ("coarse", "0", "0"),
        ("fine", "0", "20"),
    ] {
        stage.set("r_lodbias", bias);
        stage.set("r_lodscale", scale);
        stage.keep_view(name, &view, |e| {
            for (side, model) in models.into_iter().enumerate() {
                for step in 0..5u8 {
                    let step = f32::from(step);
                    let mut entity = refEntity_t {
                        hModel: model,
                        axis: turned(30.0),
                        ..refEntity_t::default()
                    };
                    let left = if side == 0 { 1.0 } else { -1.0 };
                    let distance = 50.0 + step * 60.0;
                    let y = left * distance * (0.85 - step * 0.17);
                    place(&mut entity, Vec3::new(distance - 280.0, y, 0.0));
                    e.add_entity(&entity)?;
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

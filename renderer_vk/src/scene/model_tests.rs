//! Models with skeletons in gathered views.

use glam::{Quat, Vec2, Vec3, Vec4};
use q3model::{
    BoneMatrix, Frame, Iqm, IqmJoint, IqmPose, IqmSurface, IqmVertex, Mdr, MdrSurface, MdrTag,
    MdrVertex, MdrWeight,
};

use super::{ClassicScene, Scene, TracedScene, ViewScene};
use crate::api::{RefDef, RefEntity, rdflags, renderfx};
use crate::test_support::{PIXEL, Registration};

fn moved(x: f32) -> BoneMatrix {
    BoneMatrix {
        rows: [Vec4::new(1.0, 0.0, 0.0, x), Vec4::Y, Vec4::Z],
    }
}

/// A triangle on a bone that moves 16 units from frame to frame, in two levels of detail.
fn mdr() -> Mdr {
    let frame = |x: f32| Frame {
        mins: Vec3::new(x - 8.0, -8.0, -8.0),
        maxs: Vec3::new(x + 8.0, 8.0, 8.0),
        local_origin: Vec3::X * x,
        radius: 14.0,
        name: String::new(),
    };
    let surface = |name: &str, size: f32| MdrSurface {
        name: name.into(),
        shader: "t/wall".into(),
        triangles: vec![[0, 1, 2]],
        vertices: (0..3)
            .map(|first_weight| MdrVertex {
                normal: -Vec3::X,
                st: Vec2::ONE,
                first_weight,
                num_weights: 1,
            })
            .collect(),
        weights: [Vec3::ZERO, Vec3::Y, Vec3::Z]
            .map(|at| MdrWeight {
                bone: 0,
                weight: 1.0,
                offset: at * size,
            })
            .to_vec(),
    };
    Mdr {
        name: "m".into(),
        frames: vec![frame(0.0), frame(16.0)],
        bones: vec![moved(0.0), moved(16.0)],
        num_bones: 1,
        lods: vec![
            vec![surface("body", 8.0), surface("hat", 4.0)],
            vec![surface("body", 7.0)],
        ],
        tags: vec![MdrTag {
            name: "tag_top".into(),
            bone: 0,
        }],
    }
}

/// A triangle on a joint that turns a quarter about z between its two frames.
fn iqm(bounds: bool) -> Iqm {
    let pose = |turn: f32| IqmPose {
        translate: Vec3::ZERO,
        rotate: Quat::from_rotation_z(turn),
        scale: Vec3::ONE,
    };
    let vertex = |position| IqmVertex {
        position,
        normal: Vec3::X,
        st: Vec2::ONE,
        color: [10, 20, 30, 40],
        joints: [0; 4],
        weights: [1.0, 0.0, 0.0, 0.0],
    };
    let mut model = Iqm {
        surfaces: vec![IqmSurface {
            name: "body".into(),
            material: "t/wall".into(),
            first_vertex: 0,
            num_vertices: 3,
            triangles: vec![[0, 1, 2]],
        }],
        vertices: [Vec3::X, Vec3::Y, Vec3::Z]
            .map(|p| vertex(p * 8.0))
            .to_vec(),
        joints: vec![IqmJoint {
            name: "root".into(),
            parent: None,
            pose: pose(0.0),
        }],
        ..Iqm::default()
    };
    model.set_frames(&[vec![pose(0.0)], vec![pose(std::f32::consts::FRAC_PI_2)]]);
    if bounds {
        model.bounds = vec![(Vec3::splat(-10.0), Vec3::splat(10.0)); 2];
    }
    model
}

fn game() -> Registration {
    let (small, large) = (mdr().write(true), mdr().write(false));
    let (iqm, free) = (iqm(true).write(), iqm(false).write());
    Registration::from_entries(&[
        ("t/wall.tga", PIXEL),
        ("t/red.tga", PIXEL),
        ("t/a.skin", b"body,t/red\n"),
        ("m/large.mdr", &large),
        ("m/small.mdr", &small),
        ("m/a.iqm", &iqm),
        ("m/free.iqm", &free),
        ("m/broken.md3", b"IDP3 and nothing else"),
        ("m/broken.mdr", &large),
        ("m/both.mdr", &large),
        ("m/both.iqm", &iqm),
        ("m/odd.name.iqm", &iqm),
    ])
}

fn def() -> RefDef {
    RefDef {
        fov_x: 90.0,
        fov_y: 90.0,
        view_origin: Vec3::new(-100.0, 0.0, 0.0),
        flags: rdflags::NO_WORLD_MODEL,
        ..RefDef::default()
    }
}

fn at(model: i32, frame: i32, old_frame: i32, backlerp: f32) -> RefEntity {
    RefEntity {
        model,
        frame,
        old_frame,
        backlerp,
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
        shader_rgba: [255; 4],
        ..RefEntity::default()
    }
}

fn gather(game: &Registration, entity: &RefEntity) -> ClassicScene {
    let mut scene = Scene::default();
    scene.add_entity(entity);
    let mut views = scene.gather_classic(&game.input(None), &def()).unwrap();
    views.pop().unwrap()
}

fn gather_traced(game: &Registration, entity: &RefEntity) -> TracedScene {
    let mut scene = Scene::default();
    scene.add_entity(entity);
    scene.gather_traced(&game.input(None), &def()).unwrap()
}

fn places(view: &ViewScene) -> Vec<Vec3> {
    view.vertices.iter().map(|v| v.position).collect()
}

#[test]
fn bones_move_vertices() {
    let mut game = game();
    for name in ["m/large.mdr", "m/small.mdr"] {
        let model = game.model(name);
        let between = at(model, 1, 0, 0.25);
        let (view, traced) = (gather(&game, &between), gather_traced(&game, &between));
        assert_eq!(view.look.surfaces.len(), 2, "{name}");
        for (meshes, found) in [
            (&view.meshes, places(&view)),
            (&traced.meshes, places(&traced)),
        ] {
            assert_eq!(meshes.len(), 2, "{name}");
            let expected = [Vec3::X * 12.0, Vec3::new(12.0, 8.0, 0.0)];
            for (found, expected) in found.iter().zip(expected) {
                assert!(found.abs_diff_eq(expected, 1e-3), "{name}: {found}");
            }
        }
        // out of range: both frames are the first
        let view = gather(&game, &at(model, 1, 2, 0.25));
        assert!(places(&view)[0].abs_diff_eq(Vec3::ZERO, 1e-3), "{name}");
        let wrapped = RefEntity {
            renderfx: renderfx::WRAP_FRAMES,
            ..at(model, 3, 3, 0.0)
        };
        let view = gather(&game, &wrapped);
        assert!(places(&view)[0].abs_diff_eq(Vec3::X * 16.0, 1e-3), "{name}");
    }
}

#[test]
fn far_models_have_their_coarser_level() {
    let mut game = game();
    let model = game.model("m/large.mdr");
    let near = gather(&game, &at(model, 0, 0, 0.0));
    let away = RefEntity {
        origin: Vec3::X * 1000.0,
        ..at(model, 0, 0, 0.0)
    };
    let far = gather(&game, &away);
    assert_eq!((near.meshes.len(), far.meshes.len()), (2, 1));
    assert_eq!(far.vertices[1].position, Vec3::Y * 7.0);
}

#[test]
fn joints_turn_vertices_and_normals() {
    let mut game = game();
    for name in ["m/a.iqm", "m/free.iqm"] {
        let model = game.model(name);
        let view = gather(&game, &at(model, 1, 1, 0.0));
        let vertex = view.vertices[0];
        assert!(vertex.position.abs_diff_eq(Vec3::Y * 8.0, 1e-3));
        assert!(vertex.normal.abs_diff_eq(Vec3::Y, 1e-3));
        assert_eq!(vertex.color.to_le_bytes(), [10, 20, 30, 40]);
        // halfway between the frames
        let view = gather_traced(&game, &at(model, 1, 0, 0.5));
        let eighth = std::f32::consts::FRAC_PI_4;
        let expected = Vec3::new(eighth.cos(), eighth.sin(), 0.0) * 8.0;
        assert!(view.vertices[0].position.abs_diff_eq(expected, 1e-3));
    }
    // culled by its bounds; a model without bounds is always drawn
    let behind = |model| RefEntity {
        origin: Vec3::X * -500.0,
        ..at(model, 0, 0, 0.0)
    };
    let (bounded, free) = (game.model("m/a.iqm"), game.model("m/free.iqm"));
    assert!(gather(&game, &behind(bounded)).meshes.is_empty());
    assert_eq!(gather(&game, &behind(free)).meshes.len(), 1);
}

#[test]
fn skins_and_shaders_count_for_every_kind() {
    let mut game = game();
    let wall = gather(&game, &at(0, 0, 0, 0.0)).meshes[0].material;
    let skin = game.skins.register(
        &*game.files,
        &mut game.materials,
        &mut game.textures,
        "t/a.skin",
    );
    let custom = game.materials.find(
        &mut game.textures,
        "t/red",
        crate::assets::LightmapClass::TwoD,
        true,
    );
    for name in ["m/large.mdr", "m/a.iqm"] {
        let model = game.model(name);
        let plain = at(model, 0, 0, 0.0);
        let material = |entity: &RefEntity, mesh: usize| {
            let view = gather(&game, entity);
            view.meshes.get(mesh).map(|mesh| mesh.material)
        };
        let own = material(&plain, 0).unwrap();
        assert_ne!(own, wall);
        assert_eq!(game.materials.get(own).name, "t/wall");
        // one material for each surface, whatever the number
        let numbered = RefEntity {
            skin_num: 7,
            ..plain
        };
        assert_eq!(material(&numbered, 0), Some(own));
        let skinned = RefEntity {
            custom_skin: skin,
            ..plain
        };
        let red = material(&skinned, 0).unwrap();
        assert_eq!(game.materials.get(red).name, "t/red");
        // a surface that the skin omits has the default material
        if name.ends_with("mdr") {
            assert_eq!(material(&skinned, 1), Some(0));
        }
        let shaded = RefEntity {
            custom_shader: i32::try_from(custom).unwrap(),
            ..skinned
        };
        assert_eq!(material(&shaded, 0), Some(custom));
    }
}

#[test]
fn tags_and_bounds_are_told_of_every_kind() {
    let mut game = game();
    let (mdr, iqm) = (game.model("m/large.mdr"), game.model("m/a.iqm"));
    let free = game.model("m/free.iqm");
    let tag = game.models.lerp_tag(mdr, 0, 1, 0.25, "tag_top").unwrap();
    assert_eq!(tag.origin, Vec3::X * 4.0);
    let tag = game.models.lerp_tag(iqm, 0, 1, 1.0, "root").unwrap();
    assert!(tag.axis[0].abs_diff_eq(Vec3::Y, 1e-3));
    assert_eq!(game.models.lerp_tag(iqm, 0, 1, 1.0, "tag_top"), None);
    let mins = |model| game.models.bounds(model).0;
    assert_eq!(mins(mdr), Vec3::splat(-8.0));
    assert_eq!(mins(iqm), Vec3::splat(-10.0));
    assert_eq!(game.models.bounds(free), (Vec3::ZERO, Vec3::ZERO));
    let list = game.models.list();
    let names: Vec<_> = list
        .iter()
        .filter_map(|line| line.split_once(" : "))
        .collect();
    assert_eq!(names[0].1, "(1) m/large.mdr");
    assert_eq!(names[1].1, "(1) m/a.iqm");
    let size = |line: &(&str, &str)| line.0.trim().parse::<usize>().unwrap();
    let (total, models) = names.split_last().unwrap();
    assert_eq!(total.1, "Total models");
    assert_eq!(size(total), models.iter().map(size).sum::<usize>());
    assert!(size(&models[0]) > 0);
}

#[test]
fn other_kinds_of_model_are_tried_under_the_name() {
    let mut game = game();
    let mut kind = |name: &str| {
        let handle = game.model(name);
        game.models.get(handle).map(|model| match model {
            crate::assets::Model::Mdr(_) => "mdr",
            crate::assets::Model::Iqm(_) => "iqm",
            _ => "other",
        })
    };
    assert_eq!(kind("m/large.MDR"), Some("mdr"), "in any case");
    assert_eq!(kind("m/large"), Some("mdr"));
    assert_eq!(kind("m/large.md3"), Some("mdr"), "missing");
    assert_eq!(kind("m/broken.md3"), Some("mdr"), "broken");
    assert_eq!(kind("m/both"), Some("iqm"), "the first of its kinds");
    assert_eq!(kind("m/both.md3"), Some("iqm"));
    assert_eq!(kind("m/both.mdr"), Some("mdr"));
    // an extension without a reader is a part of the name
    assert_eq!(kind("m/odd.name"), Some("iqm"));
    assert_eq!(kind("m/both.xyz"), None);
    assert_eq!(kind("m/none.mdr"), None);
}

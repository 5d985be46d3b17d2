//! Invalid scenes.

use super::{check_ranges, check_surfaces, def, entity, game, gather, room};
use crate::Error;
use crate::api::{DynamicLight, EntityKind, PolyVert, RefDef, RefEntity};
use crate::scene::Scene;
use glam::Vec3;
use testkit::Random;

#[test]
fn bad_entities_do_no_harm() {
    let mut game = game();
    let world = room(&mut game);
    let mut scene = Scene::default();
    scene.add_entity(&RefEntity {
        origin: Vec3::new(f32::NAN, 0.0, 0.0),
        ..entity(EntityKind::Model)
    });
    let kinds = [
        EntityKind::Model,
        EntityKind::Sprite,
        EntityKind::Beam,
        EntityKind::RailCore,
        EntityKind::RailRings,
        EntityKind::Lightning,
        EntityKind::PortalSurface,
    ];
    for kind in kinds {
        for value in [f32::NAN, f32::INFINITY, 0.0, 1e38] {
            scene.add_entity(&RefEntity {
                axis: [Vec3::splat(value); 3],
                old_origin: Vec3::splat(value),
                model: i32::MIN,
                custom_shader: -1,
                custom_skin: i32::MAX,
                shader_time: value,
                ..entity(kind)
            });
        }
    }
    scene.add_light(DynamicLight {
        radius: -1.0,
        ..DynamicLight::default()
    });
    let views = scene
        .gather_classic(&game.input(Some(&world)), &def())
        .unwrap();
    assert!(views[0].dlights.is_empty());
    // handle 0 draws axes
    scene.add_entity(&entity(EntityKind::Model));
    let views = gather(&mut scene, &game, Some(&world), &def());
    let axes = game.materials.internal().axes;
    assert!(views[0].meshes.iter().any(|m| m.material == axes));
    scene.add_entity(&entity(EntityKind::Poly));
    let failed = scene.gather_classic(&game.input(None), &def());
    assert!(matches!(failed, Err(Error::EntityKind { .. })));
}

/// Random numbers, often extreme ones.
struct Numbers(Random);

impl Numbers {
    fn next(&mut self) -> u32 {
        self.0.bits()
    }

    fn float(&mut self) -> f32 {
        match self.next() % 8 {
            0 => f32::from_bits(self.next()),
            1 => 0.0,
            2 => f32::NAN,
            _ => (self.next() % 2048) as f32 - 1024.0,
        }
    }

    fn vec(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }

    fn int(&mut self) -> i32 {
        match self.next() % 4 {
            0 => self.next() as i32,
            1 => -1,
            _ => (self.next() % 32) as i32,
        }
    }
}

#[test]
fn random_scenes_stay_within_their_arrays() {
    let mut game = game();
    let world = room(&mut game);
    game.model("m/thing.md3");
    game.settings.shadows = crate::settings::ModelShadows::Planar;
    let mut numbers = Numbers(Random::new(1));
    let mut scene = Scene::default();
    for round in 0..200 {
        for _ in 0..20 {
            let kinds = [
                EntityKind::Model,
                EntityKind::Model,
                EntityKind::Sprite,
                EntityKind::Beam,
                EntityKind::RailCore,
                EntityKind::Lightning,
                EntityKind::PortalSurface,
            ];
            scene.add_entity(&RefEntity {
                kind: kinds[numbers.next() as usize % kinds.len()],
                renderfx: numbers.next(),
                model: numbers.int(),
                lighting_origin: numbers.vec(),
                shadow_plane: numbers.float(),
                axis: [numbers.vec(), numbers.vec(), numbers.vec()],
                non_normalized_axes: numbers.next().is_multiple_of(2),
                origin: numbers.vec(),
                frame: numbers.int(),
                old_origin: numbers.vec(),
                old_frame: numbers.int(),
                backlerp: numbers.float(),
                skin_num: numbers.int(),
                custom_skin: numbers.int(),
                custom_shader: numbers.int(),
                radius: numbers.float(),
                rotation: numbers.float(),
                shader_time: numbers.float(),
                ..RefEntity::default()
            });
            scene.add_light(DynamicLight {
                origin: numbers.vec(),
                radius: numbers.float(),
                color: numbers.vec(),
                ..DynamicLight::default()
            });
            let corner = PolyVert {
                position: numbers.vec(),
                ..PolyVert::default()
            };
            let corners = vec![corner; numbers.next() as usize % 9];
            scene.add_poly(numbers.int(), &corners, numbers.next() as usize % 7);
        }
        let def = RefDef {
            view_origin: numbers.vec(),
            view_axis: [numbers.vec(), numbers.vec(), numbers.vec()],
            fov_x: numbers.float(),
            fov_y: numbers.float(),
            time_ms: numbers.int(),
            flags: u32::from(round % 5 == 0),
            ..RefDef::default()
        };
        let input = game.input(Some(&world));
        if round % 2 == 0 {
            let views = scene.gather_classic(&input, &def).unwrap();
            for view in &views {
                check_ranges(view);
                check_surfaces(view, Some(&world));
            }
            scene.recycle_classic(views);
        } else {
            let view = scene.gather_traced(&input, &def).unwrap();
            check_ranges(&view);
            scene.recycle_traced(view);
        }
    }
}

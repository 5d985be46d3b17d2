//! Effects of views: flares, stereo, shadows in mirrors.

use glam::Vec3;
use q3bsp::builder::MapBuilder;

use super::board::{Board, MAP, screen};
use super::{File, Scene, Stage, entities, scene_list, tube};
use crate::engine::Raised;
use crate::engine::abi::refEntity_t;

const DEPTH_HACK: i32 = 0x8;
const CROSSHAIR: i32 = 0x10;
const NO_WORLD: i32 = 1;

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "effects-flares": "Flares that appear, stay, are hidden and go, straight on and aside.",
            calls(flares), files: files, cvars: &[("r_flares", "1")], quick: true;
        "effects-flares-grey": "The same with half the colour.",
            calls(flares), files: files, cvars: &[("r_flares", "1"), ("r_greyscale", "0.5")];
        "effects-clear": "What r_clear and r_fastsky clear before views of a part of the window.",
            calls(cleared), files: files, quick: true;
        "effects-eyes": "Each anaglyph mode, the eyes' distance and where their pictures meet.",
            calls(eyes), files: files, quick: true;
        "effects-gamma": "r_gamma by the display's ramp, grey and brighter textures, stored light shifted further.",
            calls(bright), files: files,
            cvars: &[("r_gamma", "1.5"), ("r_intensity", "1.6"), ("r_greyscale", "0.5"), ("r_mapOverBrightBits", "3")];
        "effects-software-gamma": "r_gamma in textures alone; all grey.",
            calls(bright), files: files,
            cvars: &[("r_ignorehwgamma", "1"), ("r_gamma", "1.8"), ("r_greyscale", "1"), ("r_mapOverBrightBits", "1")];
        "effects-dark-gamma": "A darker r_gamma in textures, overbright bits without effect in a window.",
            calls(bright), files: files,
            cvars: &[("r_ignorehwgamma", "1"), ("r_gamma", "0.7"), ("r_intensity", "2"), ("r_overBrightBits", "2")];
        "effects-mirror": "Stencil shadows and flares in a mirror.",
            calls(mirror), files: mirror_files,
            cvars: &[("cg_shadows", "2"), ("r_stencilbits", "8"), ("r_flares", "1")];
    }
}

const SCRIPT: &str = "
flareShader
{
    {
        map g/grey.tga
        blendFunc add
        rgbGen vertex
    }
}
e/solid
{
    {
        map g/grey.tga
        rgbGen lightingDiffuse
    }
}
e/mirror
{
    portal
    {
        map g/grey.tga
        blendFunc GL_DST_COLOR GL_ZERO
        depthWrite
    }
}
";

fn board() -> Board {
    Board::empty(SCRIPT)
}

/// The board's room with flares, one of them turned away.
fn map() -> MapBuilder {
    let mut map = board().map();
    let lamp = map.add_shader("e/lamp", 0, 0);
    let orange = Vec3::new(1.0, 0.5, 0.1);
    let blue = Vec3::new(0.2, 0.4, 1.0);
    map.add_flare(lamp, Vec3::new(30.0, 60.0, 30.0), Vec3::NEG_X, Vec3::ONE);
    map.add_flare(lamp, Vec3::new(20.0, -50.0, 20.0), Vec3::ZERO, orange);
    map.add_flare(lamp, Vec3::new(0.0, 10.0, 60.0), Vec3::NEG_Z, blue);
    map.add_flare(lamp, Vec3::new(10.0, 30.0, 10.0), Vec3::X, Vec3::ONE);
    map
}

fn with_models(mut files: Vec<File>) -> Vec<File> {
    files.push(("m/key.md3".to_string(), tube::md3(2)));
    files
}

fn files() -> Vec<File> {
    with_models(board().files_with(map()))
}

fn mirror_files() -> Vec<File> {
    let mut map = map();
    let mirror = map.add_shader("e/mirror", 0, 1);
    map.add_quad(mirror, screen(Vec3::X * 36.0, 64.0, 64.0));
    with_models(board().files_with(map))
}

fn tube_at(stage: &mut Stage, at: Vec3) -> Result<refEntity_t, Raised> {
    let mut tube = entities::tube_at(stage, at)?;
    tube.customShader = stage.register_shader("e/solid")?;
    Ok(tube)
}

fn flares(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let blind = tube_at(stage, Vec3::new(-60.0, 22.0, 20.0))?;
    let look = |stage: &mut Stage, name: &str, time: i32, yaw: f32, hidden: bool| {
        stage.set_time(time);
        let view = stage.view(Vec3::new(-130.0, 0.0, 10.0), yaw);
        stage.keep_once(name, |e| {
            e.clear_scene()?;
            if hidden {
                e.add_entity(&blind)?;
            }
            e.render_scene(&view)
        })
    };
    look(stage, "begins", 0, 0.0, false)?;
    look(stage, "appears", 60, 0.0, false)?;
    look(stage, "shows", 400, 0.0, false)?;
    look(stage, "aside", 450, 25.0, false)?;
    look(stage, "goes", 500, 0.0, true)?;
    look(stage, "is-going", 560, 0.0, true)?;
    look(stage, "is-gone", 1500, 0.0, true)?;
    stage.set("r_flareSize", "90");
    stage.set("r_flareCoeff", "900");
    look(stage, "set", 1600, 0.0, false)?;
    look(stage, "is-set", 2600, 0.0, false)
}

fn eyes(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let far = tube_at(stage, Vec3::new(0.0, 20.0, 10.0))?;
    let near = tube_at(stage, Vec3::new(-110.0, -8.0, -4.0))?;
    let weapon = refEntity_t {
        renderfx: DEPTH_HACK,
        ..near
    };
    let crosshair = refEntity_t {
        renderfx: DEPTH_HACK | CROSSHAIR,
        origin: [-60.0, 0.0, 10.0],
        ..near
    };
    let white = stage.register_shader("white")?;
    let other = stage.register_shader("gfx/2d/bigchars")?;
    let view = stage.view(Vec3::new(-130.0, 0.0, 10.0), 5.0);
    let look = |stage: &mut Stage, name: &str| {
        let draw = |e: &mut crate::engine::Engine| {
            e.clear_scene()?;
            for entity in [&far, &weapon, &crosshair] {
                e.add_entity(entity)?;
            }
            e.render_scene(&view)?;
            e.draw_stretch_pic([20.0, 20.0, 60.0, 40.0], [0.0, 0.0, 1.0, 1.0], white)?;
            // another shader ends the run of pictures, which the reference would not read back otherwise
            e.draw_stretch_pic([0.0; 4], [0.0; 4], other)
        };
        // a change of the mode counts from the frame after
        stage.stereo_picture_of(draw)?;
        let picture = stage.stereo_picture_of(draw)?;
        stage.keep_picture(name, &picture);
        Ok(())
    };
    for mode in 1..=8 {
        stage.set("r_anaglyphMode", &mode.to_string());
        look(stage, &format!("mode-{mode}"))?;
    }
    stage.set("r_anaglyphMode", "1");
    stage.set("r_zproj", "150");
    look(stage, "far")?;
    stage.set("r_stereoSeparation", "-30");
    look(stage, "wide")?;
    stage.set("r_fastsky", "1");
    look(stage, "cleared")
}

fn cleared(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let tube = tube_at(stage, Vec3::new(0.0, 20.0, 10.0))?;
    let white = stage.register_shader("white")?;
    let mut world = stage.view(Vec3::new(-130.0, 0.0, 10.0), 8.0);
    (world.place, world.width, world.height) = ([40, 60], 400, 300);
    let mut alone = stage.view(Vec3::new(-40.0, 20.0, 10.0), 0.0);
    (alone.place, alone.width, alone.height) = ([300, 200], 200, 200);
    alone.flags = NO_WORLD;
    for (name, clear, fast_sky) in [("clear", "1", "0"), ("both", "1", "1"), ("sky", "0", "1")] {
        stage.set("r_clear", clear);
        stage.set("r_fastsky", fast_sky);
        stage.keep(name, |e| {
            e.draw_stretch_pic([10.0, 10.0, 200.0, 100.0], [0.0, 0.0, 1.0, 1.0], white)?;
            e.clear_scene()?;
            e.render_scene(&world)?;
            e.clear_scene()?;
            e.add_entity(&tube)?;
            e.render_scene(&alone)
        })?;
    }
    Ok(())
}

fn bright(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let tube = tube_at(stage, Vec3::new(0.0, 20.0, 10.0))?;
    let view = stage.view(Vec3::new(-130.0, 0.0, 10.0), 8.0);
    stage.keep("view", |e| {
        e.clear_scene()?;
        e.add_entity(&tube)?;
        e.add_light(Vec3::new(0.0, 60.0, 20.0), 150.0, Vec3::new(1.0, 0.4, 0.2))?;
        e.render_scene(&view)
    })
}

fn mirror(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let plane = refEntity_t {
        reType: 7,
        origin: [36.0, 0.0, 0.0],
        oldorigin: [36.0, 0.0, 0.0],
        ..refEntity_t::default()
    };
    let tubes = [
        tube_at(stage, Vec3::new(0.0, 20.0, 10.0))?,
        tube_at(stage, Vec3::new(-60.0, -20.0, 0.0))?,
    ];
    for (name, time) in [("mirror", 0), ("later", 1000)] {
        stage.set_time(time);
        let view = stage.view(Vec3::new(-130.0, 0.0, 10.0), 8.0);
        stage.keep_view(name, &view, |e| {
            e.add_entity(&plane)?;
            tubes.iter().try_for_each(|tube| e.add_entity(tube))
        })?;
    }
    Ok(())
}

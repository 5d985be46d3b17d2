//! Tests of materials, models and skins without a GPU.

use shaders::types::constants as c;

use super::{Combine, ImageFlags, ImageSource, LightmapClass};
use crate::test_support::{PIXEL, Registration, WHITE};

mod finish;

const SCRIPT: &[u8] = b"
t/wall
{
  { map $lightmap
    rgbGen identity }
  { map t/a.tga
    blendFunc filter
    rgbGen identity }
}
t/page
{
  { map t/b.tga
    tcGen lightmap
    rgbGen identity }
  { map $lightmap
    blendFunc add
    tcMod transform 1 0 0 1 0.5 0
    rgbGen wave sin 0.5 0.5 0 1 }
  { map t/a.tga
    blendFunc filter
    rgbGen identity }
}
t/flow
{
  cull none
  nomipmaps
  { animMap 5 t/a.tga t/b.tga
    tcMod scroll 1 2
    tcMod turb 0 0.1 0.2 0.3
    tcMod transform 1 2 3 4 5 6
    tcGen vector ( 1 0 0 ) ( 0 1 0 )
    rgbGen wave sin 0.5 0.25 0.1 2
    alphaGen const 0.5
    blendFunc blend }
  { clampmap t/c.tga
    alphaFunc GE128
    depthFunc equal
    blendFunc add }
  { clampmap t/b.tga
    blendFunc add }
}
t/gone
{
  { map t/a.tga }
  { map t/nothing.tga }
}
t/twice
{
  { map t/nothing.tga
    map t/a.tga }
}
t/second
{
  { map t/c.tga
    clampmap t/b.tga
    map $lightmap
    map t/a.tga }
}
t/bad
{
  frobnicate
}
t/detail
{
  { map t/a.tga }
  { map t/b.tga
    detail
    blendFunc filter }
}
t/lost_detail
{
  { map t/a.tga }
  { map t/nothing.tga
    detail
    blendFunc filter }
}
t/film
{
  { videoMap film.roq }
}
t/broken
{
  { map t/a.tga }
  { videoMap broken.roq
    blendFunc add }
  { map t/a.tga
    blendFunc add }
}
t/low { sort 1.5
  { map t/a.tga } }
t/water
{
  surfaceparm water
  surfaceparm trans
  cull none
  { map $whiteimage
    blendFunc GL_DST_COLOR GL_ONE
    rgbGen const ( 1 0.5 0.25 )
    tcMod scroll 1 0 }
}
t/lit_water
{
  surfaceparm water
  surfaceparm trans
  { map $whiteimage
    blendFunc GL_DST_COLOR GL_ONE }
  { map $lightmap
    blendFunc filter }
}
t/lava
{
  surfaceparm lava
  { map t/a.tga
    blendFunc blend }
}
t/shiny
{
  { map t/a.tga
    rgbGen lightingDiffuse }
  { map t/b.tga
    blendFunc add
    tcGen environment }
}
t/metal
{
  { map t/b.tga
    tcGen environment }
  { map t/a.tga
    blendFunc add }
  { map $lightmap
    blendFunc filter }
}
t/smoke
{
  { map t/a.tga
    blendFunc blend
    alphaGen entity }
  { map t/a.tga
    blendFunc blend
    rgbGen vertex }
  { map t/a.tga
    blendFunc blend }
  { map t/a.tga
    blendFunc add
    alphaGen entity }
}
t/sky
{
  skyParms t/box 300 -
  { map t/a.tga }
}
t/highsky
{
  skyParms - 700 -
  { map t/a.tga }
}
";

/// A picture of one texel that can be a normal map.
const BLUE: &[u8] = &[
    0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 255, 128, 128,
];

fn game() -> Registration {
    Registration::from_entries(&[
        ("scripts/t.shader", SCRIPT),
        ("t/a.tga", PIXEL),
        ("t/c.tga", PIXEL),
        ("t/b.jpg", PIXEL),
        ("t/plain.tga", PIXEL),
        ("t/blue.tga", BLUE),
        ("t/box_rt.tga", PIXEL),
        ("t/box_up.tga", PIXEL),
    ])
}

impl Registration {
    fn find(&mut self, name: &str, class: LightmapClass, mip: bool) -> u32 {
        self.materials.find(&mut self.textures, name, class, mip)
    }
}

#[test]
fn lightmap_and_image_are_one_pass() {
    let mut game = game();
    let wall = game.find("T/Wall.tga", LightmapClass::Page, true);
    let material = game.materials.get(wall);
    assert!(material.explicit && !material.defaulted);
    let [pass] = material.passes.as_slice() else {
        panic!("{:?}", material.passes);
    };
    assert_eq!(
        (pass.stage_count, pass.combine, pass.blend),
        (2, Combine::Modulate, None)
    );
    let stages = game.materials.stages(material);
    assert_eq!(stages[0].image_count, 0, "the lightmap belongs to the draw");
    assert_eq!(stages[0].flags & c::STAGE_NO_LIGHTMAP, 0);
    assert_eq!(stages[0].tc_gen, c::TCGEN_LIGHTMAP);
    assert_eq!(stages[1].image_count, 1);
    assert!(material.flags & c::MATERIAL_VERTEX_LIGHT != 0);
    assert_eq!(game.find("t/wall", LightmapClass::Page, true), wall);
    // without a lightmap the engine uses white
    for class in [LightmapClass::Vertex, LightmapClass::None] {
        let other = game.find("t/wall", class, true);
        assert_ne!(other, wall);
        let stages = game.materials.stages(game.materials.get(other));
        let white = |i: usize| stages[i].flags & c::STAGE_NO_LIGHTMAP != 0;
        assert!(white(0) && !white(1));
    }
    // in a map that was compiled without light they are lit by rays, as one image under light
    let other = game.find("t/wall", LightmapClass::Vertex, true);
    assert_eq!(game.materials.plain_image(game.materials.get(other)), None);
    game.materials.light_unlit([other].into_iter());
    let unlit = game.materials.get(other);
    let flags = game.materials.stages(unlit)[0].flags;
    assert_eq!(flags & c::STAGE_NO_LIGHTMAP, 0);
    assert!(game.materials.plain_image(unlit).is_some());
}

#[test]
fn stages_keep_what_the_script_says() {
    let mut game = game();
    let index = game.find("t/flow", LightmapClass::None, true);
    let material = game.materials.get(index).clone();
    let stages = game.materials.stages(&material);
    let first = stages[0];
    assert_eq!((first.image_count, first.image_frequency), (2, 5.0));
    let arrays = game.materials.arrays();
    let images = &arrays.images[first.image_first as usize..][..2];
    assert_eq!(images[0], game.textures.index("t/a.tga").unwrap());
    assert_eq!(images[1], game.textures.index("t/b.tga").unwrap());
    assert_eq!(first.tc_mod_count, 3);
    let mods = &arrays.tc_mods[first.tc_mod_first as usize..][..3];
    assert_eq!(
        (mods[0].kind, &mods[0].values[..2]),
        (c::TCMOD_SCROLL, &[1.0, 2.0][..])
    );
    assert_eq!(
        (mods[1].kind, mods[1].wave.amplitude),
        (c::TCMOD_TURBULENT, 0.1)
    );
    assert_eq!(mods[2].values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(
        (first.tc_gen, first.vector_t),
        (c::TCGEN_VECTOR, glam::Vec3::Y)
    );
    assert_eq!(
        (first.rgb_gen, first.rgb_wave.amplitude),
        (c::RGBGEN_WAVE, 0.25)
    );
    assert_eq!(
        (first.alpha_gen, first.constant[3]),
        (c::ALPHAGEN_CONST, 0.5)
    );
    assert_eq!(
        (first.blend_src, first.blend_dst),
        (c::BLEND_SRC_ALPHA, c::BLEND_ONE_MINUS_SRC_ALPHA)
    );
    assert_eq!(first.sampler_index, super::compile::sampler::REPEAT);
    let second = stages[1];
    assert_eq!(second.sampler_index, super::compile::sampler::CLAMP);
    // the first request sets the sampler to repeat
    assert_eq!(stages[2].sampler_index, super::compile::sampler::REPEAT);
    assert_eq!(second.alpha_func, c::ALPHAFUNC_GE128);
    assert!(second.flags & c::STAGE_DEPTH_EQUAL != 0);
    assert!(!game.textures.flags["t/a.tga"].mipmap);
    assert_eq!(material.passes.len(), 3);
    assert!(material.flags & c::MATERIAL_TRANSLUCENT != 0);
    assert!(material.flags & c::MATERIAL_TWO_SIDED != 0);
    assert_eq!(material.sort, shaderscript::sort::BLEND);
}

#[test]
fn liquids_and_reflections_come_from_directives() {
    let mut game = game();
    let mut material = |name| {
        let index = game.find(name, LightmapClass::Page, true);
        game.materials.get(index).clone()
    };
    let water = material("t/water").dielectric;
    assert!((water.index - 1.33).abs() < 1.0e-6 && water.ripple > 0.0);
    // its stage doubles the brightest channel of the background: the scale compensates
    assert!((water.scale - 0.5).abs() < 0.01, "{}", water.scale);
    // the light in its lightmap bounds it, too
    assert_eq!(material("t/lit_water").dielectric.scale, 1.0);
    assert_eq!(water.filters, 0);
    // red is absorbed least, blue most
    let [red, green, blue] = water.absorption.to_array();
    assert!(red.abs() < 1.0e-6 && green > 0.0 && blue > green);
    assert_eq!(material("t/lava").dielectric.index, 0.0);
    assert_eq!(material("t/wall").dielectric, Default::default());
    let (shiny, metal) = (material("t/shiny"), material("t/metal"));
    let has = |material, flag| -> Vec<bool> {
        (game.materials.stages(material).iter())
            .map(|stage| stage.flags & flag != 0)
            .collect()
    };
    assert_eq!(has(&shiny, c::STAGE_REFLECTION), [false, true]);
    assert_eq!(has(&shiny, c::STAGE_GLOSS), [false, false]);
    assert_eq!(has(&metal, c::STAGE_REFLECTION), [true, false, false]);
    assert_eq!(has(&metal, c::STAGE_GLOSS), [true, false, false]);
}

#[test]
fn stages_that_the_game_fades_by_alpha_are_matter() {
    let mut game = game();
    let index = game.find("t/smoke", LightmapClass::Page, true);
    let smoke = game.materials.get(index).clone();
    let matter: Vec<bool> = (game.materials.stages(&smoke).iter())
        .map(|stage| stage.flags & c::STAGE_MATTER != 0)
        .collect();
    assert_eq!(matter, [true, true, false, false]);
}

#[test]
fn a_stage_needs_the_images_of_all_its_lines_and_draws_the_last() {
    let mut game = game();
    let index = game.find("t/twice", LightmapClass::Page, true);
    assert!(game.materials.get(index).defaulted);
    let drawn =
        (game.materials).find_or_default(&mut game.textures, "t/twice", LightmapClass::None);
    assert_eq!(drawn, 0);
    let index = game.find("t/second", LightmapClass::TwoD, true);
    let second = game.materials.get(index).clone();
    assert!(!second.defaulted);
    let stages = game.materials.stages(&second);
    assert_eq!((stages.len(), stages[0].image_count), (1, 1));
    for name in ["t/a.tga", "t/b.tga", "t/c.tga"] {
        assert!(game.textures.flags.contains_key(name), "{name} is loaded");
    }
}

#[test]
fn missing_things_are_the_default_for_every_class() {
    let mut game = game();
    for name in ["t/gone", "t/bad", "t/neither"] {
        let index = game.find(name, LightmapClass::Page, true);
        assert_ne!(index, 0);
        assert!(game.materials.get(index).defaulted, "{name}");
        assert_eq!(game.find(name, LightmapClass::TwoD, true), index, "{name}");
        let drawn = game
            .materials
            .find_or_default(&mut game.textures, name, LightmapClass::None);
        assert_eq!(drawn, 0);
    }
    // stages before the fault are kept, for skins
    let gone = game.find("t/gone", LightmapClass::None, true);
    assert_eq!(game.materials.get(gone).stage_count, 1);
    assert_eq!(game.find("", LightmapClass::None, true), 0);
}

#[test]
fn implicit_materials_follow_their_class() {
    let mut game = game();
    let picture = game.find("t/plain", LightmapClass::TwoD, false);
    let material = game.materials.get(picture).clone();
    assert!(!material.explicit && !material.defaulted);
    assert!(!material.passes[0].depth_test && !material.passes[0].depth_write);
    assert_eq!(game.textures.flags["t/plain"], ImageFlags::NO_MIP);
    let wall = game.find("t/plain", LightmapClass::Page, true);
    assert_eq!(game.materials.get(wall).stage_count, 2);
    let white = game.find("t/plain", LightmapClass::White, true);
    let stages = game.materials.stages(game.materials.get(white));
    assert_eq!(stages[0].flags & c::STAGE_WHITE, c::STAGE_WHITE);
    let first = stages[0].image_first as usize;
    assert_eq!(game.materials.arrays().images[first], WHITE);
}

#[test]
fn drawing_order_is_sort_then_creation() {
    let mut game = game();
    let flow = game.find("t/flow", LightmapClass::None, true);
    let wall = game.find("t/wall", LightmapClass::Page, true);
    let plain = game.find("t/plain", LightmapClass::None, true);
    let low = game.find("t/low", LightmapClass::None, true);
    let rank = |index| game.materials.rank(index);
    assert!(rank(low) < rank(wall));
    assert!(rank(wall) < rank(plain));
    assert!(rank(plain) < rank(flow));
    let sorted = game.materials.sorted();
    assert_eq!(sorted.len(), game.materials.len());
    for (place, &index) in sorted.iter().enumerate() {
        assert_eq!(rank(index) as usize, place);
    }
}

#[test]
fn remapping_reaches_every_class_and_can_be_cancelled() {
    let mut game = game();
    let page = game.find("t/wall", LightmapClass::Page, true);
    let vertex = game.find("t/wall", LightmapClass::Vertex, true);
    let remap = |game: &mut Registration, old: &str, new: &str| {
        game.materials
            .remap(&mut game.textures, old, new, Some(2.5));
    };
    remap(&mut game, "t/wall", "t/flow");
    let flow = game.materials.resolve(page);
    assert_eq!(game.materials.get(flow).name, "t/flow");
    assert_eq!(game.materials.get(flow).time_offset, 2.5);
    assert_eq!(game.materials.resolve(vertex), flow);
    remap(&mut game, "t/wall", "t/neither");
    assert_eq!(game.materials.resolve(page), flow);
    remap(&mut game, "t/wall", "t/wall");
    assert_eq!(game.materials.resolve(page), page);
    assert_eq!(game.materials.resolve(u32::MAX), 0);
}

#[test]
fn settings_change_stages() {
    let mut game = game();
    let both = game.find("t/detail", LightmapClass::None, true);
    assert_eq!(game.materials.get(both).stage_count, 2);
    let plain = crate::settings::Settings {
        detail_textures: false,
        vertex_light: true,
        ..Default::default()
    };
    let mut files = relight::MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).unwrap();
    files.insert("t/a.tga", PIXEL).unwrap();
    files.insert("t/b.tga", PIXEL).unwrap();
    let menu = crate::settings::Settings {
        ui_fullscreen: true,
        detail_textures: true,
        ..plain.clone()
    };
    let mut covered = Registration::with(files.clone(), menu);
    let kept = covered.find("t/detail", LightmapClass::None, true);
    assert_eq!(covered.materials.get(kept).stage_count, 2);
    let mut game = Registration::with(files, plain);
    let one = game.find("t/detail", LightmapClass::None, true);
    assert_eq!(game.materials.get(one).stage_count, 1);
    // a stage that is not drawn still requires its image
    let lost = game.find("t/lost_detail", LightmapClass::None, true);
    assert!(game.materials.get(lost).defaulted);
    let wall = game.find("t/wall", LightmapClass::Page, true);
    let material = game.materials.get(wall);
    assert_eq!(material.lightmap_class, LightmapClass::Vertex);
    assert_eq!(
        game.materials.stages(material)[0].rgb_gen,
        c::RGBGEN_EXACT_VERTEX
    );
}

#[test]
fn unplayable_videos_drop_their_stage_and_later_ones() {
    let mut game = game();
    let index = game.find("t/broken", LightmapClass::None, true);
    assert_eq!(game.materials.get(index).stage_count, 3);
    let client = game.materials.get(index).videos[0].client;
    game.materials.drop_video(client);
    let material = game.materials.get(index);
    assert_eq!((material.stage_count, material.passes.len()), (1, 1));
    assert!(material.videos.is_empty());
}

#[test]
fn videos_show_their_client() {
    let mut game = game();
    let film = game.find("t/film", LightmapClass::None, true);
    let material = game.materials.get(film).clone();
    let video = &material.videos[0];
    assert_eq!((video.name.as_str(), video.client), ("film.roq", 32));
    let first = game.materials.stages(&material)[0].image_first as usize;
    assert_eq!(
        game.materials.arrays().images[first],
        game.textures.scratch(32)
    );
    let before = game.materials.generation();
    game.materials.replace_scratch(32, 77);
    assert_eq!(game.materials.arrays().images[first], 77);
    assert!(game.materials.generation() > before);
    assert_eq!(
        game.materials.videos().collect::<Vec<_>>(),
        [("film.roq", 32)]
    );
}

#[test]
fn skies_have_faces_and_clouds() {
    let mut game = game();
    let sky = game.find("t/sky", LightmapClass::None, true);
    let material = game.materials.get(sky).clone();
    let found = material.sky.unwrap();
    let faces = found.faces.unwrap();
    assert_eq!(faces[0], game.textures.index("t/box_rt.tga").unwrap());
    assert_eq!(faces[1], game.textures.default_image());
    assert_eq!(faces[4], game.textures.index("t/box_up.tga").unwrap());
    assert_eq!(game.materials.cloud_height(), 300.0);
    // in the engine, all skies have the height of the last one
    game.find("t/highsky", LightmapClass::None, true);
    game.find("t/sky", LightmapClass::None, true);
    assert_eq!(game.materials.cloud_height(), 700.0);
    assert!(material.flags & c::MATERIAL_SKY != 0);
    assert_eq!(material.sort, shaderscript::sort::SKY);
}

#[test]
fn skins_name_materials_by_surface() {
    let mut files = relight::MemoryFiles::new();
    files.insert("scripts/t.shader", SCRIPT).unwrap();
    files.insert("t/a.tga", PIXEL).unwrap();
    files
        .insert("m/x.skin", "head,t/low\nBody,t/gone\ntag_head,\n")
        .unwrap();
    files.insert("m/empty.skin", "tag_head,\n").unwrap();
    let mut game = Registration::new(files);
    let register = |game: &mut Registration, name: &str| {
        game.skins
            .register(&*game.files, &mut game.materials, &mut game.textures, name)
    };
    let skin = register(&mut game, "m/x.skin");
    assert!(skin > 0);
    assert_eq!(register(&mut game, "M/X.SKIN"), skin);
    assert_eq!(register(&mut game, "m/empty.skin"), 0);
    assert_eq!(register(&mut game, "m/none.skin"), 0);
    let loaded = game.skins.get(skin).unwrap();
    let low = loaded.material("head").unwrap();
    assert_eq!(game.materials.get(low).name, "t/low");
    // unusable, but its remaining stages are drawn
    let gone = loaded.material("body").unwrap();
    assert!(game.materials.get(gone).defaulted && gone != 0);
    assert!(loaded.material("legs").is_none());
    assert!(game.skins.get(0).is_none() && game.skins.get(-5).is_none());
}

#[test]
fn plain_materials_are_one_image_under_light() {
    let mut game = game();
    let mut plain = |name: &str, class: LightmapClass| {
        let index = game.find(name, class, true);
        let material = game.materials.get(index).clone();
        game.materials.plain_image(&material).is_some()
    };
    assert!(plain("t/wall", LightmapClass::Page), "image x lightmap");
    assert!(!plain("t/flow", LightmapClass::None), "animated");
    assert!(
        plain("t/page", LightmapClass::Vertex),
        "image x page, styles aside"
    );
    let page = game.find("t/page", LightmapClass::Vertex, true);
    let stages = game.materials.stages(game.materials.get(page));
    let flags = c::STAGE_BAKED_LIGHT | c::STAGE_LIGHT_STYLE;
    let flags: Vec<u32> = stages.iter().map(|s| s.flags & flags).collect();
    assert_eq!(flags, [c::STAGE_BAKED_LIGHT, c::STAGE_LIGHT_STYLE, 0]);
}

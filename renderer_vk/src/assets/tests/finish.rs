//! What packs and files of materials state.

use relight::materials::by_hand::MaterialsByHand;
use shaders::types::constants as c;

use super::{BLUE, LightmapClass, PIXEL, Registration, game};

#[test]
fn files_of_materials_change_and_restore_materials() {
    let mut game = game();
    let [wall, shiny, water, sky] = ["t/wall", "t/shiny", "t/water", "t/sky"]
        .map(|name| game.find(name, LightmapClass::Page, true));
    let flags = |game: &Registration| {
        [wall, shiny, water, sky].map(|index| game.materials.get(index).flags)
    };
    let before = flags(&game);
    assert!(!game.materials.has_gloss(true));
    let set = |game: &mut Registration, text: &str| {
        let (file, wrong) = MaterialsByHand::parse(text);
        assert_eq!(wrong, []);
        game.materials.set_by_hand(file, &mut game.textures)
    };
    let faults = set(
        &mut game,
        "rough t/* 0.4\nmetal t/wall 0.5\nplain t/shiny\nnormals t/wall t/nothing\nsurface t/w* t/a",
    );
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].contains("t/wall") && faults[0].contains("t/nothing"));
    let material = game.materials.get(wall);
    assert_eq!(material.flags, before[0] | c::MATERIAL_ROUGH);
    assert_eq!(
        (material.specular.roughness, material.specular.metal),
        (0.4, 0.5)
    );
    assert_ne!(material.specular.map, c::NO_TEXTURE);
    // plain forgets the lines before it; what has no body stays as it is
    let plain = before[1] & !c::MATERIAL_REFLECTS | c::MATERIAL_PLAIN;
    assert_eq!(flags(&game)[1..], [plain, before[2], before[3]]);
    assert!(game.materials.has_gloss(true));
    // later materials have the files, too
    let later = game.find("t/plain", LightmapClass::Page, true);
    assert_ne!(game.materials.get(later).flags & c::MATERIAL_ROUGH, 0);
    // a grey image is no normal map
    let faults = set(
        &mut game,
        "normals t/wall t/a\nmirror t/wall 0.5 0.5 0.5\nglass t/shiny 1.5 1 0.5 1",
    );
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert!(faults[0].contains("no normal map"));
    let glass = game.materials.get(shiny);
    assert_eq!(glass.dielectric.index, 1.5);
    assert_ne!(glass.flags & c::MATERIAL_TRANSLUCENT, 0);
    // a wall of one image becomes glass, too: rays must not take its image by the shortcut
    let one_image = |game: &Registration| {
        let wall = game.materials.get(wall);
        game.materials.plain_image(wall).is_some()
    };
    assert!(one_image(&game));
    set(&mut game, "glass t/wall 1.5 1 1 1\nrough t/wall 0.2");
    assert!(game.materials.has_gloss(true) && !game.materials.has_gloss(false));
    set(&mut game, "glass t/wall 1.5 1 1 1");
    assert!(!one_image(&game));
    assert_ne!(game.materials.get(wall).flags & c::MATERIAL_CLEAR, 0);
    set(&mut game, "normals t/wall t/blue");
    assert_ne!(game.materials.get(wall).flags & c::MATERIAL_NORMALS, 0);
    assert!(game.materials.has_gloss(true));
    set(&mut game, "mirror t/wall 0.5 0.5 0.5");
    assert_eq!(flags(&game)[0], before[0] | c::MATERIAL_REFLECTS);
    // without lines everything is as before
    assert_eq!(set(&mut game, ""), [""; 0]);
    assert_eq!(flags(&game), before);
    assert!(!game.materials.has_gloss(true));
}

#[test]
fn packs_state_reflection_in_words_of_opengl2() {
    let stages = "{\nmap t/a.tga\ntcMod scale 2 2\n}\n{\nmap $lightmap\nblendFunc filter\n}\n";
    let words = "{\nstage normalMap\nmap t/blue\nnormalScale 0.5\n}\n{\nstage specularMap\nmap t/c\nspecularScale 0.5 0.25\n}\n";
    let script = format!(
        "t/wall\n{{\n{stages}}}\nt/pane\n{{\nsurfaceparm trans\n{{\nmap t/a\nblendFunc blend\nroughness 0.1\n}}\n}}\n"
    );
    let mtr = format!("t/wall\n{{\n{stages}{words}}}\n");
    let mut game = Registration::from_entries(&[
        ("scripts/t.shader", script.as_bytes()),
        ("scripts/t.mtr", mtr.as_bytes()),
        ("t/a.tga", PIXEL),
        ("t/c.tga", PIXEL),
        ("t/blue.tga", BLUE),
        ("t/plain.tga", PIXEL),
        ("t/plain_n.tga", BLUE),
        ("t/plain_s.tga", PIXEL),
        ("t/grey.tga", PIXEL),
        ("t/grey_n.tga", PIXEL),
        ("t/high.tga", PIXEL),
        ("t/high_nh.tga", BLUE),
    ]);
    let find = |game: &mut Registration, name| game.find(name, LightmapClass::Page, true);
    let [wall, pane, plain, grey, high] =
        ["t/wall", "t/pane", "t/plain", "t/grey", "t/high"].map(|name| find(&mut game, name));
    assert!(!game.materials.has_gloss(true), "before a traced view");
    assert_eq!(game.textures.index("t/plain_n"), None);
    let states = c::MATERIAL_ROUGH | c::MATERIAL_NORMALS | c::MATERIAL_SPECULAR_MAP;
    let state = |game: &Registration, index| game.materials.get(index).flags & states;
    let faults = (game.materials).set_by_hand(MaterialsByHand::default(), &mut game.textures);
    assert_eq!(faults.len(), 2, "{faults:?}");
    assert!(faults[0].contains("t/grey_n is no normal map"));
    // an image without heights: one line, and the surface is flat
    assert!(faults[1].contains("t/high_nh has no heights"));
    assert_eq!(state(&game, high), c::MATERIAL_NORMALS);
    assert!(!game.materials.has_heights());
    assert_eq!(state(&game, wall), states);
    assert_eq!(state(&game, plain), states);
    assert_eq!(state(&game, grey), 0);
    assert_eq!(state(&game, pane), 0, "no body");
    let specular = game.materials.get(wall).specular;
    assert_eq!(
        specular.normal_scale.to_array(),
        [0.5, -0.5],
        "y points down"
    );
    assert_eq!(specular.reflectance.to_array(), [0.5; 3]);
    assert_eq!((specular.roughness, specular.metal), (0.75, 0.0));
    // maps lie where the texture does
    assert_eq!(specular.stage, game.materials.get(wall).stage_first);
    let specular = game.materials.get(plain).specular;
    assert_eq!(specular.stage, c::NO_STAGE);
    assert_eq!(specular.reflectance.to_array(), [1.0; 3]);
    assert_eq!((specular.roughness, specular.metal), (0.0, 0.0));
    // a file by hand overrides the pack
    let (file, _) = MaterialsByHand::parse("rough t/wall 0.2\nplain t/plain\n");
    game.materials.set_by_hand(file, &mut game.textures);
    let material = game.materials.get(wall);
    assert_eq!(state(&game, wall), c::MATERIAL_ROUGH | c::MATERIAL_NORMALS);
    assert_eq!(material.specular.reflectance.to_array(), [0.04; 3]);
    assert_eq!(material.specular.map, c::NO_TEXTURE);
    assert_eq!(state(&game, plain), 0);
}

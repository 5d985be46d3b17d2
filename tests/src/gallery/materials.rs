//! What belongs to a whole shader: sorting, culling, offsets, time, fog, implicit shaders, malformed scripts.

use glam::Vec3;

use super::board::{Board, MAP, Shape, screen};
use super::{File, Scene, Stage, scene_list};
use crate::engine::Raised;

const SORTS: [&str; 20] = [
    "sort portal",
    "sort sky",
    "sort opaque",
    "sort decal",
    "sort seeThrough",
    "sort banner",
    "sort underwater",
    "sort additive",
    "sort nearest",
    "sort 3",
    "sort 9",
    "sort 9.5",
    "sort 12",
    "sort 15",
    "sort nonsense",
    "sort SEETHROUGH",
    "polygonOffset",
    "sort -1",
    "sort 40",
    "",
];

/// Blended surfaces, each half over the next and nearer or farther by turns: who is drawn last shows.
fn sorts() -> Board {
    Board::new(
        5,
        Shape::Face,
        SORTS.map(|s| {
            format!(
                "{s}\n{{\nmap g/base.tga\nblendFunc blend\nrgbGen identity\nalphaGen const 0.7\n}}"
            )
        }),
    )
}

fn sort_files() -> Vec<File> {
    let board = sorts();
    let mut map = board.map();
    for tile in 0..board.tiles.len() {
        // a second one of each over its two neighbours
        let shader = map.add_shader(&Board::name(tile), 0, 1);
        let depth = if tile % 2 == 0 { 4.0 } else { -4.0 };
        let center = board.center(tile) + Vec3::new(depth, -38.0, -38.0);
        map.add_quad(shader, screen(center, 30.0, 30.0));
    }
    board.files_with(map)
}

fn culls(shape: Shape) -> Board {
    let kinds = [
        "cull front",
        "cull back",
        "cull backside",
        "cull backsided",
        "cull none",
        "cull twosided",
        "cull disable",
        "cull nonsense",
        "",
    ];
    Board::new(
        3,
        shape,
        kinds.map(|c| format!("{c}\n{{\nmap g/base.tga\nrgbGen identity\n}}")),
    )
}

/// From the front and, turned over, from behind.
fn cull_files() -> Vec<File> {
    let board = culls(Shape::Face);
    let mut map = board.map();
    for tile in 0..board.tiles.len() {
        let shader = map.add_shader(&Board::name(tile), 0, 1);
        let center = board.center(tile) + Vec3::new(-10.0, 20.0, 20.0);
        let [a, b, c, d] = screen(center, 20.0, 20.0);
        map.add_quad(shader, [a, d, c, b]);
    }
    board.files_with(map)
}

/// Decals in the plane of what they lie on.
fn offsets() -> Board {
    Board::new(
        3,
        Shape::Face,
        [
            "polygonOffset\n{\nmap g/alpha.tga\nblendFunc blend\n}",
            "polygonOffset\n{\nmap g/base.tga\n}",
            "polygonOffset\nsort 6\n{\nmap g/cut.tga\nalphaFunc GE128\n}",
            "sort decal\npolygonOffset\n{\nmap g/env.tga\nblendFunc filter\n}",
            "polygonOffset\n{\nmap g/base.tga\nblendFunc add\n}\n{\nmap g/grey.tga\nblendFunc filter\n}",
        ],
    )
}

fn offset_files() -> Vec<File> {
    let board = offsets();
    let mut map = board.map();
    let wall = map.add_shader("g/wall", 0, 1);
    // larger and of one plane with the tiles
    let (y, z) = (Vec3::Y * 170.0, Vec3::Z * 130.0);
    let behind = map.add_quad(wall, [y + z, -y + z, -y - z, y - z]);
    map.set_lightmap(behind, 0);
    board.files_with(map)
}

fn play_offsets(stage: &mut Stage) -> Result<(), Raised> {
    let board = offsets();
    stage.start_map(MAP)?;
    let mut view = board.view(stage);
    for (name, yaw) in [("straight", 0.0), ("aslant", 35.0)] {
        view.angles.y = yaw;
        view.origin.y = yaw * -4.0;
        stage.keep(name, |e| board.draw(e, &view))?;
    }
    Ok(())
}

fn times(shape: Shape) -> Board {
    let scroll = "{\nmap g/base.tga\ntcMod scroll 0.1 0\n}\n{\nmap g/grey.tga\nblendFunc add\nrgbGen wave sawtooth 0 1 0 0.07\n}";
    let heads = [
        "",
        "clampTime 5",
        "clampTime 12.5",
        "clampTime 100",
        "clampTime 0",
        "entityMergable",
        "tesssize 64",
        "light 5",
        "qer_trans 0.5 rubbish { here",
    ];
    Board::new(3, shape, heads.map(|h| format!("{h}\n{scroll}")))
}

/// Everything that a script can get wrong.
fn malformed() -> Board {
    let good = "{\nmap g/base.tga\n}";
    Board::new(
        6,
        Shape::Face,
        [
            format!("frobnicate\n{good}"),
            format!("{good}\nfrobnicate"),
            "{\nmap g/base.tga\nfrobnicate\n}".into(),
            "surfaceparm nonsense\n{\nmap g/base.tga\n}".into(),
            "{\nmap g/nothing.tga\n}".into(),
            format!("{good}\n{{\nmap g/nothing.tga\nblendFunc add\n}}"),
            "surfaceparm trans".into(),
            format!("cull front\n{good}"),
            "{\nmap g/base.tga\nblendFunc GL_ONE GL_ONE_MINUS_DST_COLOR\n}".into(),
            format!("q3map_surfacelight lots\nq3map_sun 1 2\n{good}"),
            "{\nmap g/base.tga\n}\n{\nmap g/env.tga\n}".into(),
            "{\nmap g/base.tga\ndepthFunc equal\n}".into(),
            "{\nmap g/base.tga\nmap g/env.tga\nmap g/wide.tga\n}".into(),
            format!("{good}\n{{\nblendFunc add\n}}\n{{\nmap g/env.tga\nblendFunc add\n}}"),
            "{\nrgbGen identity\n}".into(),
            "{\nmap g/base.tga\nrgbGen wave sin 0 1 0 1\nrgbGen vertex\n}".into(),
            "{\nmap g/base.tga\nrgbGen nonsense\nalphaGen nonsense\n}".into(),
            "{\nmap g/base.tga\nblendFunc blend\ndepthWrite\nalphaFunc GT0\n}".into(),
            "{\nmap\n}".into(),
            "{\nmap g/base.tga\nrgbGen const ( 1 0 )\n}".into(),
            "{\nmap g/base.tga\nrgbGen const (1 0 0)\n}".into(),
            "{\nmap g/base.tga\nalphaGen const\n}".into(),
            "{\nmap g/base.tga\ntcMod\n}".into(),
            "{\nmap g/base.tga\ntcMod scale 2\n}".into(),
            "{\nmap g/base.tga\ntcMod nonsense 1 2 3\n}".into(),
            "{\nmap g/base.tga\ntcMod scale 2 2 surplus words\n}".into(),
            "{\nmap g/base.tga surplus\n}".into(),
            "deformVertexes\n{\nmap g/base.tga\n}".into(),
            "deformVertexes nonsense 1 2\n{\nmap g/base.tga\n}".into(),
            "deformVertexes wave 100 sin 0\n{\nmap g/base.tga\n}".into(),
            "fogparms (1 0 0) 100\n{\nmap g/base.tga\n}".into(),
            "fogparms ( 1 0 0 ) 100 0 0\n{\nmap g/base.tga\n}".into(),
            "skyparms full\n{\nmap g/base.tga\n}".into(),
            format!("// comment /* with another\n/* and\n{{ */\n{good}"),
            "{\rmap g/base.tga\r}\r".into(),
            "{\nMAP \"g/base.tga\"\nRGBGEN IDENTITY\n}".into(),
            "cull\n{\nmap g/base.tga\n}".into(),
            "sort\n{\nmap g/base.tga\n}".into(),
            "{\nmap g/base.tga\nalphaFunc\n}".into(),
            "{\nmap g/base.tga\nanimMap 2\n}".into(),
            "{\nanimMap 2 g/base.tga g/nothing.tga\n}".into(),
            // words of `map` alone
            "{\nclampMap $whiteimage\n}".into(),
            "{\nclampMap $lightmap\n}".into(),
            "{\nclampMap *white\n}".into(),
            "{\nanimMap 1 $whiteimage\n}".into(),
            "{\nmap $WHITEIMAGE\nrgbGen const ( 1 .5 0 )\n}".into(),
            "{ map g/base.tga rgbGen identity }".into(),
            "{\nmap \"g/base.tga\" rgbGen \"identity\"\n}".into(),
            "{\nanimMap 0 g/base.tga g/env.tga\n}".into(),
            "{\nanimMap -3 g/base.tga g/env.tga\n}".into(),
            "{\nmap g/base.tga\ntcMod scale 2x 1e1\n}".into(),
            "sort 6\nsort additive\n{\nmap g/base.tga\n}".into(),
            "{\nmap g/base.tga\ntcGen vector ( 1 0 0 ) ( 0 1 )\n}".into(),
            "{\nmap g/base.tga/* c */\n}".into(),
            "{\nmap g\\base.tga\n}".into(),
        ],
    )
}

/// More than the language allows of everything.
fn limits() -> Board {
    let stage = |image: &str, blend: &str| {
        format!("{{\nmap g/{image}.tga\n{blend}\nrgbGen const ( 0.2 0.2 0.2 )\n}}\n")
    };
    let stages = |n: usize| stage("base", "") + &stage("env", "blendFunc add").repeat(n - 1);
    Board::new(
        3,
        Shape::Face,
        [
            stages(8),
            stages(9),
            "{\nmap g/base.tga\ntcMod scale 2 1\ntcMod scale 1 2\ntcMod rotate 10\ntcMod scroll 0.1 0\n}".into(),
            "deformVertexes move 0 3 0 sin 1 0 0 0\n".repeat(4) + "{\nmap g/base.tga\n}",
            format!("{{\nmap g/{}.tga\n}}", "long".repeat(20)),
            "{\nmap g/base.tga\nrgbGen const ( 2 -1 0.5 )\nalphaGen const 7\n}".into(),
        ],
    )
}

fn implicit() -> Board {
    let none = || std::iter::repeat_n("", 2);
    Board::new(4, Shape::Face, none())
        .and(Shape::Squares(2), none())
        .and(Shape::Patch, none())
        .and(Shape::Skin, none())
        .and(Shape::Sprite, none())
        .and(Shape::Poly, none())
        .and(Shape::Picture, none())
}

/// Stages of all kinds in a fog.
fn fogged(shape: Shape) -> Board {
    let blends = [
        "",
        "blendFunc add",
        "blendFunc filter",
        "blendFunc blend",
        "blendFunc GL_ZERO GL_ONE_MINUS_SRC_COLOR",
        "blendFunc GL_ONE GL_ONE_MINUS_SRC_ALPHA",
        "blendFunc GL_DST_COLOR GL_ONE",
        "alphaFunc GE128",
    ];
    let single = blends.map(|b| format!("{{\nmap g/alpha.tga\n{b}\n}}"));
    let over = blends.map(|b| format!("{{\nmap g/base.tga\n}}\n{{\nmap g/env.tga\n{b}\n}}"));
    // drawn with the opaque ones, blended stages fade and are not fogged
    let early = ["blendFunc add", "blendFunc blend"]
        .map(|b| format!("sort opaque\n{{\nmap g/alpha.tga\n{b}\n}}"));
    let tiles = single.into_iter().chain(over).chain(early);
    let mut board = Board::new(4, shape, tiles);
    board.script = "m/fog\n{\nsurfaceparm fog\nfogparms ( 0.6 0.2 0.3 ) 300\n}\n".into();
    board
}

fn fog_files(shape: Shape) -> Vec<File> {
    let board = fogged(shape);
    let mut map = board.map();
    let shader = map.add_shader("m/fog", 0, 64);
    // its top is between the rows
    let fog = map.add_fog_brush(
        shader,
        Vec3::new(-900.0, -900.0, -900.0),
        Vec3::new(60.0, 900.0, 40.0),
        5,
    );
    let tiles = board
        .tiles
        .iter()
        .filter(|t| matches!(t.shape, Shape::Face | Shape::Squares(_) | Shape::Dome(_)));
    for surface in 0..6 + tiles.count() {
        map.set_fog(surface, fog);
    }
    let (x, y) = (Vec3::X * 900.0, Vec3::Y * 900.0);
    let top = Vec3::Z * 40.0;
    map.add_quad(shader, [top - x - y, top - x + y, top + y, top - y]);
    board.files_with(map)
}

fn play_fog(stage: &mut Stage, shape: Shape) -> Result<(), Raised> {
    let board = fogged(shape);
    stage.start_map(MAP)?;
    let mut view = board.view(stage);
    for (name, height) in [("inside", 0.0), ("below", 39.0), ("outside", 90.0)] {
        view.origin.z = height;
        stage.keep(name, |e| board.draw(e, &view))?;
    }
    Ok(())
}

/// What the reference calls an error, which ends the game, and we draw as well as can be: afterwards both go on.
fn raise(stage: &mut Stage) -> Result<(), Raised> {
    stage.start_map(MAP)?;
    let whole = [0.0, 0.0, 1.0, 1.0];
    for name in [
        "raise/alphanoise",
        "raise/stretchnoise",
        "raise/deformnoise",
        "raise/tcmods",
        "raise/halfblend",
    ] {
        let drawn = (|| {
            let shader = stage.register_shader(name)?;
            stage.begin_frame(0)?;
            stage.draw_stretch_pic([0.0, 0.0, 50.0, 50.0], whole, shader)?;
            stage.end_frame()
        })();
        if let Err(raised) = drawn
            && raised.level != 1
        {
            return Err(raised);
        }
    }
    stage.keep("after", |e| {
        let shader = e.register_shader("g/base")?;
        e.set_color(None)?;
        e.draw_stretch_pic([0.0, 0.0, 640.0, 480.0], whole, shader)
    })
}

fn raise_files() -> Vec<File> {
    let mut board = implicit();
    board.script = "
raise/alphanoise\n{\n{\nmap g/base.tga\nblendFunc blend\nalphaGen wave noise 0.5 0.5 0 1\n}\n}
raise/stretchnoise\n{\n{\nmap g/base.tga\ntcMod stretch noise 1 0.5 0 1\n}\n}
raise/halfblend\n{\n{\nmap g/base.tga\nblendFunc GL_ONE\n}\n}
raise/deformnoise\n{\ndeformVertexes wave 100 noise 1 0.5 0 1\n{\nmap g/base.tga\n}\n}
raise/tcmods\n{\n{\nmap g/base.tga\ntcMod scale 1 1\ntcMod scale 1 1\ntcMod scale 1 1\ntcMod scale 1 1\ntcMod scale 1 1\n}\n}\n"
        .into();
    board.files()
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "sort": "sort by name, by number, by default.",
            calls(|stage| sorts().play(stage, &[0])), files: sort_files, quick: true;
        "cull-face": "cull, from both sides.",
            calls(|stage| culls(Shape::Face).play(stage, &[0])), files: cull_files, quick: true;
        "cull-model": "cull on models.", board(culls(Shape::Model), &[0]);
        "cull-sprite": "cull on sprites.", board(culls(Shape::Sprite), &[0]);
        "cull-poly": "cull on polygons.", board(culls(Shape::Poly), &[0]);
        "polygon-offset": "polygonOffset in one plane with the wall.", calls(play_offsets), files: offset_files;
        "time-face": "clampTime and words without effect.", board(times(Shape::Face), &[0, 2000]);
        "time-model": "The same on models.", board(times(Shape::Model), &[0, 2000]);
        "time-picture": "The same in 2D.", board(times(Shape::Picture), &[0, 2000]);
        "malformed": "Malformed and odd scripts.", board(malformed(), &[0]), quick: true;
        "limits": "More than allowed.", board(limits(), &[0]);
        "implicit": "Without a script.", board(implicit(), &[0]);
        "implicit-vertex": "Without a script, r_vertexLight.",
            board(implicit(), &[0]), cvars: &[("r_vertexLight", "1")];
        "implicit-bright": "Without a script, r_fullbright.", board(implicit(), &[0]), cvars: &[("r_fullbright", "1")];
        "fog-face": "Stages in fog.",
            calls(|stage| play_fog(stage, Shape::Face)), files: || fog_files(Shape::Face), quick: true;
        "fog-soup": "Stages of soups in fog.",
            calls(|stage| play_fog(stage, Shape::Squares(4))), files: || fog_files(Shape::Squares(4));
        "fog-model": "Models in fog.", calls(|stage| play_fog(stage, Shape::Model)), files: || fog_files(Shape::Model);
        "fog-sprite": "Sprites in fog.",
            calls(|stage| play_fog(stage, Shape::Sprite)), files: || fog_files(Shape::Sprite);
        "raise": "What ends in an error.", calls(raise), files: raise_files;
    }
}

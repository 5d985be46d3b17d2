//! Images, blending, alpha tests, depth.

use super::board::{Board, Shape, screen};
use super::{File, Scene, Stage, scene_list};
use crate::engine::Raised;

const SOURCES: [&str; 9] = [
    "GL_ONE",
    "GL_ZERO",
    "GL_DST_COLOR",
    "GL_ONE_MINUS_DST_COLOR",
    "GL_SRC_ALPHA",
    "GL_ONE_MINUS_SRC_ALPHA",
    "GL_DST_ALPHA",
    "GL_ONE_MINUS_DST_ALPHA",
    "GL_SRC_ALPHA_SATURATE",
];
const DESTINATIONS: [&str; 8] = [
    "GL_ONE",
    "GL_ZERO",
    "GL_SRC_ALPHA",
    "GL_ONE_MINUS_SRC_ALPHA",
    "GL_DST_ALPHA",
    "GL_ONE_MINUS_DST_ALPHA",
    "GL_SRC_COLOR",
    "GL_ONE_MINUS_SRC_COLOR",
];

fn pairs() -> impl Iterator<Item = String> {
    SOURCES.iter().flat_map(|s| {
        DESTINATIONS
            .iter()
            .map(move |d| format!("blendFunc {s} {d}"))
    })
}

/// Over what is behind the board.
fn blends() -> Board {
    Board::new(
        9,
        Shape::Face,
        pairs().map(|b| format!("{{\nmap g/alpha.tga\n{b}\nrgbGen identity\n}}")),
    )
}

/// Over a first stage whose alpha is a ramp: shows what the frame's alpha holds.
fn blends_over_alpha() -> Board {
    Board::new(
        9,
        Shape::Face,
        pairs().map(|b| {
            format!(
                "{{\nmap g/alpha.tga\nrgbGen identity\nalphaGen identity\n}}\n\
                 {{\nmap g/env.tga\n{b}\nrgbGen identity\nalphaGen const 0.6\n}}"
            )
        }),
    )
}

fn shorthand() -> Board {
    let kinds = [
        "blendFunc add",
        "blendFunc filter",
        "blendFunc blend",
        "blendfunc GL_ONE GL_ZERO",
        "blendFunc GL_ONE GL_ONE_MINUS_DST_COLOR", // only legal as a source
        "blendFunc GL_NONSENSE GL_ZERO",
        "blendFunc gl_dst_color gl_zero",
        "",
    ];
    Board::new(
        4,
        Shape::Face,
        kinds.map(|b| format!("{{\nmap g/alpha.tga\n{b}\n}}")),
    )
}

fn alpha_tests() -> Board {
    let tests = ["GT0", "LT128", "GE128", "nonsense", "ge128"];
    let kinds = [
        "",
        "blendFunc blend",
        "alphaGen wave sin 0.5 0.5 0 0.5",
        "alphaGen const 0.5",
    ];
    let all = kinds.iter().flat_map(|k| {
        tests.map(|t| format!("cull none\n{{\nmap g/cut.tga\nalphaFunc {t}\n{k}\n}}"))
    });
    let ramp = tests.map(|t| format!("{{\nmap g/alpha.tga\nalphaFunc {t}\n}}"));
    Board::new(5, Shape::Face, all.chain(ramp))
}

/// Depth: a far stage of one tile is seen through a nearer one only if that wrote no depth.
fn depth() -> Board {
    let cut = "{\nmap g/cut.tga\nalphaFunc GE128\n";
    let bodies = [
        // a later stage only where the first one wrote
        format!("{cut}depthWrite\n}}\n{{\nmap g/env.tga\ndepthFunc equal\nblendFunc filter\n}}"),
        format!("{cut}depthWrite\n}}\n{{\nmap g/env.tga\nblendFunc filter\n}}"),
        format!("{cut}}}\n{{\nmap g/env.tga\ndepthFunc equal\n}}"),
        "{\nmap g/base.tga\ndepthFunc equal\n}".to_string(),
        "{\nmap g/alpha.tga\nblendFunc blend\ndepthWrite\n}".to_string(),
        "{\nmap g/alpha.tga\ndepthWrite\nblendFunc blend\n}".to_string(),
        "{\nmap g/alpha.tga\nblendFunc blend\n}".to_string(),
        "{\nmap g/cut.tga\nblendFunc blend\nalphaFunc GT0\ndepthWrite\n}".to_string(),
        "{\nmap g/base.tga\ndepthFunc lequal\n}".to_string(),
        "{\nmap g/base.tga\ndepthFunc nonsense\n}".to_string(),
        "{\nmap g/base.tga\ndepthFunc disable\n}".to_string(),
        "{\nmap g/base.tga\nblendFunc GL_ONE GL_ZERO\n}".to_string(),
    ];
    // behind them, half covered
    let mut board = Board::new(4, Shape::Face, bodies);
    board.script = "g/behind\n{\nsort 12\n{\nmap g/env.tga\nblendFunc add\n}\n}\n".into();
    board
}

fn depth_files() -> Vec<File> {
    let board = depth();
    let mut map = board.map();
    let shader = map.add_shader("g/behind", 0, 1);
    for tile in 0..board.tiles.len() {
        // drawn last, behind the tile and past its edges
        let center = board.center(tile) + glam::Vec3::X * 8.0;
        map.add_quad(shader, screen(center, 36.0, 20.0));
    }
    board.files_with(map)
}

fn images() -> Board {
    Board::new(
        4,
        Shape::Face,
        [
            "{\nmap $whiteimage\n}",
            "{\nmap *white\n}",
            "{\nmap $lightmap\n}",
            "{\nmap g/base\n}",
            "{\nmap g/base.jpg\n}",
            "{\nclampMap g/base.tga\ntcMod scale 2 2\n}",
            "{\nmap g/base.tga\ntcMod scale 2 2\n}",
            "{\nclampMap g/cut.tga\ntcMod scale 3 3\ntcMod scroll -1 -1\nblendFunc blend\n}",
            "{\nanimMap 4 g/frame0.tga g/frame1.tga g/frame2.tga\n}",
            "{\nanimMap 10 g/frame0.tga g/frame1.tga g/frame2.tga g/frame3.tga g/frame4.tga g/frame5.tga g/frame6.tga g/frame7.tga g/frame8.tga g/frame9.tga\n}",
            "{\nanimMap 0.5 g/frame3.tga g/frame7.tga\n}",
            "{\nanimMap 3 g/frame5.tga\n}",
            "{\nmap g/base.tga\nmap g/env.tga\n}",
            "{\nmap g/wide.tga\n}",
            "{\nmap g/grey.tga\n}",
            "nomipmaps\n{\nclampmap g/wide.tga\n}",
        ],
    )
}

/// Two stages that are collapsed into one pass, and those that are not.
fn collapse(shape: Shape) -> Board {
    // Models have no colours.
    let defined = |body: &String| shape != Shape::Model || !body.contains("vertex");
    let second = |first: &str, second: &str| {
        format!("{{\nmap g/base.tga\n{first}\n}}\n{{\nmap g/env.tga\n{second}\n}}")
    };
    let lightmap = |rest: &str| {
        format!("{{\nmap $lightmap\nrgbGen identity\n}}\n{{\nmap g/base.tga\n{rest}\n}}")
    };
    let bodies = [
            lightmap("blendFunc filter\nrgbGen identity"),
            lightmap("blendFunc GL_ZERO GL_SRC_COLOR\nrgbGen identity"),
            lightmap("blendFunc GL_DST_COLOR GL_SRC_COLOR\nrgbGen identity"),
            lightmap("blendFunc add\nrgbGen identity"),
            lightmap("blendFunc filter\nrgbGen vertex"),
            lightmap("blendFunc filter\nrgbGen wave sin 0.5 0.3 0 1"),
            second("rgbGen vertex", "blendFunc filter\nrgbGen vertex"),
            second("rgbGen identityLighting", "blendFunc filter\nrgbGen identityLighting"),
            second("rgbGen wave sin 0.5 0.3 0 1", "blendFunc filter\nrgbGen wave sin 0.5 0.3 0 1"),
            second("rgbGen wave sin 0.5 0.3 0 1", "blendFunc filter\nrgbGen wave sin 0.5 0.3 0.1 1"),
            second("rgbGen const ( 0.5 0.7 0.9 )", "blendFunc filter\nrgbGen const ( 0.5 0.7 0.9 )"),
            second("rgbGen const ( 0.5 0.7 0.9 )", "blendFunc filter\nrgbGen const ( 1 0.2 0.9 )"),
            second("rgbGen identity", "blendFunc add\nrgbGen identity"),
            second("rgbGen vertex", "blendFunc add\nrgbGen vertex"),
            second("blendFunc add\nrgbGen identity", "blendFunc add\nrgbGen identity"),
            second("blendFunc filter\nrgbGen identity", "blendFunc filter\nrgbGen identity"),
            second("blendFunc blend\nrgbGen identity", "blendFunc filter\nrgbGen identity"),
            second("rgbGen identity\nalphaFunc GE128", "blendFunc filter\nrgbGen identity\nalphaFunc GE128"),
            "{\nmap g/cut.tga\nalphaFunc GE128\nrgbGen identity\n}\n{\nmap g/alpha.tga\nalphaFunc GE128\nblendFunc filter\nrgbGen identity\n}".into(),
            "{\nmap g/cut.tga\nalphaFunc GE128\nrgbGen identity\n}\n{\nmap g/alpha.tga\nblendFunc filter\nrgbGen identity\n}".into(),
            second("rgbGen identity\ntcMod scale 2 2", "blendFunc filter\nrgbGen identity\ntcGen environment\ntcMod scroll 0.1 0"),
            second("rgbGen identity\nalphaGen const 0.5", "blendFunc filter\nrgbGen identity\nalphaGen const 0.5"),
            format!("{}\n{{\nmap g/grey.tga\nblendFunc add\nrgbGen wave sin 0.3 0.2 0 1\n}}", lightmap("blendFunc filter\nrgbGen identity")),
            format!("{}\n{{\nmap g/alpha.tga\nblendFunc blend\n}}\n{{\nmap g/grey.tga\nblendFunc filter\n}}", lightmap("blendFunc filter")),
        ];
    Board::new(6, shape, bodies.into_iter().filter(defined))
}

fn details() -> Board {
    Board::new(
        2,
        Shape::Face,
        [
            "{\nmap g/base.tga\n}\n{\nmap g/fine.tga\nblendFunc GL_DST_COLOR GL_SRC_COLOR\ntcMod scale 0.25 0.25\ndetail\n}",
            "{\nmap g/base.tga\n}\n{\nmap g/env.tga\nblendFunc filter\ndetail\n}\n{\nmap g/grey.tga\nblendFunc add\n}",
            "{\nmap g/env.tga\ndetail\n}\n{\nmap g/base.tga\nblendFunc blend\n}",
            "{\nmap g/env.tga\ndetail\n}",
        ],
    )
}

fn films() -> Board {
    Board::new(
        3,
        Shape::Face,
        [
            "{\nvideoMap film.roq\n}",
            "{\nmap g/base.tga\n}\n{\nvideoMap film.roq\nblendFunc add\n}",
            "{\nvideoMap film.roq\ntcMod scale 2 2\n}\n{\nmap $lightmap\nblendFunc filter\n}",
            "{\nmap g/base.tga\n}\n{\nvideoMap missing.roq\n}\n{\nmap g/env.tga\nblendFunc add\n}",
            "{\nvideoMap video/other.roq\nrgbGen vertex\n}",
        ],
    )
    .and(Shape::Model, ["{\nvideoMap film.roq\nrgbGen entity\n}"])
}

fn film_files() -> Vec<File> {
    let mut files = films().files();
    files.extend(["film", "other"].map(|name| (format!("video/{name}.roq"), vec![0; 16])));
    files
}

fn play_films(stage: &mut Stage) -> Result<(), Raised> {
    let frame = |offset: usize| -> Vec<u8> {
        (0..256usize * 256)
            .flat_map(|at| {
                let (x, y) = (at % 256, at / 256);
                let on = ((x + offset) / 32).is_multiple_of(2);
                [x as u8, y as u8, if on { 255 } else { 0 }, 255]
            })
            .collect()
    };
    stage.start_map(super::board::MAP)?;
    let board = films();
    for (name, offset) in [("first", 0), ("second", 16)] {
        stage.set_film(256, frame(offset));
        let view = board.view(stage);
        stage.keep(name, |engine| board.draw(engine, &view))?;
    }
    Ok(())
}

/// The scenes of this module.
pub(super) fn scenes() -> Vec<Scene> {
    scene_list! {
        "blend-pairs": "Every pair of factors.", board(blends(), &[0]), quick: true;
        "blend-alpha": "The same over a first stage with alpha.", board(blends_over_alpha(), &[0]), quick: true;
        "blend-words": "Short names and wrong ones.", board(shorthand(), &[0]);
        "alpha-func": "alphaFunc with and without blending.", board(alpha_tests(), &[0, 700]), quick: true;
        "depth": "depthFunc, depthWrite, their order.",
            calls(|stage| depth().play(stage, &[0])), files: depth_files, quick: true;
        "images": "map, clampMap, animMap.", board(images(), &[0, 337, 1700]), quick: true;
        "collapse": "Stages in one pass.", board(collapse(Shape::Face), &[0]);
        "collapse-soup": "The same by vertex.", board(collapse(Shape::Squares(3)), &[0]);
        "collapse-model": "The same on models.", board(collapse(Shape::Model), &[0]);
        "collapse-vertex-menu": "With r_vertexLight while a menu covers the game.",
            board(collapse(Shape::Face), &[0]), cvars: &[("r_vertexLight", "1"), ("r_uifullscreen", "1")];
        "collapse-vertex": "With r_vertexLight.", board(collapse(Shape::Face), &[0]), cvars: &[("r_vertexLight", "1")];
        "collapse-vertex-model": "With r_vertexLight, models.",
            board(collapse(Shape::Skin), &[0]), cvars: &[("r_vertexLight", "1")];
        "detail": "detail stages.", board(details(), &[0]);
        "detail-off": "detail stages with r_detailtextures 0.",
            board(details(), &[0]), cvars: &[("r_detailtextures", "0")];
        "films": "videoMap.", calls(play_films), files: film_files;
    }
}

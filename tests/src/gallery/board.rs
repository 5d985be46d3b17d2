//! A board of surfaces, one material each, on a wall that the camera faces.

use glam::{Mat3, Vec2, Vec3};
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, GridPoint};

use super::{File, Stage};
use crate::engine::abi::{polyVert_t, refEntity_t};
use crate::engine::{Engine, Raised, View};

/// Name of the board's map.
pub const MAP: &str = "maps/board.bsp";
/// Side of a tile and distance of two tiles' centres, units.
const SIDE: f32 = 64.0;
const STEP: f32 = 76.0;

/// A quad across x that faces back towards the camera.
pub fn screen(center: Vec3, half_width: f32, half_height: f32) -> [Vec3; 4] {
    let (y, z) = (Vec3::Y * half_width, Vec3::Z * half_height);
    [
        center + y + z,
        center - y + z,
        center - y - z,
        center + y - z,
    ]
}

/// What kind of surface a tile is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A planar face with a lightmap.
    Face,
    /// A triangle soup of `n` by `n` squares, each with four vertices of its own. Lit by vertex.
    Squares(u16),
    /// A triangle soup that bulges towards the camera, `n` by `n` squares with common vertices and round normals.
    Dome(u16),
    /// A curved patch with a lightmap.
    Patch,
    /// A model, as an entity that is turned and tinted and has a time of its own; the tile's shader is the entity's.
    Model,
    /// The same; the tile's shader is that of the model's skin.
    Skin,
    /// A polygon that the game adds.
    Poly,
    /// A sprite.
    Sprite,
    /// A 2D picture, drawn after the scene.
    Picture,
}

/// One tile: the body of its shader, between the braces, and its shape.
#[derive(Clone, Debug)]
pub struct Tile {
    /// Lines of the script; empty for a tile without a script, whose texture is `g/base`.
    pub body: String,
    /// Its shape.
    pub shape: Shape,
}

/// Tiles in rows of `columns`, from the upper left.
pub struct Board {
    /// Tiles in a row.
    pub columns: usize,
    /// The tiles.
    pub tiles: Vec<Tile>,
    /// More shaders, whole definitions.
    pub script: String,
}

impl Board {
    /// Tiles of one shape with these bodies.
    pub fn new<S: Into<String>>(
        columns: usize,
        shape: Shape,
        bodies: impl IntoIterator<Item = S>,
    ) -> Self {
        let tile = |body: S| Tile {
            body: body.into(),
            shape,
        };
        Self {
            columns,
            tiles: bodies.into_iter().map(tile).collect(),
            script: String::new(),
        }
    }

    /// A room without tiles, with these shaders.
    pub fn empty(script: &str) -> Self {
        Self {
            script: script.to_string(),
            ..Self::new(4, Shape::Face, [""; 0])
        }
    }

    /// Adds tiles of another shape.
    pub fn and<S: Into<String>>(
        mut self,
        shape: Shape,
        bodies: impl IntoIterator<Item = S>,
    ) -> Self {
        self.tiles.extend(Self::new(1, shape, bodies).tiles);
        self
    }

    /// The shader's name of a tile.
    pub fn name(tile: usize) -> String {
        format!("tile/{tile}")
    }

    fn shader_name(&self, tile: usize) -> String {
        if self.tiles[tile].body.is_empty() {
            "g/base".to_string()
        } else {
            Self::name(tile)
        }
    }

    /// A tile's centre.
    pub fn center(&self, tile: usize) -> Vec3 {
        let rows = self.tiles.len().div_ceil(self.columns);
        let column = (tile % self.columns) as f32 - (self.columns as f32 - 1.0) / 2.0;
        let row = (tile / self.columns) as f32 - (rows as f32 - 1.0) / 2.0;
        Vec3::new(0.0, -column * STEP, -row * STEP)
    }

    /// Where the camera stands so that all tiles are seen.
    pub fn camera(&self) -> Vec3 {
        let rows = self.tiles.len().div_ceil(self.columns);
        let half = (self.columns as f32).max(rows as f32 * 4.0 / 3.0) * STEP / 2.0;
        Vec3::new(-half, 0.0, 0.0)
    }

    /// The script.
    pub fn shaders(&self) -> String {
        let mut text = self.script.clone();
        for (i, tile) in self.tiles.iter().enumerate() {
            if !tile.body.is_empty() {
                text += &format!("\n{}\n{{\n{}\n}}\n", Self::name(i), tile.body);
            }
        }
        text
    }

    /// The map before it is built, so that a scene can add to it.
    pub fn map(&self) -> MapBuilder {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("g/wall", 0, 1);
        let bright = map.add_lightmap([52, 50, 48]);
        let page = map.add_lightmap_with(|column, row| {
            let across = column as f32 / 127.0;
            let down = row as f32 / 127.0;
            [across, down, 1.0 - across].map(|v| (8.0 + 56.0 * v) as u8)
        });
        let reach = self.camera().x.abs() + 160.0;
        map.add_room(
            wall,
            Vec3::new(-reach, -reach, -reach),
            Vec3::new(40.0, reach, reach),
        );
        for surface in 0..6 {
            map.set_lightmap(surface, bright);
        }
        for (i, tile) in self.tiles.iter().enumerate() {
            if matches!(
                tile.shape,
                Shape::Model | Shape::Skin | Shape::Poly | Shape::Sprite | Shape::Picture
            ) {
                continue;
            }
            let shader = map.add_shader(&self.shader_name(i), 0, 1);
            let center = self.center(i);
            match tile.shape {
                Shape::Face => {
                    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
                    let quad = corners.map(|(s, t)| vertex(center, s, t));
                    let surface = map.add_quad(shader, quad.map(|v| v.position));
                    map.vertices_mut(surface).copy_from_slice(&quad);
                    map.set_lightmap(surface, page);
                }
                Shape::Squares(n) => {
                    let mut vertices = Vec::new();
                    let mut indices = Vec::new();
                    for cell in 0..i32::from(n) * i32::from(n) {
                        let n = i32::from(n);
                        let (x, y) = (cell % n, cell / n);
                        for (dx, dy) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                            let at = |v: i32, d: i32| (v + d) as f32 / n as f32;
                            vertices.push(vertex(center, at(x, dx), at(y, dy)));
                        }
                        indices.extend([0, 1, 2, 0, 2, 3].map(|v| cell * 4 + v));
                    }
                    map.add_soup(shader, &vertices, &indices);
                }
                Shape::Dome(n) => {
                    let n = i32::from(n);
                    let mut vertices = Vec::new();
                    for at in 0..(n + 1) * (n + 1) {
                        let (s, t) = (
                            (at % (n + 1)) as f32 / n as f32,
                            (at / (n + 1)) as f32 / n as f32,
                        );
                        let mut v = vertex(center, s, t);
                        let (x, y) = (s * 2.0 - 1.0, t * 2.0 - 1.0);
                        v.position.x -= 12.0 * (2.0 - x * x - y * y);
                        v.normal = Vec3::new(-1.0, -x * 0.7, -y * 0.7).normalize();
                        vertices.push(v);
                    }
                    let mut indices = Vec::new();
                    for cell in 0..n * n {
                        let first = cell / n * (n + 1) + cell % n;
                        let below = first + n + 1;
                        indices.extend([first, first + 1, below + 1, first, below + 1, below]);
                    }
                    map.add_soup(shader, &vertices, &indices);
                }
                Shape::Patch => {
                    let points: Vec<DrawVert> = (0..9)
                        .map(|at| {
                            // Rows run upwards, so that the front is where the camera is.
                            let (s, t) = ((at % 3) as f32 / 2.0, (2 - at / 3) as f32 / 2.0);
                            let mut v = vertex(center, s, t);
                            v.position.x -= if at % 3 == 1 { 48.0 } else { 0.0 };
                            v
                        })
                        .collect();
                    let surface = map.add_patch(shader, 3, 3, &points);
                    map.set_lightmap(surface, page);
                }
                Shape::Model | Shape::Skin | Shape::Poly | Shape::Sprite | Shape::Picture => {}
            }
        }
        map
    }

    /// The script and the map.
    pub fn files(&self) -> Vec<File> {
        self.files_with(self.map())
    }

    /// The same with the map as the scene has changed it. Its light grid changes from place to place.
    pub fn files_with(&self, map: MapBuilder) -> Vec<File> {
        let bsp = map.build_with_grid(Vec3::new(64.0, 64.0, 128.0), |at| GridPoint {
            ambient: [30 + (at.y.abs() as u8 % 40), 40, 50],
            directed: [120, 100, 60 + (at.z.abs() as u8 % 60)],
            longitude: 40,
            latitude: 100,
        });
        let mut files = super::model::files();
        for tile in self.of(Shape::Skin) {
            let line = format!("body,{}\n", self.shader_name(tile));
            files.push((format!("tile/{tile}.skin"), line.into_bytes()));
        }
        files.extend([
            (
                "scripts/board.shader".to_string(),
                self.shaders().into_bytes(),
            ),
            (MAP.to_string(), bsp.write()),
        ]);
        files
    }

    /// The camera before the board.
    pub fn view(&self, stage: &Stage) -> View {
        stage.view(self.camera(), 0.0)
    }

    /// Loads the map and keeps pictures at times, milliseconds after the scene's beginning.
    pub fn play(&self, stage: &mut Stage, times: &[i32]) -> Result<(), Raised> {
        stage.start_map(MAP)?;
        for time in times {
            stage.set_time(*time);
            let view = self.view(stage);
            stage.keep(&format!("t{time}"), |engine| self.draw(engine, &view))?;
        }
        Ok(())
    }

    /// Draws the scene: the map, what the tiles add to it, and the pictures.
    pub fn draw(&self, engine: &mut Engine, view: &View) -> Result<(), Raised> {
        engine.clear_scene()?;
        self.add(engine)?;
        engine.render_scene(view)?;
        self.draw_pictures(engine, view)
    }

    fn of(&self, shape: Shape) -> impl Iterator<Item = usize> {
        (0..self.tiles.len()).filter(move |&i| self.tiles[i].shape == shape)
    }

    fn shader(&self, engine: &mut Engine, tile: usize) -> Result<i32, Raised> {
        engine.register_shader(&self.shader_name(tile))
    }

    /// Adds entities and polygons to the scene.
    pub fn add(&self, engine: &mut Engine) -> Result<(), Raised> {
        let turn = Mat3::from_rotation_x(0.4) * Mat3::from_rotation_z(0.2);
        for tile in self.of(Shape::Model).chain(self.of(Shape::Skin)) {
            let skin = self.tiles[tile].shape == Shape::Skin;
            let [shader, skin] = if skin {
                [0, engine.register_skin(&format!("tile/{tile}.skin"))?]
            } else {
                [self.shader(engine, tile)?, 0]
            };
            let entity = refEntity_t {
                hModel: engine.register_model("g/dome.md3")?,
                customShader: shader,
                customSkin: skin,
                origin: self.center(tile).to_array(),
                axis: turn.to_cols_array_2d(),
                frame: 1,
                shaderRGBA: [220, 140, 60, 150],
                shaderTexCoord: [0.31, -0.73],
                shaderTime: 1.5,
                ..refEntity_t::default()
            };
            engine.add_entity(&entity)?;
        }
        for tile in self.of(Shape::Sprite) {
            let entity = refEntity_t {
                reType: 2,
                customShader: self.shader(engine, tile)?,
                origin: self.center(tile).to_array(),
                shaderRGBA: [60, 220, 140, 180],
                shaderTexCoord: [0.31, -0.73],
                shaderTime: 0.25,
                radius: SIDE / 2.0,
                rotation: 30.0,
                ..refEntity_t::default()
            };
            engine.add_entity(&entity)?;
        }
        for tile in self.of(Shape::Poly) {
            let shader = self.shader(engine, tile)?;
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(s, t)| {
                let v = vertex(self.center(tile), s, t);
                polyVert_t {
                    xyz: v.position.to_array(),
                    st: v.st.to_array(),
                    modulate: v.color.map(|c| c.saturating_mul(3)),
                }
            });
            engine.add_poly(shader, &corners, 4)?;
        }
        Ok(())
    }

    /// Draws the 2D pictures where their tiles are seen.
    pub fn draw_pictures(&self, engine: &mut Engine, view: &View) -> Result<(), Raised> {
        let scale = view.width as f32 / 2.0 / self.camera().x.abs();
        for tile in self.of(Shape::Picture) {
            let shader = self.shader(engine, tile)?;
            let center = self.center(tile);
            let x = view.width as f32 / 2.0 + (-center.y - SIDE / 2.0) * scale;
            let y = view.height as f32 / 2.0 + (-center.z - SIDE / 2.0) * scale;
            let side = SIDE * scale;
            engine.set_color(Some([0.9, 0.6, 0.3, 0.7]))?;
            engine.draw_stretch_pic([x, y, side, side], [0.0, 0.0, 1.0, 1.0], shader)?;
        }
        engine.set_color(None)
    }
}

/// A vertex of a tile at texture coordinates `(s, t)`, with a colour and an alpha of its own.
fn vertex(center: Vec3, s: f32, t: f32) -> DrawVert {
    let shade = |v: f32| (v * 63.0) as u8;
    DrawVert {
        position: center + Vec3::new(0.0, (0.5 - s) * SIDE, (0.5 - t) * SIDE),
        st: Vec2::new(s, t),
        lightmap: Vec2::new(0.02 + 0.96 * s, 0.02 + 0.96 * t),
        normal: -Vec3::X,
        color: [
            shade(s),
            shade(t),
            shade(1.0 - s * t),
            (255.0 * (1.0 - 0.7 * s)) as u8,
        ],
    }
}

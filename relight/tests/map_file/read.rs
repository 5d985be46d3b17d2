//! A reader of `.map` files with brushes in either form and patches, as a compiler reads them: planes from three points,
//! textures from the numbers of the line.

use glam::{DVec2, DVec3};

/// An entity of the file.
#[derive(Default)]
pub struct Entity {
    pub pairs: Vec<(String, String)>,
    pub brushes: Vec<Vec<Face>>,
    pub patches: Vec<Patch>,
}

impl Entity {
    /// Where the entity's brushes were moved to.
    pub fn origin(&self) -> DVec3 {
        let found = self.pairs.iter().find(|(key, _)| key == "origin");
        let numbers = found.map_or(Vec::new(), |(_, value)| {
            let words = value.split_whitespace();
            words.filter_map(|w| w.parse::<f64>().ok()).collect()
        });
        match numbers[..] {
            [x, y, z, ..] => DVec3::new(x, y, z),
            _ => DVec3::ZERO,
        }
    }
}

/// A side of a brush.
pub struct Face {
    pub normal: DVec3,
    pub dist: f64,
    pub name: String,
    pub contents: u32,
    /// Size of the image, texels.
    pub image: DVec2,
    texture: Texture,
}

enum Texture {
    /// Rows over the axes of the plane.
    Matrix([[f64; 3]; 2]),
    /// Axis, offset and scale of each coordinate, in texels.
    Valve([(DVec3, f64, f64); 2]),
    /// Shifts, angle in degrees, scales.
    Classic([f64; 5]),
}

impl Face {
    /// The texture's coordinates at a place.
    pub fn st(&self, p: DVec3) -> DVec2 {
        match &self.texture {
            Texture::Matrix([s, t]) => {
                let [u, v] = axes_of(self.normal);
                let at = DVec3::new(p.dot(u), p.dot(v), 1.0);
                DVec2::new(DVec3::from_array(*s).dot(at), DVec3::from_array(*t).dot(at))
            }
            Texture::Classic([s0, t0, angle, s_scale, t_scale]) => {
                // Axes of floors, walls along y, walls along x; the one faced most.
                let n = self.normal.abs();
                let (u, v) = if n.z + 1e-4 >= n.x && n.z + 1e-4 >= n.y {
                    (DVec2::new(1.0, 0.0), p.truncate())
                } else if n.x + 1e-4 >= n.y {
                    (DVec2::new(1.0, 0.0), DVec2::new(p.y, p.z))
                } else {
                    (DVec2::new(1.0, 0.0), DVec2::new(p.x, p.z))
                };
                let turn = |w: DVec2| DVec2::from_angle(angle.to_radians()).rotate(w);
                let s = turn(u).dot(v) / s_scale + s0;
                let t = turn(DVec2::new(0.0, -1.0)).dot(v) / t_scale + t0;
                DVec2::new(s, t) / self.image
            }
            Texture::Valve([s, t]) => {
                let at = |(axis, offset, scale): &(DVec3, f64, f64)| axis.dot(p) / scale + offset;
                DVec2::new(at(s), at(t)) / self.image
            }
        }
    }
}

/// The axes that the matrix of a brush primitive is over: turn y towards the normal about z, then tilt.
fn axes_of(normal: DVec3) -> [DVec3; 2] {
    let clean = |v: f64| if v.abs() < 1e-6 { 0.0 } else { v };
    let (x, y, z) = (clean(normal.x), clean(normal.y), clean(normal.z));
    let heading = y.atan2(x);
    let pitch = -z.atan2((x * x + y * y).sqrt());
    [
        DVec3::new(-heading.sin(), heading.cos(), 0.0),
        DVec3::new(
            -pitch.sin() * heading.cos(),
            -pitch.sin() * heading.sin(),
            -pitch.cos(),
        ),
    ]
}

/// A curve.
pub struct Patch {
    pub name: String,
    pub width: usize,
    pub height: usize,
    /// Row after row, as the compiled map has them.
    pub points: Vec<(DVec3, DVec2)>,
}

struct Words<'a> {
    words: Vec<&'a str>,
    at: usize,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Words<'a> {
        let mut words = Vec::new();
        for line in text.lines().filter(|l| !l.starts_with("//")) {
            match line.starts_with('"') {
                true => words.extend(line.split('"').filter(|w| !w.is_empty() && *w != " ")),
                false => words.extend(line.split_whitespace()),
            }
        }
        Words { words, at: 0 }
    }

    fn peek(&self) -> Option<&'a str> {
        self.words.get(self.at).copied()
    }

    fn next(&mut self) -> &'a str {
        let word = self.peek().expect("the file ends early");
        self.at += 1;
        word
    }

    fn expect(&mut self, word: &str) {
        assert_eq!(self.next(), word, "at word {}", self.at);
    }

    fn number(&mut self) -> f64 {
        let word = self.next();
        word.parse()
            .unwrap_or_else(|_| panic!("{word} at {}", self.at))
    }

    fn point(&mut self) -> DVec3 {
        self.expect("(");
        let p = DVec3::new(self.number(), self.number(), self.number());
        self.expect(")");
        p
    }

    fn row(&mut self, open: &str, close: &str) -> Vec<f64> {
        self.expect(open);
        let mut row = Vec::new();
        while self.peek() != Some(close) {
            row.push(self.number());
        }
        self.expect(close);
        row
    }
}

/// Reads a file.
pub fn read(text: &str) -> Vec<Entity> {
    let mut words = Words::new(text);
    let mut entities = Vec::new();
    while words.peek().is_some() {
        words.expect("{");
        entities.push(entity(&mut words));
    }
    entities
}

fn entity(words: &mut Words<'_>) -> Entity {
    let mut entity = Entity::default();
    loop {
        match words.next() {
            "}" => return entity,
            "{" => match words.peek() {
                Some("patchDef2") => entity.patches.push(patch(words)),
                Some("brushDef") => {
                    words.expect("brushDef");
                    words.expect("{");
                    entity.brushes.push(faces(words));
                    words.expect("}");
                }
                _ => entity.brushes.push(faces(words)),
            },
            key => {
                let value = words.next();
                entity.pairs.push((key.to_owned(), value.to_owned()));
            }
        }
    }
}

fn faces(words: &mut Words<'_>) -> Vec<Face> {
    let mut faces = Vec::new();
    while words.peek() == Some("(") {
        let [a, b, c] = [words.point(), words.point(), words.point()];
        let normal = (a - b).cross(c - b).normalize();
        let primitive = words.peek() == Some("(");
        let (name, texture) = if primitive {
            words.expect("(");
            let [s, t] = [(); 2].map(|()| words.row("(", ")").try_into().unwrap());
            words.expect(")");
            (words.next().to_owned(), Texture::Matrix([s, t]))
        } else {
            let name = words.next().to_owned();
            match words.peek() {
                Some("[") => {
                    let rows = [(); 2].map(|()| words.row("[", "]"));
                    assert_eq!(words.number(), 0.0);
                    let scales = [words.number(), words.number()];
                    let axis = |k: usize| {
                        let row = &rows[k];
                        (DVec3::new(row[0], row[1], row[2]), row[3], scales[k])
                    };
                    (name, Texture::Valve([axis(0), axis(1)]))
                }
                _ => (name, Texture::Classic([(); 5].map(|()| words.number()))),
            }
        };
        let contents = words.number() as u32;
        words.expect("0");
        words.expect("0");
        faces.push(Face {
            normal,
            dist: normal.dot(b),
            name,
            contents,
            image: DVec2::splat(64.0),
            texture,
        });
    }
    words.expect("}");
    faces
}

fn patch(words: &mut Words<'_>) -> Patch {
    words.expect("patchDef2");
    words.expect("{");
    let name = words.next().to_owned();
    let size = words.row("(", ")");
    let (width, height) = (size[0] as usize, size[1] as usize);
    let mut points = vec![(DVec3::ZERO, DVec2::ZERO); width * height];
    words.expect("(");
    for column in 0..width {
        words.expect("(");
        for row in 0..height {
            let p = words.row("(", ")");
            points[row * width + column] = (DVec3::new(p[0], p[1], p[2]), DVec2::new(p[3], p[4]));
        }
        words.expect(")");
    }
    for close in [")", "}", "}"] {
        words.expect(close);
    }
    Patch {
        name,
        width,
        height,
        points,
    }
}

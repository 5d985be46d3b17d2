//! How textures lie on the sides of brushes, recovered from the surfaces that the compiler drew for them.

use crate::files::GameFiles;
use crate::image;
use crate::world::RelitWorld;
use glam::{DVec2, DVec3};
use q3bsp::SurfaceKind;
use std::collections::HashMap;

/// Cosine of the largest angle between a side and a triangle drawn for it.
const PARALLEL: f64 = 0.999;

/// Largest distance between them, id units.
const NEAR: f64 = 0.25;

/// Texels per id unit where nothing tells, the editors' default.
const DEFAULT_SCALE: f64 = 0.5;

/// Width and height of a texture that cannot be read: the editors' stand-in.
const UNKNOWN_SIZE: (u32, u32) = (64, 64);

/// A texture on a plane: each coordinate, in texels, is `axis · p / scale + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    /// Unit vectors along the texture.
    pub axes: [DVec3; 2],
    /// Texels at the origin.
    pub offsets: [f64; 2],
    /// Units per texel.
    pub scales: [f64; 2],
}

/// A drawn triangle with its texture.
struct Triangle {
    normal: DVec3,
    corners: [DVec3; 3],
    st: [DVec2; 3],
}

/// The drawn flat triangles of a world by model and shader.
pub(super) struct Drawn {
    triangles: HashMap<(u32, String), Vec<Triangle>>,
}

impl Drawn {
    pub(super) fn new(world: &RelitWorld) -> Drawn {
        let bsp = &world.bsp;
        let mut triangles: HashMap<_, Vec<Triangle>> = HashMap::new();
        for (stored, surface) in bsp.surfaces.iter().zip(&world.surfaces) {
            if !matches!(stored.kind, SurfaceKind::Planar | SurfaceKind::TriangleSoup) {
                continue;
            }
            let shader = usize::try_from(stored.shader).ok();
            let Some(shader) = shader.and_then(|at| bsp.shaders.get(at)) else {
                continue;
            };
            let vertices = bsp.surface_vertices(stored);
            let key = (surface.model, shader.name.to_ascii_lowercase());
            let list = triangles.entry(key).or_default();
            for corners in bsp.surface_indices(stored).as_chunks::<3>().0 {
                let vertex = |at: usize| {
                    let index = usize::try_from(*corners.get(at)?).ok()?;
                    let vertex = vertices.get(index)?;
                    vertex.is_finite().then_some(vertex)
                };
                let (Some(a), Some(b), Some(c)) = (vertex(0), vertex(1), vertex(2)) else {
                    continue;
                };
                let corners = [a, b, c].map(|v| v.position.as_dvec3());
                let front = (corners[2] - corners[0]).cross(corners[1] - corners[0]);
                // Slivers tell nothing reliable.
                if front.length() > 0.5 {
                    list.push(Triangle {
                        normal: front.normalize(),
                        corners,
                        st: [a, b, c].map(|v| v.st.as_dvec2()),
                    });
                }
            }
        }
        Drawn { triangles }
    }

    /// The projection of the texture of `size` texels on a side, from the largest triangle drawn on it; `None` when
    /// none was.
    pub(super) fn projection(
        &self,
        model: u32,
        shader: &str,
        normal: DVec3,
        winding: &[DVec3],
        size: (u32, u32),
    ) -> Option<Projection> {
        let on = *winding.first()?;
        let list = self.triangles.get(&(model, shader.to_ascii_lowercase()))?;
        let fits = |t: &&Triangle| {
            t.normal.dot(normal) > PARALLEL
                && t.corners.iter().all(|c| (*c - on).dot(normal).abs() < NEAR)
                && overlaps(winding, normal, t)
        };
        let area = |t: &Triangle| {
            let [a, b, c] = t.corners;
            (b - a).cross(c - a).length()
        };
        let found = list.iter().filter(fits);
        let largest = found.max_by(|a, b| area(a).total_cmp(&area(b)))?;
        projection_of(largest, size)
    }
}

/// Whether the middle of the triangle lies on the side, or the middle of the side on the triangle.
fn overlaps(winding: &[DVec3], normal: DVec3, triangle: &Triangle) -> bool {
    let middle = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len().max(1) as f64;
    inside(winding, normal, middle(&triangle.corners))
        || inside(&triangle.corners, normal, middle(winding))
}

/// Whether a point of its plane is inside a polygon, which is clockwise seen from where the normal points.
fn inside(polygon: &[DVec3], normal: DVec3, point: DVec3) -> bool {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).all(|(&a, &b)| {
        let inwards = (b - a).cross(normal);
        (point - a).dot(inwards) >= -NEAR * inwards.length()
    })
}

/// The projection that gives a triangle's corners their coordinates, along the triangle's own plane.
fn projection_of(triangle: &Triangle, (width, height): (u32, u32)) -> Option<Projection> {
    let [a, b, c] = triangle.corners;
    let (e, f) = (b - a, c - a);
    // Dual basis of the edges in the plane.
    let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
    let determinant = ee * ff - ef * ef;
    if determinant <= 0.0 {
        return None;
    }
    let dual_e = (e * ff - f * ef) / determinant;
    let dual_f = (f * ee - e * ef) / determinant;
    let [sa, sb, sc] = triangle.st;
    let size = DVec2::new(f64::from(width), f64::from(height));
    let mut projection = Projection {
        axes: [DVec3::ZERO; 2],
        offsets: [0.0; 2],
        scales: [1.0; 2],
    };
    for at in 0..2 {
        let gradient = (dual_e * (sb[at] - sa[at]) + dual_f * (sc[at] - sa[at])) * size[at];
        let length = gradient.length();
        if !(length > 1e-6 && length < 1e6) {
            return None;
        }
        projection.axes[at] = gradient / length;
        projection.scales[at] = 1.0 / length;
        projection.offsets[at] = sa[at] * size[at] - gradient.dot(a);
    }
    // An image repeats: small offsets read better.
    projection.offsets[0] = projection.offsets[0].rem_euclid(size.x);
    projection.offsets[1] = projection.offsets[1].rem_euclid(size.y);
    Some(projection)
}

/// A texture laid on along the axes that the plane faces least, where nothing tells.
pub(super) fn default_projection(normal: DVec3) -> Projection {
    let n = normal.abs();
    let axes = if n.z >= n.x && n.z >= n.y {
        [DVec3::X, -DVec3::Y]
    } else if n.x >= n.y {
        [DVec3::Y, -DVec3::Z]
    } else {
        [DVec3::X, -DVec3::Z]
    };
    Projection {
        axes,
        offsets: [0.0; 2],
        scales: [DEFAULT_SCALE; 2],
    }
}

/// Sizes of the pictures that compilers measure textures by, each looked up once.
pub(super) struct Sizes<'a> {
    files: &'a dyn GameFiles,
    world: &'a RelitWorld,
    known: HashMap<String, (u32, u32)>,
}

impl<'a> Sizes<'a> {
    pub(super) fn new(files: &'a dyn GameFiles, world: &'a RelitWorld) -> Sizes<'a> {
        Sizes {
            files,
            world,
            known: HashMap::new(),
        }
    }

    /// The size of the picture of a shader that surfaces use: the editor's, the one of its name, that of its first
    /// stage.
    pub(super) fn of(&mut self, shader: &str) -> (u32, u32) {
        if let Some(&size) = self.known.get(shader) {
            return size;
        }
        let mut materials = self.world.materials.iter();
        let material = materials.find(|m| m.name.eq_ignore_ascii_case(shader));
        // What is drawn for a material without a script is its image, or a stand-in whose size says nothing.
        let definition = material.and_then(|m| m.resolved.script.as_ref());
        let editor = definition.and_then(|d| d.light.editor_image.as_deref());
        let stage = definition.and_then(|d| d.image_names().next());
        let mut names = [editor, Some(shader), stage].into_iter().flatten();
        let size = names.find_map(|name| image::texture_size(self.files, name));
        let size = size.unwrap_or(UNKNOWN_SIZE);
        self.known.insert(shader.to_owned(), size);
        size
    }
}

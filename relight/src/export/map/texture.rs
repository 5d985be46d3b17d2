//! How textures lie on the sides of brushes, recovered from the surfaces that the compiler drew for them.

use crate::files::GameFiles;
use crate::image;
use crate::world::RelitWorld;
use glam::{DVec2, DVec3};
use q3bsp::{DrawVert, SurfaceKind};
use std::collections::HashMap;

/// Cosine of the largest angle between a side and a triangle drawn for it.
const PARALLEL: f64 = 0.999;

/// Largest distance between them, id units.
const NEAR: f64 = 0.25;

/// Id units per texel by default, as in editors.
const DEFAULT_SCALE: f64 = 0.5;

/// Width and height of a texture that cannot be read: the editors' stand-in.
const UNKNOWN_SIZE: (u32, u32) = (64, 64);

/// A texture on a plane: each coordinate, in repetitions of the image, is `gradient · p + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Projection {
    /// Change of each coordinate in space; neither is zero.
    pub gradients: [DVec3; 2],
    /// Coordinates at the origin.
    pub offsets: [f64; 2],
}

impl Projection {
    /// The same texture on a plane that was moved.
    pub(super) fn moved(self, by: DVec3) -> Projection {
        let [s, t] = self.gradients;
        let [s0, t0] = self.offsets;
        // An image repeats: small offsets read better.
        let offsets = [s0 - s.dot(by), t0 - t.dot(by)].map(|v| v - v.floor());
        Projection { offsets, ..self }
    }
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
            let vertices = bsp.surface_vertices(stored);
            let shader = &bsp.shader(stored.shader).name;
            let key = (surface.model, shader.to_ascii_lowercase());
            let list = triangles.entry(key).or_default();
            for corners in bsp.surface_triangles(stored) {
                let finite = |v: &&DrawVert| v.is_finite();
                let [Some(a), Some(b), Some(c)] =
                    corners.map(|at| vertices.get(at as usize).filter(finite))
                else {
                    // Shipped maps have vertices that are not numbers.
                    continue;
                };
                let corners = [a, b, c].map(|v| v.position.as_dvec3());
                let front = (corners[2] - corners[0]).cross(corners[1] - corners[0]);
                // Slivers have no reliable projection.
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

    /// The projection of the texture on a side, from the largest triangle drawn on it, and whether that shows the side's
    /// front; `None` when none was.
    pub(super) fn projection(
        &self,
        model: u32,
        shader: &str,
        normal: DVec3,
        winding: &[DVec3],
    ) -> Option<(Projection, bool)> {
        let on = *winding.first()?;
        let list = self.triangles.get(&(model, shader.to_ascii_lowercase()))?;
        let fits = |t: &&Triangle| {
            t.normal.dot(normal).abs() > PARALLEL
                && t.corners.iter().all(|c| (*c - on).dot(normal).abs() < NEAR)
                && overlaps(winding, normal, t)
        };
        let area = |t: &Triangle| {
            let [a, b, c] = t.corners;
            (b - a).cross(c - a).length()
        };
        let in_front = |t: &Triangle| t.normal.dot(normal) > 0.0;
        // If only the back is drawn, as of a fog or a liquid seen from inside, it decides.
        let better = |a: &&Triangle, b: &&Triangle| {
            let sides = in_front(a).cmp(&in_front(b));
            sides.then(area(a).total_cmp(&area(b)))
        };
        let largest = list.iter().filter(fits).max_by(better)?;
        Some((projection_of(largest)?, in_front(largest)))
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
fn projection_of(triangle: &Triangle) -> Option<Projection> {
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
    let coordinate = |a_at: f64, b_at: f64, c_at: f64| {
        let gradient = dual_e * (b_at - a_at) + dual_f * (c_at - a_at);
        let plausible = gradient.length() > 1e-8 && gradient.length() < 1e4;
        plausible.then(|| (gradient, a_at - gradient.dot(a)))
    };
    let (s, s0) = coordinate(sa.x, sb.x, sc.x)?;
    let (t, t0) = coordinate(sa.y, sb.y, sc.y)?;
    Some(Projection {
        gradients: [s, t],
        offsets: [s0, t0],
    })
}

/// The default projection: along the axes that the plane faces least.
pub(super) fn default_projection(normal: DVec3, (width, height): (u32, u32)) -> Projection {
    let n = normal.abs();
    let axes = if n.z >= n.x && n.z >= n.y {
        [DVec3::X, -DVec3::Y]
    } else if n.x >= n.y {
        [DVec3::Y, -DVec3::Z]
    } else {
        [DVec3::X, -DVec3::Z]
    };
    let [s, t] = axes;
    let size = [width, height].map(|texels| f64::from(texels.max(1)) * DEFAULT_SCALE);
    Projection {
        gradients: [s / size[0], t / size[1]],
        offsets: [0.0; 2],
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
        // A material without a script shows its image, or a stand-in of arbitrary size.
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

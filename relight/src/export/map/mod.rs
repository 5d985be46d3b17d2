//! Maps as level editors and map compilers read them: brushes from their planes, patches, entities.
//!
//! Brushes are written with their planes, and with the textures that the compiler drew on them: the way they lie comes
//! from the surfaces drawn on a side; sides on which nothing was drawn get the editors' default. [`form`] has the
//! ways to say it. Patches are `patchDef2` with their control points and coordinates. Numbers are id units, whatever
//! the scale asked for is.
//!
//! Brushes that the compiler did not divide the world by are marked as detail: solid ones in whose middle the tree has
//! an open leaf.
//!
//! Source of the forms: the map files of Quake III's editors, and Valve's extension of Quake's form of 1998.

mod form;
mod texture;
mod winding;

use super::{Export, ExportError, ExportReport, Output};
use crate::world::RelitWorld;
use form::{Form, numbers};
use glam::{DVec3, Vec3};
use q3bsp::{Brush, Bsp, Entity, Model, ShaderId, Surface, SurfaceKind, content_flags};
use std::fmt::Write;
use texture::{Drawn, Sizes, default_projection};
use winding::{Side, plane_points, sides};

/// The folder that compilers put before every name.
const FOLDER: &str = "textures/";

/// Name for sides whose shader has none that the form could say.
const NO_NAME: &str = "common/caulk";

/// What was written and what could not be.
#[derive(Default)]
struct Tally {
    brushes: usize,
    sides: usize,
    /// Sides with the texture of a drawn surface.
    aligned: usize,
    open: usize,
    /// Sides whose texture the form cannot say.
    sheared: usize,
    /// Brushes marked as detail.
    detail: usize,
    patches: usize,
    meshes: usize,
    foreign_names: usize,
}

/// Writes a map.
///
/// # Errors
/// [`ExportError::Write`].
pub(super) fn write(source: &Export<'_>, output: &mut Output) -> Result<ExportReport, ExportError> {
    let (text, tally) = document(source);
    output.write_main(text.as_bytes())?;
    let mut warnings = Vec::new();
    for (count, what) in [
        (tally.open, "brushes are not closed, and left out"),
        (
            tally.meshes,
            "meshes of triangles have no place in a .map: models, or surfaces whose brushes are there",
        ),
        (
            tally.sheared,
            "sides have textures that are sheared, which classic lines cannot say",
        ),
        (
            tally.foreign_names,
            "names are not below textures/, where compilers look for them",
        ),
    ] {
        if count > 0 {
            warnings.push(format!("{count} {what}"));
        }
    }
    let bsp = &source.world.bsp;
    if bsp.brushes.is_empty() && !bsp.surfaces.is_empty() {
        let format = bsp.format;
        warnings.push(format!(
            "{format}: the file has no brushes; walls are missing"
        ));
    }
    Ok(ExportReport {
        triangles: tally.sides,
        vertices: tally.brushes,
        materials: bsp.shaders.len(),
        warnings,
        ..ExportReport::default()
    })
}

/// The file of a map.
fn document(source: &Export<'_>) -> (String, Tally) {
    let mut writer = Writer {
        form: Form::of(source.options.brushes, source.world.bsp.format),
        world: source.world,
        drawn: Drawn::new(source.world),
        sizes: Sizes::new(source.files, source.world),
        out: String::new(),
        tally: Tally::default(),
    };
    let entities = source.world.bsp.entities();
    if entities.is_empty() {
        // Compilers want a world.
        let pairs = vec![("classname".to_owned(), "worldspawn".to_owned())];
        writer.entity(0, &Entity { pairs });
    }
    for (number, entity) in entities.iter().enumerate() {
        writer.entity(number, entity);
    }
    (writer.out, writer.tally)
}

struct Writer<'a> {
    form: Form,
    world: &'a RelitWorld,
    drawn: Drawn,
    sizes: Sizes<'a>,
    out: String,
    tally: Tally,
}

impl Writer<'_> {
    fn line(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = writeln!(self.out, "{text}");
    }

    fn entity(&mut self, number: usize, entity: &Entity) {
        let bsp = &self.world.bsp;
        let model = match number {
            0 => Some(0),
            _ => entity.brush_model().filter(|&n| n < bsp.models.len()),
        };
        self.line(format_args!("// entity {number}\n{{"));
        if number == 0 && self.form == Form::Valve && entity.get("mapversion").is_none() {
            self.line(format_args!("\"mapversion\" \"220\""));
        }
        for (key, value) in &entity.pairs {
            // The number of its model is the compiler's.
            let of_compiler = model.is_some_and(|n| n > 0) && key.eq_ignore_ascii_case("model");
            if !of_compiler && !key.is_empty() && !value.is_empty() {
                let clean = |text: &str| text.replace(['"', '\n', '\r'], " ");
                self.line(format_args!("\"{}\" \"{}\"", clean(key), clean(value)));
            }
        }
        if let Some((number, model)) = model.and_then(|n| Some((n, bsp.models.get(n)?))) {
            let origin = match number {
                0 => Vec3::ZERO,
                // The compiler takes it off again.
                _ => entity.vec3("origin").unwrap_or(Vec3::ZERO),
            };
            self.model(number, model, origin);
        }
        self.line(format_args!("}}"));
    }

    fn model(&mut self, number: usize, model: &Model, origin: Vec3) {
        let bsp = &self.world.bsp;
        let of_model = u32::try_from(number).unwrap_or(u32::MAX);
        let mut written = 0;
        for brush in bsp.brushes_of(model) {
            match sides(bsp, brush) {
                Some(sides) => {
                    let contents = match number == 0 && is_detail(bsp, brush, &sides) {
                        true => content_flags::DETAIL,
                        false => 0,
                    };
                    self.tally.detail += usize::from(contents != 0);
                    let (begin, end) = match self.form {
                        Form::Primitives => ("{\nbrushDef\n{", "}\n}"),
                        Form::Valve | Form::Classic => ("{", "}"),
                    };
                    self.line(format_args!("// brush {written}\n{begin}"));
                    for side in &sides {
                        self.side(of_model, brush, side, origin, contents);
                    }
                    self.line(format_args!("{end}"));
                    self.tally.brushes += 1;
                    written += 1;
                }
                None => self.tally.open += 1,
            }
        }
        for surface in bsp.surfaces_of(model) {
            match surface.kind {
                SurfaceKind::Patch => self.patch(surface, origin),
                SurfaceKind::TriangleSoup | SurfaceKind::Foliage => self.tally.meshes += 1,
                _ => {}
            }
        }
    }

    /// A shader's name as the form has it: without the folder, which compilers put before it.
    fn name(&mut self, shader: ShaderId) -> String {
        let name = shader_name(&self.world.bsp, shader);
        let stem = match name.split_at_checked(FOLDER.len()) {
            Some((folder, stem)) if folder.eq_ignore_ascii_case(FOLDER) => stem,
            _ => {
                self.tally.foreign_names += usize::from(!name.is_empty());
                name
            }
        };
        // A name ends at white space, and brackets begin other things.
        match stem.is_empty() || stem.contains(|c: char| c <= ' ' || "\"()[]{}".contains(c)) {
            true => NO_NAME.to_owned(),
            false => stem.to_owned(),
        }
    }

    fn side(&mut self, model: u32, brush: &Brush, side: &Side, origin: Vec3, contents: u32) {
        let bsp = &self.world.bsp;
        let shader = shader_name(bsp, side.shader).to_owned();
        let found = self
            .drawn
            .projection(model, &shader, side.normal, &side.winding);
        // What a brush is comes from all its sides: one of a fog on a wall, which shows nothing there, would let the
        // world leak.
        let shown = found.is_some_and(|(_, in_front)| in_front);
        let solid = |shader| bsp.shader(shader).content_flags & content_flags::SOLID != 0;
        let foreign = !shown && solid(brush.shader) && !solid(side.shader);
        let named = if foreign { brush.shader } else { side.shader };
        let found = found.map(|(texture, _)| texture).filter(|_| !foreign);
        self.tally.sides += 1;
        self.tally.aligned += usize::from(found.is_some());
        let size = match (found, self.form) {
            // The matrix needs none.
            (Some(_), Form::Primitives) => (1, 1),
            _ => self.sizes.of(&shader),
        };
        let origin = origin.as_dvec3();
        let texture = found.unwrap_or_else(|| default_projection(side.normal, size));
        let texture = texture.moved(origin);
        let points = plane_points(side, origin);
        let name = self.name(named);
        let line = self.form.side(points, &name, &texture, size, contents);
        self.tally.sheared += usize::from(!line.exact);
        self.line(format_args!("{}", line.text));
    }

    fn patch(&mut self, surface: &Surface, origin: Vec3) {
        let bsp = &self.world.bsp;
        let points = bsp.surface_vertices(surface);
        // Checked by `Bsp::validate`.
        let [width, height] =
            [surface.patch_width, surface.patch_height].map(|n| n.max(0) as usize);
        let name = self.name(surface.shader);
        self.tally.patches += 1;
        self.line(format_args!(
            "{{\npatchDef2\n{{\n{name}\n( {width} {height} 0 0 0 )\n("
        ));
        for column in 0..width {
            let mut row = String::from("(");
            for at in 0..height {
                let vertex = points.get(at * width + column).map(q3bsp::DrawVert::finite);
                if let Some(vertex) = vertex {
                    let place = numbers((vertex.position + origin).as_dvec3());
                    let [s, t] = vertex.st.to_array().map(|v| number(f64::from(v)));
                    row += &format!(" ( {place} {s} {t} )");
                }
            }
            self.line(format_args!("{row} )"));
        }
        self.line(format_args!(")\n}}\n}}"));
    }
}

fn shader_name(bsp: &Bsp, shader: ShaderId) -> &str {
    let name = bsp.shader(shader).name.as_str();
    // Of a converted map the picture, not the way that it is drawn.
    let texture = bsp.texture_uses.iter().find(|t| t.material == name);
    let picture = texture.and_then(|t| t.frames.first());
    picture.map_or(name, String::as_str)
}

/// A number without needless digits.
fn number(value: f64) -> String {
    let rounded = (value * 1e6).round() / 1e6;
    // No negative zero.
    format!("{}", rounded + 0.0)
}

/// Whether the compiler did not divide the world by a solid brush: leaves in those that it did are closed.
fn is_detail(bsp: &Bsp, brush: &Brush, sides: &[Side]) -> bool {
    let contents = bsp.shader(brush.shader).content_flags;
    let (solid, keeps) = (content_flags::SOLID, content_flags::AREAPORTAL);
    if contents & solid == 0 || contents & keeps != 0 || bsp.leafs.is_empty() {
        return false;
    }
    let corners = sides.iter().flat_map(|side| &side.winding);
    let (sum, count) = corners.fold((DVec3::ZERO, 0.0), |(sum, n), p| (sum + *p, n + 1.0));
    bsp.cluster_at((sum / count).as_vec3()) >= 0
}

#[cfg(test)]
mod tests;

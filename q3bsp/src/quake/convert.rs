//! A Quake map as the one map model.

use super::atlas::Atlas;
use super::{EmbeddedTexture, Face, QuakeMap, QuakeNode};
use crate::Bsp;
use crate::error::{Error, Lump, Warning};
use crate::ids::{BrushId, Child, NodeId, PlaneId, ShaderId, SurfaceId};
use crate::lumps::{Brush, BrushSide, Leaf, Model, Node, Plane, ShaderRef};
use glam::{Vec2, Vec3};
use std::collections::{HashMap, HashSet};

/// Most corners that the faces of a map may have in all: far more than any has, and little enough for a file whose
/// faces share a long list of edges.
const MAX_CORNERS: u64 = 1 << 24;

/// The shaders of the map made, each combination of name and flags once.
#[derive(Default)]
struct Shaders {
    known: HashMap<(String, u32, u32), ShaderId>,
}

impl Shaders {
    fn index(&mut self, bsp: &mut Bsp, name: &str, surface: u32, content: u32) -> ShaderId {
        let key = (name.to_owned(), surface, content);
        *self.known.entry(key).or_insert_with(|| {
            bsp.shaders.push(ShaderRef::new(name, surface, content));
            ShaderId(int(bsp.shaders.len()) - 1)
        })
    }
}

fn int(n: usize) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

fn signed(n: u32) -> i32 {
    i32::try_from(n).unwrap_or(i32::MAX)
}

fn whole(v: Vec3) -> [i32; 3] {
    v.to_array().map(|v| v.round() as i32)
}

impl QuakeMap {
    /// The map in the one model. Every face is one surface under the same index; the lightmaps of all faces lie on
    /// pages of 512 × 512 texels, further light styles are [`crate::Layers`]; what the engine did by names and flags
    /// of textures is in [`Bsp::texture_uses`]; textures inside the file are in [`Bsp::embedded_textures`]. Light is
    /// halved, to the scale of `IBSP`.
    ///
    /// # Errors
    /// A reference that leads out of its lump, with its place in the file.
    pub fn to_bsp(&self) -> Result<Bsp, Error> {
        // Before anybody walks the sides of all brushes.
        let sides = self.brushes.iter().map(|brush| brush.num_sides);
        crate::validate::check_sharing(Lump::Brushes, Lump::BrushSides, sides)?;
        let mut bsp = Bsp {
            format: self.format,
            entities: self.entities.clone(),
            ..Bsp::default()
        };
        let (textures, warnings) = self.embedded_textures();
        bsp.warnings = warnings;
        bsp.planes = self
            .planes
            .iter()
            .map(|plane| Plane {
                normal: plane.normal,
                dist: plane.dist,
            })
            .collect();
        let (visibility, odd) = self.decode_visibility();
        bsp.visibility = visibility;
        bsp.warnings.extend(odd);
        self.convert_tree(&mut bsp);
        let mut shaders = Shaders::default();
        self.convert_faces(&mut bsp, &mut shaders, &textures)?;
        self.convert_brushes(&mut bsp, &mut shaders)?;
        bsp.embedded_textures = textures.into_iter().flatten().collect();
        if bsp.shaders.is_empty() {
            shaders.index(&mut bsp, "noshader", 0, 0);
        }
        let checked = bsp.validate();
        checked.map_err(|error| self.located(error))?;
        // Repairs were made to this model, not to the file.
        bsp.container.forget();
        Ok(bsp)
    }

    fn convert_tree(&self, bsp: &mut Bsp) {
        let node = |node: &QuakeNode| Node {
            plane: PlaneId(node.plane),
            children: node.children.map(Child::from_raw),
            mins: whole(node.mins),
            maxs: whole(node.maxs),
        };
        bsp.nodes = self.nodes.iter().map(node).collect();
        let root = self.models.first().map_or(0, |world| world.head_nodes[0]);
        self.move_root(bsp, root);
        let two = self.format.is_quake2();
        let clusters = self.clusters();
        let brushes = self.leaf_brushes.iter();
        bsp.leaf_brushes = brushes.map(|&brush| BrushId(signed(brush))).collect();
        let faces = self.leaf_faces.iter();
        bsp.leaf_surfaces = faces.map(|&face| SurfaceId(signed(face))).collect();
        bsp.leafs = self
            .leafs
            .iter()
            .enumerate()
            .map(|(at, leaf)| Leaf {
                cluster: match (two, leaf.contents) {
                    (true, _) => leaf.visibility,
                    // stone
                    (false, -2) => -1,
                    // The clusters are the leafs from 1 on, as many as are visible.
                    (false, _) => match at.checked_sub(1) {
                        Some(cluster) if cluster < clusters || clusters == 0 => int(cluster),
                        _ => -1,
                    },
                },
                area: leaf.area,
                mins: whole(leaf.mins),
                maxs: whole(leaf.maxs),
                first_leaf_surface: signed(leaf.first_face),
                num_leaf_surfaces: signed(leaf.num_faces),
                first_leaf_brush: signed(leaf.first_brush),
                num_leaf_brushes: signed(leaf.num_brushes),
            })
            .collect();
        bsp.models = self
            .models
            .iter()
            .map(|model| Model {
                mins: model.mins,
                maxs: model.maxs,
                first_surface: model.first_face,
                num_surfaces: model.num_faces,
                first_brush: 0,
                num_brushes: 0,
            })
            .collect();
        if let Some(world) = bsp.models.first_mut() {
            world.num_brushes = int(self.brushes.len());
        }
    }

    /// Makes the root of the world node 0.
    fn move_root(&self, bsp: &mut Bsp, root: i32) {
        let (first, root) = (Child::Node(NodeId::ROOT), Child::from_raw(root));
        match root {
            Child::Node(NodeId::ROOT) => {}
            Child::Node(node) if node.index() < bsp.nodes.len() => {
                bsp.nodes.swap(0, node.index());
                for node in &mut bsp.nodes {
                    for child in &mut node.children {
                        if *child == first {
                            *child = root;
                        } else if *child == root {
                            *child = first;
                        }
                    }
                }
            }
            // The world names no node: node 0 stays the root.
            Child::Node(_) => {}
            // All the world is one leaf.
            Child::Leaf(_) => {
                // A map without models is refused later.
                let bounds = self.models.first().map(|w| (w.mins, w.maxs));
                let (mins, maxs) = bounds.unwrap_or_default();
                bsp.nodes = vec![Node {
                    plane: PlaneId(0),
                    children: [root; 2],
                    mins: whole(mins),
                    maxs: whole(maxs),
                }];
            }
        }
    }

    /// Value of a key of the world.
    fn world_key(&self, bsp: &Bsp, key: &str) -> Option<String> {
        let entities = bsp.entities();
        let value = entities.first()?.get(key)?.to_owned();
        (!value.is_empty()).then_some(value)
    }

    fn convert_faces(
        &self,
        bsp: &mut Bsp,
        shaders: &mut Shaders,
        textures: &[Option<EmbeddedTexture>],
    ) -> Result<(), Error> {
        let key = match self.format.is_quake2() {
            true => "sky",
            false => "skyname",
        };
        let sky_box = self.world_key(bsp, key);
        let edges = |face: &Face| u64::try_from(face.num_edges).unwrap_or(0);
        let found = self.faces.iter().map(edges).sum();
        if found > MAX_CORNERS {
            return Err(Error::TooMuchSharing {
                lump: Lump::Faces,
                target: Lump::Surfedges,
                found,
                limit: MAX_CORNERS,
            });
        }
        let contents = self.contents_of_texinfos();
        let names = textures.iter().flatten().map(|t| t.name.as_str()).collect();
        let mut described_materials = HashSet::new();
        // The material of each texinfo: shader, whether it takes a lightmap, size of the texture.
        let mut materials: Vec<Option<(ShaderId, bool, Vec2)>> = vec![None; self.texinfos.len()];
        let mut atlas = Atlas::new(self.lighting.len());
        let mut too_large = 0;
        for (element, face) in self.faces.iter().enumerate() {
            let texinfo = self.texinfo_of(element, face)?;
            let at = usize::try_from(face.texinfo).unwrap_or(0);
            let known = materials.get(at).copied().flatten();
            let (shader, lit, size) = known.unwrap_or_else(|| {
                let contents = contents.get(at).copied().unwrap_or(0);
                let described =
                    self.describe(texinfo, textures, &names, contents, sky_box.as_deref());
                let name = &described.texture.material;
                let shader =
                    shaders.index(bsp, name, described.surface_flags, described.content_flags);
                let lit = !described.texture.parameters.contains(&"nolightmap")
                    && (self.format.is_quake2() || texinfo.flags & 1 == 0);
                if described_materials.insert(name.clone()) {
                    bsp.texture_uses.push(described.texture);
                }
                let texture = usize::try_from(texinfo.texture).ok();
                let texture = texture.and_then(|at| textures.get(at)?.as_ref());
                // Coordinates of Quake II stay in texels until the sizes are set.
                let size =
                    texture.map_or(Vec2::ONE, |t| Vec2::new(t.width as f32, t.height as f32));
                if let Some(slot) = materials.get_mut(at) {
                    *slot = Some((shader, lit, size));
                }
                (shader, lit, size)
            });
            let polygon = self.polygon(element, face, shader, lit, size, &mut atlas)?;
            too_large += i64::from(polygon.too_large);
            let mut surface = polygon.surface;
            surface.first_vert = int(bsp.vertices.len());
            surface.first_index = int(bsp.indices.len());
            let last = surface.num_verts - 1;
            bsp.indices
                .extend((1..last.max(1)).flat_map(|at| [0, at, at + 1]));
            bsp.vertices.extend(polygon.vertices);
            bsp.layers.vertices.extend(polygon.vertex_layers);
            bsp.layers.surfaces.push(polygon.layers);
            bsp.surfaces.push(surface);
        }
        bsp.texel_coordinates = self.format.is_quake2();
        bsp.lightmaps = atlas.pages();
        if too_large > 0 {
            bsp.warnings.push(Warning {
                lump: Lump::Faces,
                element: None,
                field:
                    "number of lightmaps that are larger than 512 × 512 or share bytes without end"
                        .into(),
                value: too_large,
                action: "the faces get their mean".into(),
            });
        }
        Ok(())
    }

    /// Contents of a brush that each texinfo is on; 0 for those on none.
    fn contents_of_texinfos(&self) -> Vec<u32> {
        let mut contents = vec![0; self.texinfos.len()];
        for brush in &self.brushes {
            let first = usize::try_from(brush.first_side).unwrap_or(usize::MAX);
            let count = usize::try_from(brush.num_sides).unwrap_or(0);
            let sides = self.brush_sides.get(first..first.saturating_add(count));
            // A range outside the lump is refused in `convert_brushes`.
            for side in sides.unwrap_or_default() {
                let slot = usize::try_from(side.texinfo).ok();
                if let Some(slot) = slot.and_then(|at| contents.get_mut(at)) {
                    *slot = brush.contents;
                }
            }
        }
        contents
    }

    fn convert_brushes(&self, bsp: &mut Bsp, shaders: &mut Shaders) -> Result<(), Error> {
        let side_contents = {
            let mut of = vec![0; self.brush_sides.len()];
            for (element, brush) in self.brushes.iter().enumerate() {
                let range = usize::try_from(brush.first_side)
                    .ok()
                    .zip(usize::try_from(brush.num_sides).ok())
                    .and_then(|(first, count)| of.get_mut(first..first.checked_add(count)?));
                let Some(range) = range else {
                    return Err(self.located(Error::Range {
                        lump: Lump::Brushes,
                        element,
                        field: "sides",
                        first: brush.first_side,
                        count: brush.num_sides,
                        target: Lump::BrushSides,
                        limit: self.brush_sides.len(),
                    }));
                };
                range.fill(brush.contents);
            }
            of
        };
        for (side, contents) in self.brush_sides.iter().zip(side_contents) {
            let texinfo = usize::try_from(side.texinfo)
                .ok()
                .and_then(|at| self.texinfos.get(at));
            let shader = match texinfo {
                Some(texinfo) => {
                    let described = self.describe(texinfo, &[], &HashSet::new(), contents, None);
                    let (surface, content) = (described.surface_flags, described.content_flags);
                    shaders.index(bsp, &described.texture.material, surface, content)
                }
                None => shaders.index(bsp, "noshader", crate::surface_flags::NODRAW, 0),
            };
            bsp.brush_sides.push(BrushSide {
                plane: PlaneId(signed(side.plane)),
                shader,
            });
        }
        for brush in &self.brushes {
            let first = usize::try_from(brush.first_side).unwrap_or(usize::MAX);
            let shader = match bsp.brush_sides.get(first) {
                Some(side) if brush.num_sides > 0 => side.shader,
                _ => shaders.index(bsp, "noshader", crate::surface_flags::NODRAW, 0),
            };
            bsp.brushes.push(Brush {
                first_side: brush.first_side,
                num_sides: brush.num_sides,
                shader,
            });
        }
        Ok(())
    }
}

impl Bsp {
    /// Turns coordinates that a format stores in texels ([`Bsp::texel_coordinates`]) into fractions of the texture,
    /// once the sizes of textures are known: `size` gets the game path of each, without extension, and
    /// returns width and height; `None` counts as 64 × 64.
    pub fn resolve_texture_sizes(&mut self, mut size: impl FnMut(&str) -> Option<(u32, u32)>) {
        if !std::mem::take(&mut self.texel_coordinates) {
            return;
        }
        let mut sizes: HashMap<&str, Vec2> = HashMap::new();
        for texture in &self.texture_uses {
            let found = texture.frames.first().and_then(|image| size(image));
            let (width, height) = found.unwrap_or((64, 64));
            let size = Vec2::new(width.max(1) as f32, height.max(1) as f32);
            sizes.insert(&texture.material, size);
        }
        let shader_sizes: Vec<Vec2> = self
            .shaders
            .iter()
            .map(|s| sizes.get(s.name.as_str()).copied().unwrap_or(Vec2::ONE))
            .collect();
        for surface in &self.surfaces {
            let size = shader_sizes.get(surface.shader.index());
            let range = crate::tree::span(surface.first_vert, surface.num_verts);
            if let (Some(size), Some(vertices)) = (size, self.vertices.get_mut(range)) {
                for vertex in vertices {
                    vertex.st /= *size;
                }
            }
        }
    }
}

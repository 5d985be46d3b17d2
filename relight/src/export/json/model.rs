//! The typed map as JSON and back: every field under its own name.

use super::values::{Bytes, Json, JsonError, WriteText, field, objects, put_bytes, put_list};
use q3bsp::quake::{EmbeddedTexture, TextureUse};
use q3bsp::{
    Advertisement, Brush, BrushSide, Bsp, Container, DrawVert, Fog, Format, Gap, GridLayers,
    GridPoint, Layers, Leaf, Lightmap, Lump, LumpRange, Model, Node, Plane, Repair, ShaderRef,
    Surface, SurfaceKind, SurfaceLayers, VertexLayers, Visibility,
};
use serde_json::Value;

objects! {
    ShaderRef { name, raw_name, surface_flags, content_flags, raw_flags }
    Plane { normal, dist }
    Node { plane, children, mins, maxs }
    Leaf {
        cluster, area, mins, maxs, first_leaf_surface, num_leaf_surfaces, first_leaf_brush,
        num_leaf_brushes,
    }
    Model { mins, maxs, first_surface, num_surfaces, first_brush, num_brushes }
    Brush { first_side, num_sides, shader }
    BrushSide { plane, shader }
    DrawVert { position, st, lightmap, normal, color }
    Fog { shader, raw_shader, brush, visible_side }
    Surface {
        shader, fog, kind, first_vert, num_verts, first_index, num_indices, lightmap, lightmap_x,
        lightmap_y, lightmap_width, lightmap_height, lightmap_origin, lightmap_vecs, patch_width,
        patch_height,
    }
    SurfaceLayers { lightmap_styles, vertex_styles, lightmaps, lightmap_x, lightmap_y }
    VertexLayers { lightmap, color }
    Layers { surfaces, vertices, side_surfaces, grid_points, grid_indices }
    Advertisement { cell, normal, corners, model }
    LumpRange { offset, length }
    Repair { lump, element, field_offset, original, replacement }
}

/// `[ambient, directed, [longitude, latitude]]`, as there are many of them.
impl Json for GridPoint {
    fn put(&self, out: &mut String) {
        let angles = [self.longitude, self.latitude];
        out.push('[');
        self.ambient.put(out);
        out.push(',');
        self.directed.put(out);
        out.push(',');
        angles.map(u32::from).put(out);
        out.push(']');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let part = |at: usize| {
            let missing = || JsonError::new("[ambient, directed, angles]");
            value.get(at).ok_or_else(missing)
        };
        let [longitude, latitude] = angles(part(2)?)?;
        Ok(GridPoint {
            ambient: Json::get(part(0)?)?,
            directed: Json::get(part(1)?)?,
            longitude,
            latitude,
        })
    }
}

fn angles(value: &Value) -> Result<[u8; 2], JsonError> {
    let [a, b] = <[u32; 2]>::get(value)?;
    match (u8::try_from(a), u8::try_from(b)) {
        (Ok(a), Ok(b)) => Ok([a, b]),
        _ => Err(JsonError::new("angles from 0 to 255")),
    }
}

impl Json for GridLayers {
    fn put(&self, out: &mut String) {
        out.push_str("{\"ambient\":");
        self.ambient.put(out);
        out.push_str(",\"directed\":");
        self.directed.put(out);
        out.push_str(",\"styles\":");
        self.styles.put(out);
        out.push_str(",\"angles\":");
        [self.longitude, self.latitude].map(u32::from).put(out);
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let missing = || JsonError::new("the key \"angles\"");
        let [longitude, latitude] = angles(value.get("angles").ok_or_else(missing)?)?;
        Ok(GridLayers {
            ambient: field(value, "ambient")?,
            directed: field(value, "directed")?,
            styles: field(value, "styles")?,
            longitude,
            latitude,
        })
    }
}

impl Json for SurfaceKind {
    fn put(&self, out: &mut String) {
        match self {
            SurfaceKind::Planar => "planar".write(out),
            SurfaceKind::Patch => "patch".write(out),
            SurfaceKind::TriangleSoup => "mesh".write(out),
            SurfaceKind::Flare => "flare".write(out),
            SurfaceKind::Foliage => "foliage".write(out),
            SurfaceKind::Other(raw) => raw.put(out),
        }
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        match value.as_str() {
            Some("planar") => Ok(SurfaceKind::Planar),
            Some("patch") => Ok(SurfaceKind::Patch),
            Some("mesh") => Ok(SurfaceKind::TriangleSoup),
            Some("flare") => Ok(SurfaceKind::Flare),
            Some("foliage") => Ok(SurfaceKind::Foliage),
            Some(_) => Err(JsonError::new("planar, patch, mesh, flare or foliage")),
            None => i32::get(value).map(SurfaceKind::from_raw),
        }
    }
}

impl Json for Lump {
    fn put(&self, out: &mut String) {
        self.name().write(out);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let further = [Lump::LightArray, Lump::Advertisements];
        let name = value.as_str();
        let mut lumps = Lump::ALL.into_iter().chain(further);
        let found = lumps.find(|lump| Some(lump.name()) == name);
        found.ok_or_else(|| JsonError::new("the name of a lump"))
    }
}

impl Json for Format {
    fn put(&self, out: &mut String) {
        self.name().write(out);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let name = value.as_str();
        let found = Format::ALL.into_iter().find(|f| Some(f.name()) == name);
        found.ok_or_else(|| JsonError::new("the name of a format"))
    }
}

impl Json for Lightmap {
    fn put(&self, out: &mut String) {
        put_bytes(out, &self.0);
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        Ok(Lightmap(Bytes::get(value)?.0.into()))
    }
}

impl Json for Gap {
    fn put(&self, out: &mut String) {
        out.push_str("{\"offset\":");
        self.offset.put(out);
        out.push_str(",\"bytes\":");
        put_bytes(out, &self.bytes);
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        Ok(Gap {
            offset: field(value, "offset")?,
            bytes: field::<Bytes>(value, "bytes")?.0,
        })
    }
}

/// One row of bits for each cluster.
impl Json for Visibility {
    fn put(&self, out: &mut String) {
        out.push_str("{\"bytes_per_cluster\":");
        self.bytes_per_cluster.put(out);
        out.push_str(",\"rows\":");
        put_list(out, 0..self.clusters, |c, out| put_bytes(out, self.row(c)));
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let bytes_per_cluster = field(value, "bytes_per_cluster")?;
        let rows: Vec<Bytes> = field(value, "rows")?;
        let clusters = rows.len();
        if bytes_per_cluster < clusters.div_ceil(8)
            || rows.iter().any(|row| row.0.len() != bytes_per_cluster)
        {
            let expected = format!("rows of {bytes_per_cluster} bytes, one bit a cluster");
            return Err(JsonError::new(expected));
        }
        Ok(Visibility {
            clusters,
            bytes_per_cluster,
            rows: rows.into_iter().flat_map(|row| row.0).collect(),
        })
    }
}

impl Json for Container {
    fn put(&self, out: &mut String) {
        out.push_str("{\"lumps\":");
        self.lumps.put(out);
        out.push_str(",\"header_length\":");
        self.header_length.put(out);
        out.push_str(",\"gaps\":");
        self.gaps.put(out);
        out.push_str(",\"file_length\":");
        self.file_length.put(out);
        out.push_str(",\"trailing\":");
        put_list(out, &self.trailing, |bytes, out| put_bytes(out, bytes));
        out.push_str(",\"repairs\":");
        self.repairs.put(out);
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let trailing: Vec<Bytes> = field(value, "trailing")?;
        let mut container = Container {
            lumps: field(value, "lumps")?,
            header_length: field(value, "header_length")?,
            gaps: field(value, "gaps")?,
            file_length: field(value, "file_length")?,
            repairs: field(value, "repairs")?,
            ..Container::default()
        };
        for (slot, bytes) in container.trailing.iter_mut().zip(trailing) {
            *slot = bytes.0;
        }
        Ok(container)
    }
}

/// The words of `surfaceparm` that conversion uses.
const PARAMETERS: [&str; 6] = ["sky", "nolightmap", "trans", "water", "lava", "slime"];

impl Json for TextureUse {
    fn put(&self, out: &mut String) {
        let words: Vec<String> = self.parameters.iter().map(|&w| w.to_owned()).collect();
        for (before, value) in [
            ("{\"material\":", &self.material as &dyn Put),
            (",\"frames\":", &self.frames),
            (",\"rate\":", &self.rate),
            (",\"layered_sky\":", &self.layered_sky),
            (",\"sky_box\":", &self.sky_box),
            (",\"warps\":", &self.warps),
            (",\"holes\":", &self.holes),
            (",\"opacity\":", &self.opacity),
            (",\"flow\":", &self.flow),
            (",\"light\":", &self.light),
            (",\"glow\":", &self.glow),
            (",\"parameters\":", &words),
        ] {
            out.push_str(before);
            value.put_to(out);
        }
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let words: Vec<String> = field(value, "parameters")?;
        let known = |word: &String| PARAMETERS.into_iter().find(|known| known == word);
        Ok(TextureUse {
            material: field(value, "material")?,
            frames: field(value, "frames")?,
            rate: field(value, "rate")?,
            layered_sky: field(value, "layered_sky")?,
            sky_box: field(value, "sky_box")?,
            warps: field(value, "warps")?,
            holes: field(value, "holes")?,
            opacity: field(value, "opacity")?,
            flow: field(value, "flow")?,
            light: field(value, "light")?,
            glow: field(value, "glow")?,
            parameters: words.iter().filter_map(known).collect(),
        })
    }
}

/// [`Json::put`] behind a reference.
trait Put {
    fn put_to(&self, out: &mut String);
}

impl<T: Json> Put for T {
    fn put_to(&self, out: &mut String) {
        self.put(out);
    }
}

impl Json for EmbeddedTexture {
    fn put(&self, out: &mut String) {
        let bytes = |bytes: &Option<Vec<u8>>, out: &mut String| match bytes {
            Some(bytes) => put_bytes(out, bytes),
            None => out.push_str("null"),
        };
        out.push_str("{\"name\":");
        self.name.put(out);
        out.push_str(",\"width\":");
        self.width.put(out);
        out.push_str(",\"height\":");
        self.height.put(out);
        out.push_str(",\"indices\":");
        bytes(&self.indices, out);
        out.push_str(",\"palette\":");
        bytes(&self.palette, out);
        out.push('}');
    }
    fn get(value: &Value) -> Result<Self, JsonError> {
        let bytes = |key: &str| field::<Option<Bytes>>(value, key);
        Ok(EmbeddedTexture {
            name: field(value, "name")?,
            width: field(value, "width")?,
            height: field(value, "height")?,
            indices: bytes("indices")?.map(|b| b.0),
            palette: bytes("palette")?.map(|b| b.0),
        })
    }
}

/// The map. Warnings are not part of it: they tell of the file it came from.
pub(super) fn put_map(bsp: &Bsp, out: &mut String) {
    out.push_str("{\n\"format\":");
    bsp.format.put(out);
    out.push_str(",\n\"entities\":");
    put_bytes(out, &bsp.entities);
    for (before, value) in [
        (",\n\"shaders\":", &bsp.shaders as &dyn Put),
        (",\n\"planes\":", &bsp.planes),
        (",\n\"nodes\":", &bsp.nodes),
        (",\n\"leafs\":", &bsp.leafs),
        (",\n\"leaf_surfaces\":", &bsp.leaf_surfaces),
        (",\n\"leaf_brushes\":", &bsp.leaf_brushes),
        (",\n\"models\":", &bsp.models),
        (",\n\"brushes\":", &bsp.brushes),
        (",\n\"brush_sides\":", &bsp.brush_sides),
        (",\n\"vertices\":", &bsp.vertices),
        (",\n\"indices\":", &bsp.indices),
        (",\n\"fogs\":", &bsp.fogs),
        (",\n\"surfaces\":", &bsp.surfaces),
        (",\n\"lightmaps\":", &bsp.lightmaps),
        (",\n\"light_grid\":", &bsp.light_grid),
        (",\n\"visibility\":", &bsp.visibility),
        (",\n\"layers\":", &bsp.layers),
        (",\n\"advertisements\":", &bsp.advertisements),
        (",\n\"texture_uses\":", &bsp.texture_uses),
        (",\n\"embedded_textures\":", &bsp.embedded_textures),
        (",\n\"texel_coordinates\":", &bsp.texel_coordinates),
        (",\n\"container\":", &bsp.container),
    ] {
        out.push_str(before);
        value.put_to(out);
    }
    out.push_str("\n}");
}

/// Reads what [`put_map`] wrote.
pub(super) fn get_map(value: &Value) -> Result<Bsp, JsonError> {
    Ok(Bsp {
        format: field(value, "format")?,
        entities: field::<Bytes>(value, "entities")?.0,
        shaders: field(value, "shaders")?,
        planes: field(value, "planes")?,
        nodes: field(value, "nodes")?,
        leafs: field(value, "leafs")?,
        leaf_surfaces: field(value, "leaf_surfaces")?,
        leaf_brushes: field(value, "leaf_brushes")?,
        models: field(value, "models")?,
        brushes: field(value, "brushes")?,
        brush_sides: field(value, "brush_sides")?,
        vertices: field(value, "vertices")?,
        indices: field(value, "indices")?,
        fogs: field(value, "fogs")?,
        surfaces: field(value, "surfaces")?,
        lightmaps: field(value, "lightmaps")?,
        light_grid: field(value, "light_grid")?,
        visibility: field(value, "visibility")?,
        layers: field(value, "layers")?,
        advertisements: field(value, "advertisements")?,
        texture_uses: field(value, "texture_uses")?,
        embedded_textures: field(value, "embedded_textures")?,
        texel_coordinates: field(value, "texel_coordinates")?,
        container: field(value, "container")?,
        warnings: Vec::new(),
    })
}

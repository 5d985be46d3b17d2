//! Conversions between the engine's structures and the renderer's types.

use crate::abi::{
    Vec3C, fontInfo_t, glyphInfo_t, markFragment_t, orientation_t, polyVert_t, refEntity_t,
    refdef_t,
};
use glam::{Vec2, Vec3};
use renderer_vk::LoadedFont;
use renderer_vk::api::{
    EntityKind, MarkFragment, Orientation, PolyVert, RefDef, RefEntity, StretchedPicture,
};
use std::ffi::c_char;

/// The part of a picture within a region (left, top, right, bottom), if there is any. An empty region does not clip.
pub fn clipped(whole: StretchedPicture, region: [f32; 4]) -> Option<StretchedPicture> {
    let [left, top, right, bottom] = region;
    if !(right > left && bottom > top) {
        return Some(whole);
    }
    let (start, end) = (whole.position, whole.position + whole.size);
    let position = start.max(Vec2::new(left, top));
    let size = end.min(Vec2::new(right, bottom)) - position;
    let texel = |place: Vec2| whole.st1 + (whole.st2 - whole.st1) * ((place - start) / whole.size);
    size.cmpgt(Vec2::ZERO).all().then(|| StretchedPicture {
        position,
        size,
        st1: texel(position),
        st2: texel(position + size),
    })
}

/// The kind of an entity; `None` for an invalid number.
fn entity_kind(number: i32) -> Option<EntityKind> {
    Some(match number {
        0 => EntityKind::Model,
        1 => EntityKind::Poly,
        2 => EntityKind::Sprite,
        3 => EntityKind::Beam,
        4 => EntityKind::RailCore,
        5 => EntityKind::RailRings,
        6 => EntityKind::Lightning,
        7 => EntityKind::PortalSurface,
        _ => return None,
    })
}

/// Unit of an entity's `shaderTime`.
#[derive(Clone, Copy, Debug)]
pub enum ShaderTime {
    /// A float.
    Seconds,
    /// An integer in the float's place.
    Milliseconds,
}

/// An entity; `None` if its type is invalid.
pub fn entity(from: &refEntity_t, time: ShaderTime) -> Option<RefEntity> {
    let shader_time = match time {
        ShaderTime::Seconds => from.shaderTime,
        ShaderTime::Milliseconds => {
            (f64::from(from.shaderTime.to_bits().cast_signed()) * 0.001) as f32
        }
    };
    Some(RefEntity {
        kind: entity_kind(from.reType)?,
        renderfx: from.renderfx.cast_unsigned(),
        model: from.hModel,
        lighting_origin: from.lightingOrigin.into(),
        shadow_plane: from.shadowPlane,
        axis: from.axis.map(Vec3::from),
        non_normalized_axes: from.nonNormalizedAxes != 0,
        origin: from.origin.into(),
        frame: from.frame,
        old_origin: from.oldorigin.into(),
        old_frame: from.oldframe,
        backlerp: from.backlerp,
        skin_num: from.skinNum,
        custom_skin: from.customSkin,
        custom_shader: from.customShader,
        shader_rgba: from.shaderRGBA,
        shader_texcoord: Vec2::from(from.shaderTexCoord),
        shader_time,
        radius: from.radius,
        rotation: from.rotation,
    })
}

/// A view.
pub fn view(from: &refdef_t) -> RefDef {
    RefDef {
        x: from.x,
        y: from.y,
        width: from.width,
        height: from.height,
        fov_x: from.fov_x,
        fov_y: from.fov_y,
        view_origin: from.vieworg.into(),
        view_axis: from.viewaxis.map(Vec3::from),
        time_ms: from.time,
        flags: from.rdflags.cast_unsigned(),
        area_mask: from.areamask,
        text: from.text,
        ..RefDef::default()
    }
}

/// A corner of a polygon.
pub fn poly_vert(from: &polyVert_t) -> PolyVert {
    PolyVert {
        position: from.xyz.into(),
        st: Vec2::from(from.st),
        rgba: from.modulate,
    }
}

/// A tag's position and axes; without a tag, the identity at the origin.
pub fn orientation(from: Option<Orientation>) -> orientation_t {
    let place = from.unwrap_or(Orientation {
        origin: Vec3::ZERO,
        axis: [Vec3::X, Vec3::Y, Vec3::Z],
    });
    orientation_t {
        origin: place.origin.to_array(),
        axis: place.axis.map(|axis| axis.to_array()),
    }
}

/// A decal's piece.
pub fn mark_fragment(from: &MarkFragment) -> markFragment_t {
    let int = |n: usize| i32::try_from(n).unwrap_or(i32::MAX);
    markFragment_t {
        firstPoint: int(from.first_point),
        numPoints: int(from.num_points),
    }
}

fn text<const N: usize>(from: &str) -> [c_char; N] {
    let mut to = [0; N];
    // The last byte remains zero.
    for (to, byte) in to.iter_mut().take(N - 1).zip(from.bytes()) {
        *to = byte as c_char;
    }
    to
}

/// A font, with the shaders of its glyphs registered.
pub fn font(from: &LoadedFont) -> Box<fontInfo_t> {
    let blank = glyphInfo_t {
        height: 0,
        top: 0,
        bottom: 0,
        pitch: 0,
        xSkip: 0,
        imageWidth: 0,
        imageHeight: 0,
        s: 0.0,
        t: 0.0,
        s2: 0.0,
        t2: 0.0,
        glyph: 0,
        shaderName: [0; 32],
    };
    let mut to = Box::new(fontInfo_t {
        glyphs: [blank; 256],
        glyphScale: from.info.glyph_scale,
        // The engine's own renderer returns the file's name here.
        name: text(&from.name),
    });
    for (index, (to, from_glyph)) in to.glyphs.iter_mut().zip(&from.info.glyphs).enumerate() {
        *to = glyphInfo_t {
            height: from_glyph.height,
            top: from_glyph.top,
            bottom: from_glyph.bottom,
            pitch: from_glyph.pitch,
            xSkip: from_glyph.x_skip,
            imageWidth: from_glyph.image_width,
            imageHeight: from_glyph.image_height,
            s: from_glyph.s,
            t: from_glyph.t,
            s2: from_glyph.s2,
            t2: from_glyph.t2,
            glyph: from.handles.get(index).copied().unwrap_or(0),
            shaderName: text(&from_glyph.shader),
        };
    }
    to
}

/// A vector of the engine.
///
/// # Safety
/// `from` must be null (the result is then the origin) or point at three floats.
pub unsafe fn vector(from: *const Vec3C) -> Vec3 {
    if from.is_null() {
        return Vec3::ZERO;
    }
    // SAFETY: not null, so it points at three floats by this function's contract; floats of game code may be unaligned.
    unsafe { from.read_unaligned() }.into()
}

/// Writes a vector to the engine's memory; null is ignored.
///
/// # Safety
/// `to` must be null or have room for three floats.
pub unsafe fn write_vector(to: *mut Vec3C, vector: Vec3) {
    if !to.is_null() {
        // SAFETY: not null, so it has room for three floats by this function's contract.
        unsafe { to.write_unaligned(vector.to_array()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::abi::RT_MAX_REF_ENTITY_TYPE;

    #[test]
    fn pictures_are_clipped_with_their_coordinates() {
        let picture = |[x, y, w, h]: [f32; 4], [s1, t1, s2, t2]: [f32; 4]| StretchedPicture {
            position: Vec2::new(x, y),
            size: Vec2::new(w, h),
            st1: Vec2::new(s1, t1),
            st2: Vec2::new(s2, t2),
        };
        let whole = picture([10.0, 20.0, 40.0, 80.0], [0.0, 1.0, 1.0, 0.0]);
        for (region, expected) in [
            ([0.0; 4], Some(whole)),
            ([30.0, 0.0, 20.0, 100.0], Some(whole)),
            ([f32::NAN; 4], Some(whole)),
            ([0.0, 0.0, 640.0, 480.0], Some(whole)),
            (
                [20.0, 40.0, 30.0, 80.0],
                Some(picture([20.0, 40.0, 10.0, 40.0], [0.25, 0.75, 0.5, 0.25])),
            ),
            ([50.0, 0.0, 640.0, 480.0], None),
            ([0.0, 0.0, 640.0, 20.0], None),
        ] {
            assert_eq!(clipped(whole, region), expected, "{region:?}");
        }
    }

    #[test]
    fn every_entity_type_of_the_engine_is_known_and_no_other() {
        for number in 0..RT_MAX_REF_ENTITY_TYPE {
            assert!(entity_kind(number).is_some(), "{number}");
        }
        assert!(entity_kind(-1).is_none() && entity_kind(RT_MAX_REF_ENTITY_TYPE).is_none());
    }

    #[test]
    fn no_tag_is_the_identity() {
        let none = orientation(None);
        assert_eq!(none.origin, [0.0; 3]);
        assert_eq!(
            none.axis,
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        );
    }

    #[test]
    fn long_names_end_with_a_zero() {
        let name: [c_char; 4] = text("abcdef");
        assert_eq!(name.map(|c| c as u8), *b"abc\0");
    }
}

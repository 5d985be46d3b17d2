//! Queries of models and of the map, and replacement of materials.

use crate::abi::{QBool, Vec3C, markFragment_t, orientation_t};
use crate::boundary::entry;
use crate::convert;
use crate::engine::{self, string_from, text_of};
use crate::scene::MAX_MARK_POINTS;
use crate::session::with_renderer;
use glam::Vec3;
use std::ffi::{c_char, c_float, c_int};

/// `re.LightForPoint`. Without a map, or in one without a light grid, this returns 0 and writes nothing.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `point` must be null, which counts as the world's origin, or
/// point at three floats. `ambient`, `directed` and `direction` must each be null or have room for three floats.
pub unsafe extern "C" fn light_for_point(
    point: *const Vec3C,
    ambient: *mut Vec3C,
    directed: *mut Vec3C,
    direction: *mut Vec3C,
) -> c_int {
    entry(|| {
        // SAFETY: null or three floats by this function's contract.
        let point = unsafe { convert::vector(point) };
        with_renderer(|renderer, _| {
            let Some(light) = renderer.light_for_point(point) else {
                return Ok(0);
            };
            for (to, value) in [
                (ambient, light.ambient),
                (directed, light.directed),
                (direction, light.direction),
            ] {
                // SAFETY: each is null or has room for three floats by this function's contract.
                unsafe { convert::write_vector(to, value) };
            }
            Ok(1)
        })
    })
}

/// `re.MarkFragments`: the number of fragments written.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract).
/// - `points` must be null or point at `num_points` vectors; only the first 64 are read.
/// - `projection` must be null, which counts as no direction, or point at three floats.
/// - `point_buffer` must be null or have room for `max_points` vectors, `fragment_buffer` for `max_fragments`
///   fragments.
///
/// Null where points or a buffer should be, or a count below 1, returns 0 and writes nothing.
#[rustfmt::skip]
#[allow(clippy::too_many_arguments)] // the engine's signature
pub unsafe extern "C" fn mark_fragments(num_points: c_int, points: *const Vec3C, projection: *const Vec3C, max_points: c_int, point_buffer: *mut Vec3C, max_fragments: c_int, fragment_buffer: *mut markFragment_t) -> c_int {
    entry(|| {
        let sizes = (usize::try_from(num_points), usize::try_from(max_points), usize::try_from(max_fragments));
        let (Ok(count @ 1..), Ok(max_points @ 1..), Ok(max_fragments @ 1..)) = sizes else { return Ok(0) };
        if points.is_null() || point_buffer.is_null() || fragment_buffer.is_null() {
            return Ok(0);
        }
        let mut polygon = [Vec3::ZERO; MAX_MARK_POINTS];
        for (i, place) in polygon.iter_mut().enumerate().take(count) {
            // SAFETY: not null, so it has `num_points` vectors by this function's contract, and `i` is below that.
            *place = unsafe { convert::vector(points.add(i)) };
        }
        let polygon = polygon.get(..count).unwrap_or(&polygon);
        // SAFETY: null or three floats by this function's contract.
        let projection = unsafe { convert::vector(projection) };
        with_renderer(|renderer, _| {
            let (points, fragments) = renderer.mark_fragments(polygon, projection, max_points, max_fragments);
            for (i, point) in points.iter().take(max_points).enumerate() {
                // SAFETY: not null, so it has room for `max_points` by this function's contract, and `i` is below that.
                unsafe { convert::write_vector(point_buffer.add(i), *point) };
            }
            let mut written = 0;
            for fragment in fragments.iter().take(max_fragments) {
                // No fragment may refer to points that were not written.
                if fragment.first_point.checked_add(fragment.num_points).is_none_or(|end| end > points.len().min(max_points)) {
                    break;
                }
                // SAFETY: not null, so it has room for `max_fragments` by this function's contract, and `written` is
                // below that.
                unsafe { fragment_buffer.add(written).write_unaligned(convert::mark_fragment(fragment)) };
                written += 1;
            }
            Ok(c_int::try_from(written).unwrap_or(0))
        })
    })
}

/// `re.LerpTag`. A model or tag that does not exist returns 0 and writes the identity at the origin.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string. `out` must be null or have room for an `orientation_t`. Frames may have any number.
pub unsafe extern "C" fn lerp_tag(
    out: *mut orientation_t,
    model: c_int,
    start: c_int,
    end: c_int,
    frac: c_float,
    name: *const c_char,
) -> c_int {
    entry(|| {
        // SAFETY: null or NUL-terminated by this function's contract, and used within the call.
        let name = unsafe { text_of(name) };
        let tag =
            with_renderer(|renderer, _| Ok(renderer.lerp_tag(model, start, end, frac, &name)))?;
        if !out.is_null() {
            // SAFETY: not null, so it has room for an `orientation_t` by this function's contract.
            unsafe { out.write_unaligned(convert::orientation(tag)) };
        }
        Ok(c_int::from(tag.is_some()))
    })
}

/// `re.ModelBounds`. A model that does not exist has both corners at the origin.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `mins` and `maxs` must each be null or have room for three
/// floats.
pub unsafe extern "C" fn model_bounds(model: c_int, mins: *mut Vec3C, maxs: *mut Vec3C) {
    entry(|| {
        let (low, high) = with_renderer(|renderer, _| Ok(renderer.model_bounds(model)))?;
        // SAFETY: null or room for three floats by this function's contract.
        unsafe { convert::write_vector(mins, low) };
        // SAFETY: null or room for three floats by this function's contract.
        unsafe { convert::write_vector(maxs, high) };
        Ok(())
    });
}

/// The leading number of a text, as C's `atof` parses it; 0 without one.
fn number(text: &str) -> f32 {
    let text = text.trim_start();
    let mut best = 0.0;
    for (end, _) in text
        .char_indices()
        .skip(1)
        .chain([(text.len(), ' ')])
        .take_while(|&(end, _)| end <= 32)
    {
        if let Some(value) = text
            .get(..end)
            .and_then(|head| head.parse::<f32>().ok())
            .filter(|value| value.is_finite())
        {
            best = value;
        }
    }
    best
}

/// `re.RemapShader`. A name without a material changes nothing.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). Each of the three must be null or a NUL-terminated string.
/// Null counts as an empty name, a null `time_offset` as none.
pub unsafe extern "C" fn remap_shader(
    old: *const c_char,
    new: *const c_char,
    time_offset: *const c_char,
) {
    entry(|| {
        let [old, new, offset] = [old, new, time_offset].map(|text| {
            // SAFETY: null or NUL-terminated by this function's contract; copied at once.
            (!text.is_null()).then(|| unsafe { string_from(text) })
        });
        let [old, new] = [old, new].map(Option::unwrap_or_default);
        with_renderer(|renderer, _| {
            renderer.remap_shader(&old, &new, offset.map(|text| number(&text)));
            Ok(())
        })
    });
}

/// `re.GetEntityToken`: the next word of the map's entities, truncated. At their end this returns 0 and an empty text.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `buffer` must be null or have room for `size` bytes. Null or a
/// size below 1 returns 0 and writes nothing.
pub unsafe extern "C" fn get_entity_token(buffer: *mut c_char, size: c_int) -> QBool {
    entry(|| {
        let (Ok(room @ 1..), false) = (usize::try_from(size), buffer.is_null()) else {
            return Ok(0);
        };
        let token = with_renderer(|renderer, _| Ok(renderer.entity_token()))?;
        let bytes = token.as_deref().unwrap_or("").as_bytes();
        let length = bytes.len().min(room - 1);
        // SAFETY: not null, so it has room for `size` bytes by this function's contract, and `length` is below that.
        // The token is a copy of ours.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr().cast(), buffer, length) };
        // SAFETY: `length` is below the `size` bytes that the buffer has room for.
        unsafe { buffer.add(length).write(0) };
        Ok(QBool::from(token.is_some()))
    })
}

/// `re.inPVS`. Without a map this returns 0.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `from` and `to` must each be null, which counts as the world's
/// origin, or point at three floats.
pub unsafe extern "C" fn in_pvs(from: *const Vec3C, to: *const Vec3C) -> QBool {
    entry(|| {
        let Some(engine) = engine::current() else {
            return Ok(0);
        };
        // SAFETY: each is null or three floats by this function's contract.
        let [from, to] = [from, to].map(|point| unsafe { convert::vector(point) });
        let clusters = with_renderer(|renderer, _| {
            Ok(renderer
                .world_name()
                .is_some()
                .then(|| (renderer.leaf_cluster(from), renderer.leaf_cluster(to))))
        })?;
        // The engine's collision model is of the same map; its rows have a bit for each cluster.
        Ok(QBool::from(
            clusters.is_some_and(|(from, to)| engine.cluster_sees(from, to)),
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_c_does() {
        assert_eq!(number("1.5"), 1.5);
        assert_eq!(number("  -2 seconds"), -2.0);
        assert_eq!(number("12abc"), 12.0);
        assert_eq!(number("abc"), 0.0);
        assert_eq!(number(""), 0.0);
        assert_eq!(number("."), 0.0);
        assert_eq!(number("1e3é"), 1000.0);
    }
}

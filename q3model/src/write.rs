//! Putting numbers and names into a file.

use glam::Vec3;

pub(crate) fn put(out: &mut Vec<u8>, value: i32) {
    out.extend_from_slice(&value.to_le_bytes());
}

pub(crate) fn put_count(out: &mut Vec<u8>, count: usize) {
    put(out, i32::try_from(count).unwrap_or(i32::MAX));
}

pub(crate) fn put_floats(out: &mut Vec<u8>, values: impl IntoIterator<Item = f32>) {
    for value in values {
        out.extend_from_slice(&value.to_le_bytes());
    }
}

pub(crate) fn put_vec3(out: &mut Vec<u8>, v: Vec3) {
    put_floats(out, v.to_array());
}

pub(crate) fn put_name<const N: usize>(out: &mut Vec<u8>, name: &str) {
    let mut field = [0; N];
    for (to, &from) in field.iter_mut().take(N - 1).zip(name.as_bytes()) {
        *to = from;
    }
    out.extend_from_slice(&field);
}

pub(crate) fn put_triangles(out: &mut Vec<u8>, triangles: &[[u32; 3]]) {
    for corner in triangles.iter().flatten() {
        out.extend_from_slice(&corner.to_le_bytes());
    }
}

/// Writes a number at a place that was left for it.
pub(crate) fn patch(out: &mut [u8], at: usize, value: usize) {
    let value = i32::try_from(value).unwrap_or(i32::MAX).to_le_bytes();
    if let Some(slot) = out.get_mut(at..at + 4) {
        slot.copy_from_slice(&value);
    }
}

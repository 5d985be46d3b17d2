//! What every file must lead to: a model that works, or an error.
#![allow(dead_code, reason = "each test takes some of them")]

use q3model::{FontInfo, GLYPHS_PER_FONT, Iqm, Md3, Mdr, Skin};

/// False when the file is refused.
pub fn survive_md3(bytes: &[u8]) -> bool {
    let Ok(model) = Md3::parse(bytes) else {
        return false;
    };
    assert!(!model.frames.is_empty());
    for surface in &model.surfaces {
        for frame in 0..model.frames.len() {
            let vertices = surface.frame_vertices(frame);
            assert_eq!(vertices.len(), surface.num_verts);
            for &corner in surface.triangles.iter().flatten() {
                let _ = vertices[corner as usize].position();
            }
        }
        assert_eq!(surface.st.len(), surface.num_verts);
    }
    model.lerp_tag("tag_head", -5, i32::MAX, 0.5);
    // The size of what was read is bounded by the file's.
    assert!(model.write().len() <= 5 * bytes.len() + 1000);
    true
}

/// False when the file is refused.
pub fn survive_mdr(bytes: &[u8]) -> bool {
    let Ok(model) = Mdr::parse(bytes) else {
        return false;
    };
    assert!(!model.frames.is_empty() && !model.lods.is_empty());
    let mut bones = Vec::new();
    model.pose(0, model.frames.len() - 1, 0.5, &mut bones);
    assert_eq!(bones.len(), model.num_bones);
    for surface in model.lods.iter().flatten() {
        for &corner in surface.triangles.iter().flatten() {
            surface.skinned(&surface.vertices[corner as usize], &bones);
        }
        assert!(
            surface
                .weights
                .iter()
                .all(|w| (w.bone as usize) < bones.len())
        );
    }
    for tag in &model.tags {
        assert!(model.lerp_tag(&tag.name, -5, i32::MAX, 0.5).is_some());
    }
    assert!(model.write(true).len() <= 5 * bytes.len() + 1000);
    true
}

/// False when the file is refused.
pub fn survive_iqm(bytes: &[u8]) -> bool {
    let Ok(model) = Iqm::parse(bytes) else {
        return false;
    };
    let mut matrices = Vec::new();
    let last = model.num_frames.saturating_sub(1);
    model.pose(&model.skeleton(), 0, last, 0.5, &mut matrices);
    assert!(matrices.is_empty() || matrices.len() == model.joints.len());
    for surface in &model.surfaces {
        let vertices = model.surface_vertices(surface);
        assert_eq!(vertices.len(), surface.num_vertices);
        for &corner in surface.triangles.iter().flatten() {
            vertices[corner as usize].skinned(&matrices);
        }
    }
    for joint in &model.joints {
        assert!(
            model
                .lerp_tag(&joint.name, i32::MIN, i32::MAX, 0.5)
                .is_some()
        );
    }
    assert!(model.write().len() <= 8 * bytes.len() + 1000);
    true
}

/// A skin, whose reader refuses nothing, and a font of the same bytes. False when the text names no surface.
pub fn survive_skin(text: &[u8]) -> bool {
    let skin = Skin::parse(text);
    assert!(skin.surfaces.len() <= text.len());
    for entry in &skin.surfaces {
        assert!(skin.shader_for(&entry.surface).is_some());
        assert!(!entry.surface.contains("tag_"));
    }
    if let Ok(font) = FontInfo::parse(text) {
        assert_eq!(font.glyphs.len(), GLYPHS_PER_FONT);
    }
    !skin.surfaces.is_empty()
}

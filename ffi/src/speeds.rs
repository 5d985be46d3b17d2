//! Output of `r_speeds`.

use renderer_vk::{FrameStats, Look, Renderer, Settings};

/// The lines of one frame: for 1 to 6 those of the engine's own renderer, in its order, with our counts; for the traced
/// look, which has no such counts, the frame's time.
pub fn lines(settings: &Settings, stats: &FrameStats, renderer: &Renderer) -> Vec<String> {
    if settings.speeds == 0 || settings.skip_back_end {
        return Vec::new();
    }
    if settings.rt == Look::Traced {
        let gpu: f32 = renderer.timings().iter().map(|(_, ms)| ms).sum();
        let mut line = format!(
            "{} views, {} draws; {gpu:.2} ms on the GPU in an earlier frame",
            stats.views, stats.draws
        );
        if let Some((to, ms)) = renderer.newest_latency() {
            line += &format!("; one {to} {ms:.1} ms after input");
        }
        return vec![line];
    }
    classic(settings.speeds, stats)
}

fn classic(speeds: i32, stats: &FrameStats) -> Vec<String> {
    let scene = &stats.scene;
    match speeds {
        1 => vec![format!(
            "{}/{} shaders/surfs {} leafs {} verts {}/{} tris {} draws {:.2} dc",
            scene.shaders,
            scene.surfaces,
            scene.leafs,
            scene.vertices,
            scene.triangles,
            scene.drawn_triangles,
            stats.draws,
            stats.overdraw
        )],
        2 => [("patch", scene.patches), ("md3", scene.models)]
            .map(|(what, counts)| {
                let (spheres, boxes) = (counts.spheres, counts.boxes);
                format!(
                    "({what}) {} sin {} sclip  {} sout {} bin {} bclip {} bout",
                    spheres.inside,
                    spheres.clipped,
                    spheres.outside,
                    boxes.inside,
                    boxes.clipped,
                    boxes.outside
                )
            })
            .to_vec(),
        3 => vec![format!("viewcluster: {}", scene.cluster)],
        4 if scene.lit_vertices > 0 => vec![format!(
            "dl srf:{}  culled:{}  verts:{}  tris:{}",
            scene.lit_surfaces, scene.unlit_surfaces, scene.lit_vertices, scene.lit_triangles
        )],
        5 => vec![format!("zFar: {:.0}", scene.far)],
        // only the GPU tests whether flares are covered
        6 => vec![format!("flare adds:{0} tests:{0}", scene.flares)],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_number_prints_its_own_lines() {
        let mut stats = FrameStats::default();
        stats.scene.cluster = 7;
        stats.scene.far = 1423.4;
        stats.scene.surfaces = 5;
        assert!(classic(1, &stats)[0].starts_with("0/5 shaders/surfs"));
        assert_eq!(classic(2, &stats).len(), 2);
        assert_eq!(classic(3, &stats), ["viewcluster: 7"]);
        assert!(classic(4, &stats).is_empty());
        assert_eq!(classic(5, &stats), ["zFar: 1423"]);
        stats.scene.lit_vertices = 9;
        assert_eq!(classic(4, &stats), ["dl srf:0  culled:0  verts:9  tris:0"]);
        assert!(classic(99, &stats).is_empty());
    }
}

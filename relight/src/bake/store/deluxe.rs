//! Deluxe maps: for each page of light a page of the directions that the light comes from.
//!
//! q3map2 (`-deluxe`) stores them as odd pages, after the page of light that each belongs to; surfaces have even numbers.
//! ioquake3's `opengl2` recognizes that. Keys of the world state it for other engines: `deluxeMapping` (XreaL and its
//! successors), `deluxeMaps` (DarkPlaces, FTE: 1 for directions in the space of the model, 2 in that of the surface).

use super::super::page::Page;
use glam::Vec3;
use q3bsp::{Bsp, entities};
use std::collections::BTreeSet;

/// The axes that directions are stored along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DirectionSpace {
    /// Those of the model (q3map2's default).
    #[default]
    Model,
    /// Those of the surface (q3map2 `-deluxemode 1`).
    Surface,
}

/// A texel of a page of directions: 127.5 of 255 is zero, as q3map2 stores it. `towards`: to the light, of any length; where it
/// is zero, the light comes along the normal.
pub fn direction_texel(towards: Vec3, normal: Vec3, space: DirectionSpace) -> Vec3 {
    let direction = towards.normalize_or(normal.normalize_or(Vec3::Z));
    let direction = match space {
        DirectionSpace::Model => direction,
        DirectionSpace::Surface => to_surface(direction, normal),
    };
    // bytes are rounded later and q3map2 cuts them off
    direction * 0.5 + 0.5 - 0.5 / 255.0
}

/// A direction in q3map2's axes of a surface with this normal.
fn to_surface(direction: Vec3, normal: Vec3) -> Vec3 {
    let n = normal.normalize_or(Vec3::Z);
    let (tangent, binormal) = match n.x == 0.0 && n.y == 0.0 {
        true => (Vec3::X * n.z.signum(), Vec3::Y),
        false => {
            let tangent = n.cross(Vec3::Z).normalize_or_zero();
            (tangent, tangent.cross(n).normalize_or_zero())
        }
    };
    let tangent = match n.x > 0.0 || n.y < 0.0 || n.z < 0.0 {
        true => -tangent,
        false => tangent,
    };
    Vec3::new(
        direction.dot(tangent),
        direction.dot(binormal),
        direction.dot(n),
    )
}

/// Smallest part of the texels of a page of directions that have the length of a direction.
const LIKELY: f32 = 0.9;

/// The axes of a map's deluxe maps, `None` if it has none: what the key `deluxeMaps` states, else model space where
/// surfaces have even pages alone and the pages after them hold unit vectors, as DarkPlaces and q3map2 have it.
pub fn space_of(bsp: &Bsp) -> Option<DirectionSpace> {
    let lit = bsp.surfaces.iter().filter(|s| s.lightmap >= 0);
    let used: BTreeSet<usize> = lit
        .filter_map(|s| usize::try_from(s.lightmap).ok())
        .collect();
    let pages = &bsp.lightmaps;
    let between = |page: &usize| page.is_multiple_of(2) && page + 1 < pages.len();
    if used.is_empty() || !used.iter().all(between) {
        return None;
    }
    let list = bsp.entities();
    match list.first().and_then(|world| world.last("deluxeMaps")) {
        Some("1") => return Some(DirectionSpace::Model),
        Some("2") => return Some(DirectionSpace::Surface),
        _ => {}
    }
    let texels = used.iter().filter_map(|page| pages.get(page + 1));
    let texels = texels.flat_map(|page| page.0.as_chunks::<3>().0);
    let (mut written, mut unit) = (0usize, 0usize);
    for texel in texels.filter(|texel| **texel != [0; 3]) {
        written += 1;
        unit += usize::from((direction(*texel).length() - 1.0).abs() < 0.1);
    }
    (written > 0 && unit as f32 >= LIKELY * written as f32).then_some(DirectionSpace::Model)
}

/// The direction that a texel of a page of directions holds.
pub fn direction(texel: [u8; 3]) -> Vec3 {
    Vec3::from_array(texel.map(f32::from)) / 127.5 - 1.0
}

/// Puts pages of directions at the places that a map with deluxe maps has for them: after the pages of light.
pub fn replace(pages: &mut [Page], directions: Vec<Page>) {
    let light = directions.into_iter().enumerate().step_by(2);
    for (number, page) in light {
        if let Some(slot) = pages.get_mut(number + 1) {
            *slot = page;
        }
    }
}

/// Puts pages of directions between those of light, and gives surfaces and the world's entity the numbers and keys of that.
/// Returns all pages, to be stored.
pub fn interleave(
    bsp: &mut Bsp,
    light: Vec<Page>,
    directions: Vec<Page>,
    space: DirectionSpace,
) -> Vec<Page> {
    for surface in bsp.surfaces.iter_mut().filter(|s| s.lightmap >= 0) {
        surface.lightmap = surface.lightmap.saturating_mul(2);
    }
    let mode = match space {
        DirectionSpace::Model => "1",
        DirectionSpace::Surface => "2",
    };
    let mut list = bsp.entities();
    if let Some(world) = list.first_mut() {
        for (key, value) in [("deluxeMapping", "1"), ("deluxeMaps", mode)] {
            let same = |(name, _): &(String, String)| name.eq_ignore_ascii_case(key);
            world.pairs.retain(|pair| !same(pair));
            world.pairs.push((key.to_owned(), value.to_owned()));
        }
        bsp.entities = entities::write(&list);
    }
    (light.into_iter().zip(directions))
        .flat_map(|(light, directions)| [light, directions])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::page::light_bytes;
    use super::super::tests::room;
    use super::*;

    #[test]
    fn directions_are_bytes_as_the_compiler_cuts_them_off() {
        for (direction, bytes) in [
            (Vec3::Z, [127, 127, 255]),
            (Vec3::new(0.0, -1.0, 0.0), [127, 0, 127]),
            (Vec3::new(0.6, 0.0, 0.8), [204, 127, 229]),
        ] {
            let texel = direction_texel(direction * 3.0, Vec3::X, DirectionSpace::Model);
            assert_eq!(light_bytes(texel), bytes);
        }
        let without = direction_texel(Vec3::ZERO, Vec3::Z, DirectionSpace::Model);
        assert_eq!(light_bytes(without), [127, 127, 255]);
    }

    #[test]
    fn light_along_the_normal_is_the_third_axis_of_a_surface() {
        for normal in [Vec3::Z, -Vec3::Z, Vec3::X, Vec3::new(0.6, -0.8, 0.0)] {
            let texel = direction_texel(normal, normal, DirectionSpace::Surface);
            assert_eq!(light_bytes(texel), [127, 127, 255], "{normal}");
        }
    }

    #[test]
    fn surfaces_show_the_even_pages() {
        let mut bsp = room();
        let before: Vec<i32> = bsp.surfaces.iter().map(|s| s.lightmap).collect();
        let pages = bsp.lightmaps.len();
        let (light, directions) = (vec![Page::blank(128); pages], vec![Page::blank(128); pages]);
        let all = interleave(&mut bsp, light, directions, DirectionSpace::Model);
        assert_eq!(all.len(), 2 * pages);
        for (surface, before) in bsp.surfaces.iter().zip(before) {
            assert_eq!(
                surface.lightmap,
                if before < 0 { before } else { 2 * before }
            );
        }
        assert_eq!(bsp.entities()[0].get("deluxeMaps"), Some("1"));
        assert_eq!(space_of(&bsp), None, "without pages");
        super::super::internal(&mut bsp, &all).unwrap();
        let read = Bsp::parse(&bsp.write()).unwrap();
        assert_eq!(space_of(&read), Some(DirectionSpace::Model));
    }

    #[test]
    fn pages_of_directions_are_recognized_without_a_key() {
        let mut bsp = room();
        let pages = bsp.lightmaps.len();
        let of = |texel: Vec3| Page {
            side: 128,
            texels: vec![texel; 128 * 128],
        };
        let up = direction_texel(Vec3::Z, Vec3::Z, DirectionSpace::Model);
        let (light, directions) = (vec![of(Vec3::ONE); pages], vec![of(up); pages]);
        let all = interleave(&mut bsp, light, directions, DirectionSpace::Surface);
        super::super::internal(&mut bsp, &all).unwrap();
        assert_eq!(space_of(&bsp), Some(DirectionSpace::Surface));
        let mut list = bsp.entities();
        list[0].pairs.retain(|(key, _)| !key.starts_with("deluxe"));
        bsp.entities = entities::write(&list);
        assert_eq!(space_of(&bsp), Some(DirectionSpace::Model));
        assert!(direction(bsp.lightmaps[1].texel(0, 0)).dot(Vec3::Z) > 0.99);
        // a second page of light is none of directions
        bsp.lightmaps[1] = bsp.lightmaps[0].clone();
        if pages == 1 {
            assert_eq!(space_of(&bsp), None);
        }
        let mut stored = vec![of(Vec3::ONE); all.len()];
        replace(&mut stored, vec![of(up); all.len()]);
        assert_eq!(stored[0].texel(0, 0), Vec3::ONE);
        assert_eq!(stored[1].texel(0, 0), up);
    }
}

//! What a bake shows when it is done.

use relight::bake::{Baked, BakedPage, Page, Stored, light_bytes};

use super::loading::Source;

/// Prints what was baked; for a map that keeps its coordinates also how far its pages are from those that it had.
pub fn report(source: &Source, stored: &Stored, baked: &Baked, pages: Option<&Vec<Page>>) {
    let name = &source.name;
    let lit = |page: &BakedPage| page.owners.iter().filter(|o| **o != u32::MAX).count();
    let texels: usize = baked.pages.iter().map(lit).sum();
    println!(
        "{name}: {} pages ({texels} texels), {} vertices, {} points of the light grid",
        baked.pages.len(),
        stored.vertices,
        stored.grid
    );
    if baked.unlit > 0 {
        log::warn!(
            "{name}: {} texels and vertices lie in solid and take the light of their neighbours",
            baked.unlit
        );
    }
    let mut differences: Vec<u8> = Vec::new();
    for baked in &baked.pages {
        let old = source.bsp.lightmaps.get(baked.number);
        let new = pages.and_then(|pages| pages.get(baked.number));
        let (Some(old), Some(new)) = (old, new) else {
            continue;
        };
        let texels = old.0.as_chunks::<3>().0.iter().zip(&new.texels);
        let covered = texels.zip(&baked.owners).filter(|(_, o)| **o != u32::MAX);
        differences.extend(covered.flat_map(|((old, new), _)| {
            let new = light_bytes(*new);
            (0..3).map(move |k| old[k].abs_diff(new[k]))
        }));
    }
    if !differences.is_empty() {
        differences.sort_unstable();
        let at = |part: usize| {
            let place = differences.len() * part / 100;
            differences.get(place).copied().unwrap_or(0)
        };
        println!(
            "{name}: lightmaps differ by {}/255 in the median from those that it had, 90 % by at most {}",
            at(50),
            at(90)
        );
    }
}

//! New lightmap coordinates for a map: charts of its surfaces, packed into blank pages.
//!
//! The texels of a flat surface lie on a grid along two axes of the world, as map compilers lay them, so that neighbours on
//! one plane sample the same places. Each axis is stretched by less than one texel, so that the first and the last texel lie
//! on the border of the surface: bilinear filtering then stays within the chart, and charts that end at a common edge have
//! their texels at the same points of it.

mod apply;
mod charts;
mod density;
mod grid;
mod material;
mod options;
mod owners;
mod pack;
mod shape;
#[cfg(test)]
mod tests;

pub use material::LightmapUse;
pub use options::{LayoutOptions, PageSides};
pub use owners::{NO_OWNER, Owners, owners};

use apply::Placed;
use charts::{Chart, Limits, Wanted};
use density::{median, of_models};
use pack::{Item, Place, pack};
use q3bsp::{Bsp, Surface, SurfaceKind, lightmap_index, surface_flags};
use shape::shape;

/// Reason why a map cannot be laid out.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// No surface can have a lightmap.
    #[error("no surface of the map can have a lightmap")]
    Nothing,
    /// More pages than an engine loads.
    #[error(
        "{needed} pages of {side} texels per side are needed, and engines load {most}; {fits} times as fine fits"
    )]
    TooMany {
        /// Pages of the wanted layout.
        needed: usize,
        /// Texels per side of a page.
        side: u32,
        /// Most pages.
        most: usize,
        /// Largest factor found that fits, in place of [`LayoutOptions::finer`].
        fits: f32,
    },
    /// A page that no chart fits.
    #[error("pages of {side} texels per side with a border of {border} have no room")]
    Page {
        /// Texels per side.
        side: u32,
        /// Border around each chart.
        border: u32,
    },
}

/// A surface whose texels are farther apart than wanted, because the chart would not fit a page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coarser {
    /// First surface of the chart.
    pub surface: u32,
    /// Wanted distance between texels, id units.
    pub wanted: f32,
    /// Used distance.
    pub used: f32,
}

/// What [`make`] made.
#[derive(Debug, Clone, PartialEq)]
pub struct LayoutReport {
    /// Texels per side of each page.
    pub side: u32,
    /// Pages.
    pub pages: usize,
    /// Charts.
    pub charts: usize,
    /// Surfaces in them.
    pub surfaces: usize,
    /// Texels of charts, without borders.
    pub texels: u64,
    /// Charts that are coarser than wanted.
    pub coarser: Vec<Coarser>,
    /// Surfaces in charts whose materials also show light of further styles, at places of the former pages: that light is
    /// lost, and [`store::external::scripted`](super::store::external::scripted) removes its stages.
    pub styled: Vec<u32>,
    /// Surfaces that should have a lightmap and stay lit by vertex, because they cannot be laid flat.
    pub without: Vec<u32>,
    /// Vertices that were copied because surfaces shared them.
    pub copied_vertices: usize,
    /// Chart of every texel, and of every surface.
    pub owners: Owners,
}

impl LayoutReport {
    /// Part of the pages' texels that is in charts.
    pub fn efficiency(&self) -> f64 {
        let all = self.pages as u64 * u64::from(self.side) * u64::from(self.side);
        self.texels as f64 / all.max(1) as f64
    }
}

/// Surface flags of compilers' shaders that exclude a lightmap.
const WITHOUT_LIGHTMAP: u32 = surface_flags::SKY
    | surface_flags::NODRAW
    | surface_flags::NOLIGHTMAP
    | surface_flags::POINTLIGHT
    | surface_flags::SKIP
    | surface_flags::HINT;

/// Gives a map new lightmap coordinates and blank pages in place of its own.
///
/// In a map that has lightmaps, the surfaces that have one get a new one, and texels are [`LayoutOptions::finer`] times as
/// dense per axis as they were. In a map without (q3map2 without `-light` leaves all surfaces lit by vertex), all flat
/// surfaces and patches get one, but for those whose shader excludes it. Triangle soups are always lit by vertex: engines
/// ignore their lightmaps. The map then holds pages of a size that its format may not have; see
/// [`store`](super::store).
///
/// # Errors
/// [`LayoutError`]; the map is as it was.
pub fn make(bsp: &mut Bsp, options: &LayoutOptions<'_>) -> Result<LayoutReport, LayoutError> {
    let wanted = wanted(bsp, options);
    let plan = plan(bsp, &wanted, options)?;
    if plan.pages == 0 {
        return Err(LayoutError::Nothing);
    }
    if plan.pages > options.most_pages {
        return Err(LayoutError::TooMany {
            needed: plan.pages,
            side: plan.side,
            most: options.most_pages,
            fits: fitting(bsp, options, plan.pages),
        });
    }
    let placed: Vec<Placed<'_>> = (plan.charts.iter().zip(&plan.places))
        .map(|(chart, &place)| Placed {
            chart,
            place,
            border: options.border,
            side: plan.side,
        })
        .collect();
    let copied_vertices = apply::apply(bsp, &placed, plan.pages, plan.side);
    let rectangles = placed.iter().map(|placed| {
        let (x, y) = (placed.place.x, placed.place.y);
        let (columns, rows) = bordered(placed.chart, options.border);
        let surfaces = placed.chart.parts.iter().map(|part| part.0).collect();
        let page = placed.place.page;
        (page, [x, y, columns, rows], surfaces)
    });
    let owners = Owners::of_rectangles(rectangles, bsp.surfaces.len(), plan.pages, plan.side);
    let area = |chart: &Chart| u64::from(chart.width) * u64::from(chart.height);
    Ok(LayoutReport {
        side: plan.side,
        pages: plan.pages,
        charts: plan.charts.len(),
        surfaces: plan.charts.iter().map(|chart| chart.parts.len()).sum(),
        texels: plan.charts.iter().map(area).sum(),
        coarser: plan.charts.iter().filter_map(coarser).collect(),
        styled: styled(bsp, options),
        without: plan.without,
        copied_vertices,
        owners,
    })
}

fn coarser(chart: &Chart) -> Option<Coarser> {
    let (wanted, used) = chart.coarser?;
    let surface = chart.parts.first()?.0;
    Some(Coarser {
        surface,
        wanted,
        used,
    })
}

/// The surfaces with a page whose materials show styles.
fn styled(bsp: &Bsp, options: &LayoutOptions<'_>) -> Vec<u32> {
    let shaders: Vec<bool> = (bsp.shaders.iter())
        .map(|shader| (options.material)(&shader.name).styled)
        .collect();
    let is_styled = |s: &Surface| shaders.get(s.shader.index()).copied().unwrap_or(false);
    (0u32..)
        .zip(&bsp.surfaces)
        .filter(|(_, surface)| surface.lightmap >= 0 && is_styled(surface))
        .map(|(number, _)| number)
        .collect()
}

/// Charts and their places.
struct Plan {
    charts: Vec<Chart>,
    places: Vec<Place>,
    pages: usize,
    side: u32,
    without: Vec<u32>,
}

fn plan(bsp: &Bsp, wanted: &[Wanted], options: &LayoutOptions<'_>) -> Result<Plan, LayoutError> {
    let (PageSides::Fixed(most) | PageSides::UpTo(most)) = options.sides;
    let room = |side: u32| side.saturating_sub(options.border.saturating_mul(2));
    if room(most) < 2 {
        return Err(LayoutError::Page {
            side: most,
            border: options.border,
        });
    }
    let limits = Limits {
        most: room(most),
        finer: options.finer,
    };
    let (charts, without) = charts::charts(bsp, wanted, limits);
    let items: Vec<Item> = (charts.iter())
        .map(|chart| {
            let (width, height) = bordered(chart, options.border);
            let group = chart.shader;
            Item {
                width,
                height,
                group,
            }
        })
        .collect();
    let mut side = match options.sides {
        PageSides::Fixed(side) => side,
        PageSides::UpTo(_) => 128.min(most),
    };
    let longest = (items.iter()).map(|item| item.width.max(item.height)).max();
    let area: u64 = (items.iter())
        .map(|item| u64::from(item.width) * u64::from(item.height))
        .sum();
    // a hostile map may have far more surfaces than pages could hold
    let whole = u64::from(most) * u64::from(most);
    let least = usize::try_from(area.div_ceil(whole)).unwrap_or(usize::MAX);
    if least > options.most_pages.saturating_mul(2) {
        return Ok(Plan {
            charts,
            places: Vec::new(),
            pages: least,
            side: most,
            without,
        });
    }
    loop {
        let next = side.saturating_mul(2).min(most);
        let fits = longest.is_none_or(|longest| longest <= side)
            && area <= u64::from(side) * u64::from(side);
        if fits || side == most {
            let (places, pages) = pack(&items, side);
            if pages <= 1 || side == most {
                return Ok(Plan {
                    charts,
                    places,
                    pages,
                    side,
                    without,
                });
            }
        }
        side = next;
    }
}

/// Columns and rows of a chart with its border.
fn bordered(chart: &Chart, border: u32) -> (u32, u32) {
    (chart.width + 2 * border, chart.height + 2 * border)
}

/// A factor in place of `finer` by which the layout fits: found by trial, in steps of the square root of the excess.
fn fitting(bsp: &Bsp, options: &LayoutOptions<'_>, needed: usize) -> f32 {
    let mut options = *options;
    let mut needed = needed;
    for _ in 0..8 {
        let ratio = options.most_pages as f32 / needed.max(1) as f32;
        // rounded down to one digit, and smaller at each trial
        let next = (options.finer * ratio.sqrt() * 10.0).floor() / 10.0;
        let next = next.min(options.finer - 0.1);
        if next < 0.1 {
            break;
        }
        options.finer = next;
        match plan(bsp, &wanted(bsp, &options), &options) {
            Ok(plan) if plan.pages > options.most_pages => needed = plan.pages,
            Ok(_) => return next,
            Err(_) => break,
        }
    }
    0.1
}

/// Whether any surface of a map has a lightmap page.
pub fn has_layout(bsp: &Bsp) -> bool {
    let drawn = |s: &&Surface| matches!(s.kind, SurfaceKind::Planar | SurfaceKind::Patch);
    bsp.surfaces.iter().filter(drawn).any(|s| s.lightmap >= 0)
}

/// The surfaces that are to have charts.
fn wanted(bsp: &Bsp, options: &LayoutOptions<'_>) -> Vec<Wanted> {
    let lit = has_layout(bsp);
    let uses: Vec<LightmapUse> = (bsp.shaders.iter())
        .map(|shader| (options.material)(&shader.name))
        .collect();
    let models = of_models(bsp, &bsp.entities());
    let mut model_of = vec![0; bsp.surfaces.len()];
    for (number, model) in bsp.models.iter().enumerate() {
        let of_model = model_of.get_mut(bsp.model_surfaces(model));
        of_model.unwrap_or_default().fill(number as u32);
    }
    let mut found: Vec<(Wanted, Option<f32>)> = Vec::new();
    for ((number, surface), &model) in (0u32..).zip(&bsp.surfaces).zip(&model_of) {
        let flags = bsp.shader(surface.shader).surface_flags;
        let material = uses
            .get(surface.shader.index())
            .copied()
            .unwrap_or_default();
        let by_vertex = surface.lightmap == lightmap_index::BY_VERTEX;
        let image = material.image.filter(|_| by_vertex);
        let page = match lit {
            true => surface.lightmap >= 0,
            false => by_vertex,
        };
        let drawn = match surface.kind {
            SurfaceKind::Planar => surface.num_indices > 0,
            SurfaceKind::Patch => true,
            _ => false,
        };
        let shown = (page && material.shows_page) || image.is_some();
        if !drawn || !shown || flags & WITHOUT_LIGHTMAP != 0 {
            continue;
        }
        let shape = shape(bsp, surface);
        let own_side = lit.then(|| bsp.lightmap_size() as u32);
        let present = match image.or(own_side) {
            Some(side) => density::present(bsp, surface, &shape, side),
            None => {
                let of_model = models.get(model as usize);
                of_model.map(|m| m.sample(material.sample_size, options.sample_size))
            }
        };
        let wanted = Wanted {
            surface: number,
            model,
            shader: u32::try_from(surface.shader.raw()).unwrap_or(0),
            sample: 0.0,
            shape,
        };
        found.push((wanted, present));
    }
    // a chart that compilers reduced to one texel has no density of its own
    let usual = median(found.iter().filter_map(|(_, present)| *present).collect());
    let usual = usual.unwrap_or(options.sample_size);
    let finer = if options.finer.is_finite() {
        options.finer.max(0.01)
    } else {
        1.0
    };
    (found.into_iter())
        .map(|(wanted, present)| Wanted {
            sample: present.unwrap_or(usual) / finer,
            ..wanted
        })
        .collect()
}

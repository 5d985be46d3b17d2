//! Which chart each texel of the pages belongs to.

use crate::world::{RelitWorld, WorldSurface};
use glam::{Vec2, Vec3};
use std::collections::{BTreeSet, HashMap};
use support::slice::item;

/// Owner of a texel or surface that is in no chart.
pub const NO_OWNER: u32 = u32::MAX;

/// Charts of texels and surfaces.
#[derive(Clone, PartialEq, Default)]
pub struct Owners {
    /// Texels per side of a page.
    pub side: usize,
    /// For each page the chart of each texel, row by row; [`NO_OWNER`] for texels of none.
    pub pages: Vec<Box<[u32]>>,
    /// For each surface of the map its chart, or [`NO_OWNER`].
    pub of_surface: Vec<u32>,
    /// Texels that surfaces of different charts show. Compilers store equal charts once, and uniform ones as a single texel:
    /// new light for one of the surfaces changes the others.
    pub shared: usize,
}

impl std::fmt::Debug for Owners {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Owners")
            .field("side", &self.side)
            .field("pages", &self.pages.len())
            .field("of_surface", &self.of_surface)
            .field("shared", &self.shared)
            .finish()
    }
}

impl Owners {
    /// Of rectangles: page, left, upper, columns, rows, and the surfaces.
    pub(super) fn of_rectangles(
        rectangles: impl IntoIterator<Item = (u32, [u32; 4], Vec<u32>)>,
        surfaces: usize,
        pages: usize,
        side: u32,
    ) -> Owners {
        let side = side as usize;
        let mut owners = Owners::none(pages, side, surfaces);
        for (chart, (page, [x, y, columns, rows], members)) in (0u32..).zip(rectangles) {
            let page = owners.pages.get_mut(page as usize);
            let lines = page.map(|page| page.chunks_mut(side.max(1)));
            for line in lines
                .into_iter()
                .flatten()
                .skip(y as usize)
                .take(rows as usize)
            {
                let columns = x as usize..(x + columns) as usize;
                line.get_mut(columns).unwrap_or_default().fill(chart);
            }
            for member in members {
                if let Some(owner) = owners.of_surface.get_mut(member as usize) {
                    *owner = chart;
                }
            }
        }
        owners
    }

    fn none(pages: usize, side: usize, surfaces: usize) -> Owners {
        Owners {
            side,
            pages: vec![vec![NO_OWNER; side * side].into(); pages],
            of_surface: vec![NO_OWNER; surfaces],
            shared: 0,
        }
    }
}

/// The charts of a map's present coordinates, without those of pages that scripts name: the texels that each surface's
/// triangles touch, and those next to them that no other surface touches. Surfaces on one plane whose texels have the same
/// places in the world are one chart.
pub fn owners(world: &RelitWorld) -> Owners {
    let pages = world.bsp.lightmaps.len();
    let side = world.bsp.lightmap_size();
    let mut owners = Owners::none(pages, side, world.surfaces.len());
    let mut joined = Joined::new(world);
    let mut shared: BTreeSet<(usize, usize)> = BTreeSet::new();
    for margin in [0, 1] {
        for (number, surface) in (0u32..).zip(&world.surfaces) {
            let page = usize::try_from(surface.lightmap).ok();
            let Some((page, owned)) = page.and_then(|p| Some((p, owners.pages.get_mut(p)?))) else {
                continue;
            };
            let touched = texels_of(world, surface, side, margin);
            for texel in touched {
                let Some(owner) = owned.get_mut(texel) else {
                    continue;
                };
                if *owner == NO_OWNER {
                    *owner = number;
                } else if margin == 0 && *owner != number && !joined.join(*owner, number) {
                    shared.insert((page, texel));
                }
            }
        }
    }
    owners.shared = shared.len();
    // numbers of charts in place of surfaces
    let mut charts: HashMap<u32, u32> = HashMap::new();
    for (number, surface) in (0u32..).zip(&world.surfaces) {
        if surface.lightmap >= 0 && surface.num_indices > 0 {
            let next = charts.len() as u32;
            let chart = *charts.entry(joined.root(number)).or_insert(next);
            if let Some(owner) = owners.of_surface.get_mut(number as usize) {
                *owner = chart;
            }
        }
    }
    for owner in owners.pages.iter_mut().flat_map(|page| page.iter_mut()) {
        if *owner != NO_OWNER {
            *owner = charts
                .get(&joined.root(*owner))
                .copied()
                .unwrap_or(NO_OWNER);
        }
    }
    owners
}

/// Indices of the texels of a page whose squares, `margin` texels larger on each side, meet a surface's triangles.
fn texels_of(world: &RelitWorld, surface: &WorldSurface, side: usize, margin: u32) -> Vec<usize> {
    let scale = side as f32;
    // a little smaller, so that a triangle that ends between two texels does not meet the second one
    let half = 0.5 + margin as f32 - 1e-3;
    let mut found = Vec::new();
    for triangle in surface.triangles() {
        let corners = world.corners(triangle).map(|v| v.lightmap * scale);
        let low = corners.into_iter().reduce(Vec2::min).unwrap_or(Vec2::ZERO);
        let high = corners.into_iter().reduce(Vec2::max).unwrap_or(Vec2::ZERO);
        let most = side.saturating_sub(1) as f32;
        let first = (low - half - 0.5)
            .floor()
            .clamp(Vec2::ZERO, Vec2::splat(most));
        let last = (high + half).floor().clamp(Vec2::ZERO, Vec2::splat(most));
        for y in first.y as usize..=last.y as usize {
            for x in first.x as usize..=last.x as usize {
                let middle = Vec2::new(x as f32, y as f32) + 0.5;
                if meets(&corners, middle, half) {
                    found.push(y * side + x);
                }
            }
        }
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Whether a triangle and a square meet: no axis of the square, and no normal of an edge, separates them.
fn meets(corners: &[Vec2; 3], middle: Vec2, half: f32) -> bool {
    let edges = [0, 1, 2].map(|i| {
        let next = item(&[1usize, 2, 0], i);
        (item(corners, next) - item(corners, i)).perp()
    });
    [Vec2::X, Vec2::Y].into_iter().chain(edges).all(|axis| {
        let reach = half * (axis.x.abs() + axis.y.abs());
        let along = corners.map(|corner| axis.dot(corner - middle));
        let (low, high) = along
            .into_iter()
            .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), v| {
                (l.min(v), h.max(v))
            });
        low <= reach && high >= -reach
    })
}

/// Surfaces that are one chart, as a forest.
struct Joined<'a> {
    world: &'a RelitWorld,
    parents: Vec<u32>,
    /// Places of texels in the world, of each surface once it is needed.
    maps: HashMap<u32, Option<TexelMap>>,
    known: HashMap<(u32, u32), bool>,
}

/// Where texels of a flat surface are: `origin` + x · `across` + y · `down`.
#[derive(Debug, Clone, Copy)]
struct TexelMap {
    normal: Vec3,
    origin: Vec3,
    across: Vec3,
    down: Vec3,
}

impl<'a> Joined<'a> {
    fn new(world: &'a RelitWorld) -> Joined<'a> {
        Joined {
            world,
            parents: (0u32..).take(world.surfaces.len()).collect(),
            maps: HashMap::new(),
            known: HashMap::new(),
        }
    }

    fn root(&mut self, surface: u32) -> u32 {
        let mut at = surface;
        loop {
            let parent = item(&self.parents, at as usize);
            if parent == at {
                return at;
            }
            let above = item(&self.parents, parent as usize);
            if let Some(slot) = self.parents.get_mut(at as usize) {
                *slot = above;
            }
            at = above;
        }
    }

    /// Joins two surfaces that are continuous; returns whether they are.
    fn join(&mut self, a: u32, b: u32) -> bool {
        if let Some(&known) = self.known.get(&(a, b)) {
            return known;
        }
        let continuous = self.continuous(a, b);
        self.known.insert((a, b), continuous);
        if continuous {
            let (a, b) = (self.root(a), self.root(b));
            if let Some(parent) = self.parents.get_mut(a.max(b) as usize) {
                *parent = a.min(b);
            }
        }
        continuous
    }

    fn continuous(&mut self, a: u32, b: u32) -> bool {
        let models = [a, b].map(|s| self.world.surfaces.get(s as usize).map(|s| s.model));
        let (Some(first), Some(second)) = (self.map(a), self.map(b)) else {
            return false;
        };
        // the middle of the second surface's texels, seen from both
        let step = first.across.length().max(first.down.length());
        models[0] == models[1]
            && first.normal.dot(second.normal) > 0.999
            && (first.across - second.across).length() < 0.02 * step
            && (first.down - second.down).length() < 0.02 * step
            && (first.origin - second.origin).length() < 0.5 * step
    }

    fn map(&mut self, surface: u32) -> Option<TexelMap> {
        let world = self.world;
        *(self.maps.entry(surface)).or_insert_with(|| texel_map(world, surface))
    }
}

/// Places of a flat surface's texels, by its largest triangle.
fn texel_map(world: &RelitWorld, surface: u32) -> Option<TexelMap> {
    let surface = world.surfaces.get(surface as usize)?;
    let normal = surface.plane?.normal;
    let side = world.bsp.lightmap_size() as f32;
    let largest = surface.triangles().max_by(|a, b| {
        let area = |t: usize| {
            let [a, b, c] = world.corners(t).map(|v| v.lightmap);
            (b - a).perp_dot(c - a).abs()
        };
        area(*a).total_cmp(&area(*b))
    })?;
    let corners = world.corners(largest);
    let [a, b, c] = corners.map(|v| v.lightmap * side);
    let [pa, pb, pc] = corners.map(|v| v.position);
    let (u, v) = (b - a, c - a);
    let area = u.perp_dot(v);
    if area.abs() < 1e-3 {
        return None;
    }
    let across = ((pb - pa) * v.y - (pc - pa) * u.y) / area;
    let down = ((pc - pa) * u.x - (pb - pa) * v.x) / area;
    Some(TexelMap {
        normal,
        origin: pa - across * a.x - down * a.y,
        across,
        down,
    })
}

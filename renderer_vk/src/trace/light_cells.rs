//! Cells: subdivisions of clusters, each with its own light list.
//!
//! The contribution of a light varies within a large cluster: selection probabilities that fit one end do not fit the
//! other. Leafs of the map's tree are therefore split along a grid, as fine as the time to estimate the lists allows,
//! and the tree that shaders walk is extended to the pieces: a few more steps of a walk reach a better list.

use std::collections::HashMap;

use glam::Vec3;
use q3bsp::{Bsp, Child, LeafId};
use relight::light::TriangleLight;
use shaders::trace_types::BspNode;
use support::Aabb;

use super::light_normal_bins::{NormalBins, normal_bins};

/// Grid edges that are tried, units, from the finest; if none fits, clusters stay whole.
const SIDES: [f32; 7] = [128.0, 192.0, 256.0, 384.0, 512.0, 1024.0, 2048.0];

/// Maximum number of entries of all lists with cells, which rays estimate while a map is loaded.
const MOST_ENTRIES: f64 = 2_621_440.0;

/// Distance behind a light's plane, units, from which a cell's list omits the light: a shaded point uses the cell one
/// unit in front of it.
const BEHIND: f32 = 1.5;

/// A part of a cluster.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// Number of the cluster.
    pub cluster: usize,
    /// Bounds.
    pub bounds: Aabb,
}

impl Cell {
    /// Centre and half diagonal.
    pub fn ball(&self) -> (Vec3, f32) {
        let size = self.bounds.size();
        (self.bounds.mins + size * 0.5, size.length() * 0.5)
    }

    /// Whether the cell lies wholly behind a one-sided light.
    pub fn behind(&self, light: &TriangleLight) -> bool {
        let normal = light.normal();
        let in_front = (self.bounds.farthest(normal) - light.vertices[0]).dot(normal);
        !light.two_sided && in_front < -BEHIND
    }
}

/// The cells of a map, and the tree that finds them.
#[derive(Debug, Default)]
pub struct Cells {
    /// The map's nodes, then the nodes that split leafs.
    pub nodes: Vec<BspNode>,
    /// Index of the cell of each leaf of the tree; -1: none.
    pub leaf_cells: Vec<i32>,
    /// The cells.
    pub cells: Vec<Cell>,
    /// For each cell, sample points on its surfaces by normal.
    pub normal_bins: Vec<NormalBins>,
}

/// A leaf, or part of a leaf, to be split.
#[derive(Clone, Copy)]
struct Piece {
    cluster: usize,
    bounds: Aabb,
    /// Grid range that it covers: from, to (excluded).
    from: [i32; 3],
    to: [i32; 3],
}

impl Piece {
    fn new(cluster: usize, bounds: Aabb, side: f32) -> Self {
        #[allow(clippy::cast_possible_truncation)] // saturates for damaged maps
        let index = |v: f32| v as i32;
        let from = (bounds.mins / side).floor().to_array().map(index);
        let mut to = (bounds.maxs / side).ceil().to_array().map(index);
        for (to, from) in to.iter_mut().zip(from) {
            *to = (*to).max(from.saturating_add(1));
        }
        Self {
            cluster,
            bounds,
            from,
            to,
        }
    }

    fn sizes(&self) -> [f64; 3] {
        let [a, b, c] = self.from;
        let [d, e, f] = self.to;
        [(d, a), (e, b), (f, c)].map(|(to, from)| f64::from(to) - f64::from(from))
    }
}

/// State and result of splitting.
struct Cutter {
    side: f32,
    made: Cells,
    /// Index of the cell by cluster and grid position.
    known: HashMap<(usize, [i32; 3]), usize>,
}

impl Cutter {
    /// Index of the cell of a piece that lies in one grid box; the cell's bounds grow by the piece's.
    fn cell(&mut self, piece: &Piece) -> i32 {
        let cells = &mut self.made.cells;
        let index = *self
            .known
            .entry((piece.cluster, piece.from))
            .or_insert_with(|| {
                cells.push(Cell {
                    cluster: piece.cluster,
                    bounds: piece.bounds,
                });
                cells.len() - 1
            });
        if let Some(cell) = cells.get_mut(index) {
            cell.bounds = cell.bounds.union(piece.bounds);
        }
        i32::try_from(index).unwrap_or(-1)
    }

    /// Splits a piece; returns the child index for its parent node.
    fn cut(&mut self, piece: Piece) -> i32 {
        let sizes = piece.sizes();
        let axis = (0..3).fold(0, |a, b| if sizes.get(b) > sizes.get(a) { b } else { a });
        let (from, to) = (piece.from[axis], piece.to[axis]);
        if to - from <= 1 {
            let cell = self.cell(&piece);
            self.made.leaf_cells.push(cell);
            return i32::try_from(self.made.leaf_cells.len()).map_or(-1, |n| -n);
        }
        let middle = from + (to - from) / 2;
        #[allow(clippy::cast_precision_loss)] // between the piece's bounds
        let dist = middle as f32 * self.side;
        let index = self.made.nodes.len();
        self.made.nodes.push(BspNode::default());
        let (mut front, mut back) = (piece, piece);
        for (part, bound) in [
            (&mut front.bounds.mins, dist),
            (&mut back.bounds.maxs, dist),
        ] {
            part[axis] = bound;
        }
        for (part, bound) in [(&mut front.from, middle), (&mut back.to, middle)] {
            part[axis] = bound;
        }
        let children = [self.cut(front), self.cut(back)];
        let normal = Vec3::AXES[axis];
        if let Some(node) = self.made.nodes.get_mut(index) {
            *node = BspNode {
                plane: normal.extend(dist).to_array(),
                children,
            };
        }
        i32::try_from(index).unwrap_or(-1)
    }
}

impl Cells {
    /// Cells of a map with `clusters` clusters; `length`: number of entries of a cluster's list.
    pub fn new(bsp: &Bsp, clusters: usize, length: impl Fn(usize) -> usize) -> Self {
        let leafs: Vec<(LeafId, usize, Aabb)> = bsp
            .tree_leafs()
            .into_iter()
            .filter_map(|id| {
                let leaf = bsp.leaf(id);
                let cluster = leaf.cluster_index()?;
                #[allow(clippy::cast_precision_loss)] // map coordinates
                let [a, b] = [leaf.mins, leaf.maxs].map(|v| Vec3::from(v.map(|x| x as f32)));
                (cluster < clusters).then_some((id, cluster, Aabb::of([a, b])))
            })
            .collect();
        #[allow(clippy::cast_precision_loss)] // lengths of lists
        let entries = |side: f32| -> f64 {
            let of = |&(_, cluster, bounds): &(LeafId, usize, Aabb)| {
                let sizes = Piece::new(cluster, bounds, side).sizes();
                sizes.iter().product::<f64>() * length(cluster) as f64
            };
            leafs.iter().map(of).sum()
        };
        let fine = SIDES
            .into_iter()
            .filter(|&side| entries(side) <= MOST_ENTRIES)
            .map(|side| Self::cut(bsp, &leafs, Some(side), &length))
            .find(|cells| cells.entries(&length) <= MOST_ENTRIES);
        fine.unwrap_or_else(|| {
            let mut whole = Self::cut(bsp, &leafs, None, &length);
            if whole.entries(&length) > MOST_ENTRIES {
                whole.normal_bins.fill_with(NormalBins::default);
            }
            whole
        })
    }

    /// Number of entries of all lists: per cell one list for all normals, and one for each normal bin with surfaces.
    fn entries(&self, length: impl Fn(usize) -> usize) -> f64 {
        let cells = self.cells.iter().zip(&self.normal_bins);
        let lists = cells.map(|(cell, normal_bins)| {
            let lists = 1 + normal_bins
                .iter()
                .filter(|points| !points.is_empty())
                .count();
            #[allow(clippy::cast_precision_loss)] // lengths of lists
            let entries = (lists * length(cell.cluster)) as f64;
            entries
        });
        lists.sum()
    }

    /// Splits leafs, given by id, cluster and bounds, along a grid; without a grid they stay whole.
    fn cut(
        bsp: &Bsp,
        leafs: &[(LeafId, usize, Aabb)],
        side: Option<f32>,
        length: impl Fn(usize) -> usize,
    ) -> Self {
        let nodes = bsp.nodes.iter().map(|node| {
            let plane = bsp.plane(node.plane);
            BspNode {
                plane: plane.normal.extend(plane.dist).to_array(),
                children: node.children.map(Child::raw),
            }
        });
        let mut cutter = Cutter {
            side: side.unwrap_or(1.0),
            made: Cells {
                nodes: nodes.collect(),
                leaf_cells: vec![-1; bsp.leafs.len()],
                ..Cells::default()
            },
            known: HashMap::new(),
        };
        // child index that replaces each leaf
        let mut instead: Vec<Option<i32>> = vec![None; bsp.leafs.len()];
        for &(id, cluster, bounds) in leafs {
            // Clusters without lights stay whole: such a leaf may be as large as the map.
            let piece = match side.filter(|_| length(cluster) > 0) {
                Some(side) => Piece::new(cluster, bounds, side),
                None => Piece {
                    cluster,
                    bounds,
                    from: [0; 3],
                    to: [1; 3],
                },
            };
            if piece.sizes() == [1.0; 3] {
                let cell = cutter.cell(&piece);
                if let Some(slot) = cutter.made.leaf_cells.get_mut(id.index()) {
                    *slot = cell;
                }
            } else if let Some(slot) = instead.get_mut(id.index()) {
                *slot = Some(cutter.cut(piece));
            }
        }
        let mut made = cutter.made;
        for node in made.nodes.iter_mut().take(bsp.nodes.len()) {
            for child in &mut node.children {
                if let Child::Leaf(leaf) = Child::from_raw(*child)
                    && let Some(Some(other)) = instead.get(leaf.index())
                {
                    *child = *other;
                }
            }
        }
        made.normal_bins = normal_bins(bsp, &made.cells);
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::builder::MapBuilder;
    use testkit::Random;

    /// Walks the tree as shaders do.
    fn cell_at(cells: &Cells, p: Vec3) -> i32 {
        let mut index = 0i32;
        while index >= 0 {
            let node = cells.nodes[index as usize];
            let [x, y, z, dist] = node.plane;
            let front = Vec3::new(x, y, z).dot(p) >= dist;
            index = node.children[usize::from(!front)];
        }
        cells.leaf_cells[(-1 - index) as usize]
    }

    fn halls() -> Bsp {
        let mut map = MapBuilder::new();
        map.add_cell(Vec3::ZERO, Vec3::new(2000.0, 300.0, 100.0));
        map.add_cell(Vec3::new(2100.0, 0.0, 0.0), Vec3::new(2200.0, 100.0, 100.0));
        map.set_sees(0, 1, true);
        map.build()
    }

    #[test]
    fn points_find_the_cell_of_their_cluster_that_they_lie_in() {
        let bsp = halls();
        let cells = Cells::new(&bsp, 2, |_| 10);
        assert!(cells.cells.len() > 10, "{}", cells.cells.len());
        let mut random = Random::new(1);
        let mut random = |most: f32| random.uniform() * most;
        for _ in 0..2000 {
            let p = Vec3::new(random(2300.0), random(320.0), random(110.0)) - 5.0;
            let (cluster, cell) = (bsp.cluster_at(p), cell_at(&cells, p));
            let Ok(index) = usize::try_from(cell) else {
                assert_eq!(cluster, -1, "{p}");
                continue;
            };
            let cell = &cells.cells[index];
            assert_eq!(cell.cluster as i32, cluster, "{p}");
            assert!(cell.bounds.grown(Vec3::ONE).touches(Aabb::of([p])));
            assert!(cell.bounds.size().max_element() <= SIDES[0]);
        }
    }

    #[test]
    fn clusters_without_lights_stay_whole_however_large_they_are() {
        let mut bsp = halls();
        for leaf in bsp.leafs.iter_mut().filter(|leaf| leaf.cluster == 0) {
            (leaf.mins, leaf.maxs) = ([i32::MIN; 3], [i32::MAX; 3]);
        }
        let cells = Cells::new(&bsp, 2, |cluster| cluster * 10);
        let of_first = cells.cells.iter().filter(|cell| cell.cluster == 0);
        assert_eq!(of_first.count(), 1);
        assert!(cell_at(&cells, Vec3::splat(50.0)) >= 0);
    }

    #[test]
    fn long_lists_leave_clusters_whole() {
        let bsp = halls();
        let cells = Cells::new(&bsp, 2, |_| 1 << 22);
        assert_eq!(cells.cells.len(), 2);
        assert_eq!(cells.nodes.len(), bsp.nodes.len());
        // clusters outside of the light lists have no cell
        assert_eq!(
            Cells::new(&bsp, 1, |_| 1)
                .cells
                .iter()
                .map(|c| c.cluster)
                .max(),
            Some(0)
        );
    }

    #[test]
    fn a_cell_is_behind_a_light_only_with_all_of_it() {
        let cell = Cell {
            cluster: 0,
            bounds: Aabb::new(Vec3::ZERO, Vec3::splat(10.0)),
        };
        let light = |z: f32, up: f32, two_sided| TriangleLight {
            vertices: [Vec3::Z * z, Vec3::new(1.0, 0.0, z), Vec3::new(0.0, up, z)],
            radiance: Vec3::ONE,
            two_sided,
            surface: 0,
            triangle: 0,
            model: 0,
            is_sky: false,
            source: relight::light::EmissionSource::SurfaceLight,
        };
        assert!(cell.behind(&light(12.0, 1.0, false)));
        assert!(!cell.behind(&light(12.0, -1.0, false)));
        assert!(!cell.behind(&light(12.0, 1.0, true)));
        assert!(!cell.behind(&light(11.0, 1.0, false)));
        assert!(!cell.behind(&light(5.0, 1.0, false)));
    }
}

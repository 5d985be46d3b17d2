//! Light lists as shaders read them: for each cell one row per normal bin.
//!
//! The lists that cells want ([`light_lists`](super::light_lists)) are as long as their cluster's, and most of their
//! entries say nearly the same. A row therefore states only the lights whose probability differs most from the mean
//! over its cluster, and takes the others from the row of the cluster. Every light keeps a probability above 0, so that
//! the estimate stays unbiased; the number of own lights follows from the variance that the difference would cost.

use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use support::slice::{self, part};

use super::light_cells::Cells;
use super::light_lists::{ListsOfCell, Member, listed};
use super::light_normal_bins::NORMAL_BINS;
use super::light_tables::{Entry, append_table, probabilities, usable};
use super::light_weights::Listed;
use super::lights::{MapLightSource, count};
use crate::at_once::{Late, Make, make_all};

/// Lists up to this length are stored whole: shaders evaluate each of their lights if they draw as many candidates.
const SHORT: usize = 8;

/// Part of the draws from a row with a parent that are from the parent.
const PARENT_PART: f64 = 1.0 / c::PARENT_DRAWS as f64;

/// Maximum number of slots of all rows: 14 MiB.
const MOST_SLOTS: usize = 14 << 16;

/// Maximum number of slots of the clusters' rows: 4 MiB.
const MOST_CLUSTER_SLOTS: usize = 1 << 18;

/// Excess variance of a row, relative to drawing in proportion to the estimated light: the first that is tried. It is
/// doubled until the rows have at most [`MOST_SLOTS`] slots.
const LEAST_EXCESS: f64 = 0.05;

/// Number of cells for which one thread works at a time.
const CELLS_AT_ONCE: usize = 16;

/// The results of `make` for each item, in order, made on all cores.
fn on_all_cores<T: Sync, R: Send + Sync>(items: &[T], make: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let make = &make;
    let made: Vec<_> = (items.chunks(CELLS_AT_ONCE))
        .map(|part| Late::new(move || part.iter().map(make).collect::<Vec<R>>()))
        .collect();
    let all: Vec<&dyn Make> = made.iter().map(|late| late as &dyn Make).collect();
    make_all(&all);
    made.into_iter().flat_map(Late::take).collect()
}

/// The slots of all rows.
#[derive(Default)]
struct Slots(Vec<t::LightSlot>);

impl Slots {
    /// Adds those of a row for all lights of a list.
    fn add_whole(&mut self, list: &[Entry], place: &Placement) -> t::LightRow {
        let first = self.0.len();
        append_table(&mut self.0, list, &probabilities(list), |_, exact| exact);
        self.row(first, c::NO_PARENT, place)
    }

    /// Adds those of a row for some lights of a list. `parent`: the row with the others; `of_parent`: its probability
    /// of each light in `list`.
    fn add_part(
        &mut self,
        list: &[Entry],
        parent: u32,
        of_parent: &[f64],
        place: &Placement,
    ) -> t::LightRow {
        // how much the probability of each light exceeds that by the parent's draws
        let wanted = probabilities(list);
        let missing: Vec<f64> = (wanted.iter().zip(of_parent))
            .map(|(wanted, of_parent)| (wanted - PARENT_PART * of_parent).max(wanted * PARENT_PART))
            .collect();
        let sum: f64 = missing.iter().sum();
        let own: Vec<f64> = missing.iter().map(|missing| missing / sum).collect();
        let first = self.0.len();
        append_table(&mut self.0, list, &own, |i, exact| {
            let of_parent = of_parent.get(i).copied().unwrap_or(0.0);
            (1.0 - PARENT_PART) * exact + PARENT_PART * of_parent
        });
        self.row(first, parent, place)
    }

    /// The slots of a row.
    fn of(&self, row: &t::LightRow) -> &[t::LightSlot] {
        part(&self.0, slice::span(row.first, row.count))
    }

    /// The row of the slots from `first` to the last.
    fn row(&self, first: usize, parent: u32, place: &Placement) -> t::LightRow {
        t::LightRow {
            first: count(first),
            count: count(self.0.len() - first),
            parent,
            flags: place.flags,
            cluster: place.cluster,
        }
    }
}

/// What rows of a cluster have in common.
struct Placement {
    cluster: u32,
    /// `LIGHT_ROW_*`.
    flags: u32,
}

impl Placement {
    fn of(source: &MapLightSource<'_>, cluster: usize) -> Self {
        let cluster = i32::try_from(cluster).unwrap_or(i32::MAX);
        let lists = source.lists;
        let suns = if lists.sees_sky(cluster) {
            c::LIGHT_ROW_SUNS
        } else {
            0
        };
        let swept = if lists.shares(cluster).is_empty() {
            0
        } else {
            c::LIGHT_ROW_SWEPT
        };
        Self {
            cluster: cluster.unsigned_abs(),
            flags: suns | swept,
        }
    }

    /// For points in no cluster.
    fn nowhere() -> Self {
        Self {
            cluster: u32::MAX,
            flags: c::LIGHT_ROW_SUNS,
        }
    }
}

/// A cluster's lights, and the row that its cells' rows take lights from.
struct Cluster<'a> {
    listed: &'a [Listed<'a>],
    place: Placement,
    parent: u32,
    /// The parent's probability of each light of `listed`.
    of_parent: Vec<f64>,
}

impl Cluster<'_> {
    fn entry(&self, member: &Member) -> Option<Entry> {
        let light = slice::get(self.listed, member.index as usize)?;
        Some(Entry {
            light: light.number,
            share: member.share,
            visibility: member.visibility,
        })
    }

    fn of_parent(&self, member: &Member) -> f64 {
        let known = slice::get(&self.of_parent, member.index as usize);
        known.copied().unwrap_or(f64::MIN_POSITIVE)
    }

    /// Adds the slots of a list; returns its row. `shared`: the rows that cells refer to, from index `first` on.
    fn add(
        &self,
        list: &Stated<'_>,
        shared: &[t::LightRow],
        first: usize,
        slots: &mut Slots,
    ) -> t::LightRow {
        match list {
            Stated::Whole(list) => {
                let list: Vec<Entry> = list.iter().filter_map(|m| self.entry(m)).collect();
                slots.add_whole(&list, &self.place)
            }
            Stated::Part(list) if list.is_empty() => {
                let parent = shared.get((self.parent as usize).wrapping_sub(first));
                t::LightRow {
                    flags: self.place.flags,
                    cluster: self.place.cluster,
                    ..parent.copied().unwrap_or_default()
                }
            }
            Stated::Part(list) => {
                let of_parent: Vec<f64> = list.iter().map(|m| self.of_parent(m)).collect();
                let list: Vec<Entry> = list.iter().filter_map(|m| self.entry(m)).collect();
                slots.add_part(&list, self.parent, &of_parent, &self.place)
            }
        }
    }

    /// The lights of a list that its row has to state, so that the variance exceeds the least by at most `excess`.
    fn stated<'m>(&self, list: &'m [Member], excess: f64) -> Vec<&'m Member> {
        let share = |member: &Member| f64::from(usable(member.share));
        let total: f64 = list.iter().map(share).sum();
        // The variance of a sum that is drawn with the probabilities q from the shares s is proportional to the sum of
        // s²/q.
        let mut costs: Vec<(f64, f64, &Member)> = (list.iter())
            .map(|member| {
                let share = share(member) / total.max(f64::MIN_POSITIVE);
                let cost = share * share / (PARENT_PART * self.of_parent(member));
                (cost, share, member)
            })
            .collect();
        costs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.index.cmp(&b.2.index)));
        // The stated lights, together of the share S, get the other draws in proportion to their shares: S²/(1 - p).
        let most = 1.0 / (1.0 - PARENT_PART) + excess;
        let mut left: f64 = costs.iter().map(|(cost, ..)| cost).sum();
        let mut stated = 0.0;
        let count = (costs.iter())
            .take_while(|(cost, share, _)| {
                let more = left + stated * stated / (1.0 - PARENT_PART) > most;
                left -= cost;
                stated += share;
                more
            })
            .count();
        let mut stated: Vec<&Member> = costs.iter().take(count).map(|(.., m)| *m).collect();
        stated.sort_by_key(|member| member.index);
        stated
    }
}

/// A list as its row states it.
enum Stated<'m> {
    /// All of its lights.
    Whole(&'m [Member]),
    /// These, and the parent's.
    Part(Vec<&'m Member>),
}

impl Stated<'_> {
    fn slots(&self) -> usize {
        match self {
            Self::Whole(list) => list.len(),
            Self::Part(list) => list.len(),
        }
    }
}

/// How each list of each cell is stated with at most `most` slots in all.
fn stated<'m>(
    cells: &Cells,
    lists: &'m [ListsOfCell],
    clusters: &[Cluster<'_>],
    most: usize,
) -> Vec<Vec<Stated<'m>>> {
    let work: Vec<(usize, &ListsOfCell)> = cells
        .cells
        .iter()
        .map(|cell| cell.cluster)
        .zip(lists)
        .collect();
    let mut excess = LEAST_EXCESS;
    loop {
        let of_list = |cluster: usize, list: &'m Vec<Member>| match clusters.get(cluster) {
            Some(cluster) if list.len() > SHORT || excess > LEAST_EXCESS => {
                Stated::Part(cluster.stated(list, excess))
            }
            _ => Stated::Whole(list),
        };
        let made: Vec<Vec<Stated<'m>>> = on_all_cores(&work, |&(cluster, lists)| {
            lists.lists().map(|list| of_list(cluster, list)).collect()
        });
        let slots: usize = made.iter().flatten().map(Stated::slots).sum();
        // Without bound a row states no light.
        if slots <= most || !excess.is_finite() {
            return made;
        }
        excess *= 2.0;
    }
}

/// The clusters, and the rows that their cells refer to: that of all lights, and after it those of clusters. `first`:
/// index of the former.
fn clusters<'a>(
    source: &MapLightSource<'_>,
    listed_in: &'a [Vec<Listed<'a>>],
    cells: &Cells,
    lists: &[ListsOfCell],
    slots: &mut Slots,
    first: usize,
    everywhere: &[Entry],
) -> (Vec<Cluster<'a>>, Vec<t::LightRow>) {
    let mut rows = vec![slots.add_whole(everywhere, &Placement::nowhere())];
    let mut means: Vec<Vec<Entry>> = (listed_in.iter())
        .map(|listed| {
            let entry = |light: &Listed<'_>| Entry {
                light: light.number,
                share: 0.0,
                visibility: light.visibility,
            };
            listed.iter().map(entry).collect()
        })
        .collect();
    for (cell, lists) in cells.cells.iter().zip(lists) {
        let Some(mean) = means.get_mut(cell.cluster) else {
            continue;
        };
        for list in lists.lists() {
            let total: f32 = list.iter().map(|member| usable(member.share)).sum();
            for member in list {
                if let Some(entry) = slice::get_mut(mean, member.index as usize) {
                    entry.share += usable(member.share) / total.max(f32::MIN_POSITIVE);
                }
            }
        }
    }
    // The longest lists may not fit; cells of their clusters refer to the row of all lights.
    let mut order: Vec<usize> = (0..means.len()).collect();
    order.sort_by_key(|&cluster| means.get(cluster).map_or(0, Vec::len));
    let mut parents = vec![None; means.len()];
    let mut used = 0;
    for cluster in order {
        let mean = means.get(cluster).map_or(&[][..], Vec::as_slice);
        used += mean.len();
        if used > MOST_CLUSTER_SLOTS {
            break;
        }
        if let Some(parent) = parents.get_mut(cluster) {
            *parent = Some(count(first + rows.len()));
            rows.push(slots.add_whole(mean, &Placement::of(source, cluster)));
        }
    }
    let row_of = |parent: Option<u32>| {
        rows.get(parent.map_or(0, |row| (row as usize).saturating_sub(first)))
    };
    let each = listed_in.iter().zip(&parents).enumerate();
    let clusters = each.map(|(cluster, (listed, &parent))| {
        let parent_slots = row_of(parent).map_or(&[][..], |row| slots.of(row));
        let of_parent = |light: &Listed<'_>| {
            let found = parent_slots.binary_search_by_key(&light.number, |slot| slot.light);
            let slot = found.ok().and_then(|at| parent_slots.get(at));
            slot.map_or(f64::MIN_POSITIVE, |slot| f64::from(slot.chance))
        };
        Cluster {
            listed,
            place: Placement::of(source, cluster),
            parent: parent.unwrap_or(count(first)),
            of_parent: listed.iter().map(of_parent).collect(),
        }
    });
    let clusters = clusters.collect();
    (clusters, rows)
}

/// Rows and slots of all lists: `NORMAL_BINS` rows for each cell, the row of all lights, then those of clusters.
pub fn rows(
    source: &MapLightSource<'_>,
    numbers: &[Option<u32>],
    cells: &Cells,
) -> (Vec<t::LightRow>, Vec<t::LightSlot>) {
    let count_of_clusters = i32::try_from(source.lists.clusters()).unwrap_or(i32::MAX);
    let listed_in: Vec<Vec<Listed<'_>>> = (0..count_of_clusters)
        .map(|cluster| listed(source, numbers, cluster))
        .collect();
    let work: Vec<_> = cells.cells.iter().zip(&cells.normal_bins).collect();
    let lists: Vec<ListsOfCell> = on_all_cores(&work, |(cell, normal_bins)| {
        let listed = listed_in.get(cell.cluster).map_or(&[][..], Vec::as_slice);
        ListsOfCell::new(source, cell, normal_bins, listed)
    });
    let everywhere = listed(source, numbers, -1);
    let everywhere = everywhere.iter().map(|light| Entry {
        light: light.number,
        share: light.power() * light.visibility,
        visibility: light.visibility,
    });
    let everywhere: Vec<Entry> = everywhere.collect();
    let mut slots = Slots::default();
    let first_shared = cells.cells.len() * NORMAL_BINS;
    let (clusters, shared) = clusters(
        source,
        &listed_in,
        cells,
        &lists,
        &mut slots,
        first_shared,
        &everywhere,
    );
    let mut rows = Vec::with_capacity(first_shared + shared.len());
    let stated = stated(
        cells,
        &lists,
        &clusters,
        MOST_SLOTS.saturating_sub(slots.0.len()),
    );
    for ((cell, lists), stated) in cells.cells.iter().zip(&lists).zip(&stated) {
        let Some(cluster) = clusters.get(cell.cluster) else {
            // Cells are of the clusters that have lists.
            rows.extend([t::LightRow::default(); NORMAL_BINS]);
            continue;
        };
        let mut added = stated
            .iter()
            .map(|stated| cluster.add(stated, &shared, first_shared, &mut slots));
        let of_all = added.next().unwrap_or_default();
        for bin in &lists.bins {
            let own = bin.as_ref().and_then(|_| added.next());
            rows.push(own.unwrap_or(of_all));
        }
    }
    rows.extend(shared);
    (rows, slots.0)
}

#[cfg(test)]
mod tests {
    use super::super::light_cells::Cells;
    use super::super::light_weights::tests::lamp;
    use super::*;
    use glam::Vec3;
    use q3bsp::builder::MapBuilder;
    use relight::light::{LightLists, LightShare, TriangleLight};

    /// A hall with lamps below its ceiling, in `clusters` clusters side by side, whose lists all have all lamps.
    struct Hall {
        bsp: q3bsp::Bsp,
        lamps: Vec<TriangleLight>,
        lists: LightLists,
    }

    impl Hall {
        fn new(clusters: usize, lamps: usize) -> Self {
            let mut map = MapBuilder::new();
            let stone = map.add_shader("stone", 0, 0);
            for cluster in 0..clusters {
                let at = Vec3::X * 300.0 * cluster as f32;
                map.add_cell(at, at + Vec3::new(300.0, 300.0, 200.0));
                let corners = [Vec3::ZERO, Vec3::Y, Vec3::ONE - Vec3::Z, Vec3::X];
                map.add_quad(stone, corners.map(|p| at + p * 300.0));
            }
            let width = 300.0 * clusters as f32;
            let lamp_number = |i: usize| {
                let at = Vec3::new(
                    (i as f32 * 0.618_034).fract() * width,
                    (i as f32 * 0.414_214).fract() * 300.0,
                    190.0,
                );
                lamp(at, Vec3::NEG_Z, 1.0 + (i % 7) as f32)
            };
            let rows = clusters + 1;
            let all: Vec<u32> = (0..count(lamps)).collect();
            let share = LightShare {
                bare: 1.0,
                visible: 0.5,
            };
            Self {
                bsp: map.build(),
                lamps: (0..lamps).map(lamp_number).collect(),
                lists: LightLists {
                    offsets: (0..=rows).map(|row| count(row * lamps)).collect(),
                    lights: all.repeat(rows),
                    triangle_lights: count(lamps),
                    sky: vec![true; clusters],
                    shares: vec![share; clusters * lamps],
                },
            }
        }

        fn rows(&self) -> (Cells, Vec<t::LightRow>, Vec<t::LightSlot>) {
            let source = MapLightSource {
                triangles: &self.lamps,
                ..MapLightSource::empty(&self.lists)
            };
            let cells = Cells::new(&self.bsp, self.lists.clusters(), |_| self.lamps.len());
            let numbers: Vec<Option<u32>> = (0..count(self.lamps.len())).map(Some).collect();
            let (rows, slots) = rows(&source, &numbers, &cells);
            (cells, rows, slots)
        }
    }

    fn slots_of<'a>(row: &t::LightRow, slots: &'a [t::LightSlot]) -> &'a [t::LightSlot] {
        &slots[row.first as usize..(row.first + row.count) as usize]
    }

    /// Probability of each light by the row's own table.
    fn by_table(row: &t::LightRow, slots: &[t::LightSlot], lights: usize) -> Vec<f64> {
        let slots = slots_of(row, slots);
        let mut drawn = vec![0.0; lights];
        for slot in slots {
            let part = 1.0 / slots.len() as f64;
            let threshold = f64::from(slot.fractions & 0xFFFF) / 65535.0;
            drawn[slot.light as usize] += part * threshold;
            drawn[slots[slot.alias as usize].light as usize] += part * (1.0 - threshold);
        }
        drawn
    }

    #[test]
    fn rows_state_the_probabilities_of_their_draws() {
        let hall = Hall::new(3, 200);
        let (cells, rows, slots) = hall.rows();
        let (mut parts, mut stated_slots, mut whole_slots) = (0, 0, 0);
        for row in &rows[..cells.cells.len() * NORMAL_BINS] {
            let mut drawn = by_table(row, &slots, hall.lamps.len());
            let mut stated = vec![None; hall.lamps.len()];
            for slot in slots_of(row, &slots) {
                stated[slot.light as usize] = Some(f64::from(slot.chance));
            }
            if row.parent != c::NO_PARENT {
                parts += 1;
                let parent = &rows[row.parent as usize];
                assert_eq!(parent.parent, c::NO_PARENT);
                let of_parent = by_table(parent, &slots, hall.lamps.len());
                let own = 1.0 - PARENT_PART;
                for (light, drawn) in drawn.iter_mut().enumerate() {
                    *drawn = own * *drawn + PARENT_PART * of_parent[light];
                }
                for slot in slots_of(parent, &slots) {
                    let by_parent = PARENT_PART * f64::from(slot.chance);
                    stated[slot.light as usize].get_or_insert(by_parent);
                }
                stated_slots += row.count;
                whole_slots += parent.count;
            }
            let lights = slots_of(row, &slots).iter().map(|slot| slot.light);
            assert!(lights.is_sorted());
            for (drawn, stated) in drawn.iter().zip(stated) {
                let stated = stated.expect("lamps shine on all cells");
                assert!(*drawn > 0.0 && (drawn / stated - 1.0).abs() < 1.0e-5);
            }
        }
        assert!(parts > cells.cells.len(), "{parts}");
        assert!(
            stated_slots * 2 < whole_slots,
            "{stated_slots} {whole_slots}"
        );
    }

    #[test]
    fn memory_does_not_grow_with_lights_times_cells() {
        // 60 clusters times 6,000 lamps do not fit into the clusters' slots
        let hall = Hall::new(60, 6000);
        let (cells, rows, slots) = hall.rows();
        assert!(slots.len() <= MOST_SLOTS, "{}", slots.len());
        let all = &rows[cells.cells.len() * NORMAL_BINS];
        assert_eq!(all.count, 6000);
        let parents: std::collections::HashSet<u32> = (rows.iter())
            .map(|row| row.parent)
            .filter(|&parent| parent != c::NO_PARENT)
            .collect();
        assert!(parents.contains(&count(cells.cells.len() * NORMAL_BINS)));
        assert!(parents.len() > 10, "{}", parents.len());
    }
}

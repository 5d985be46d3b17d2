//! Rectangles packed into square pages by the skyline bottom-left heuristic.
//!
//! Source: J. Jylänki, "A Thousand Ways to Pack the Bin", 2010, section 2.3.

use std::cmp::Reverse;
use std::collections::BTreeMap;

/// A rectangle to place, texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Item {
    /// Columns, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Rectangles of one group should share pages.
    pub group: u32,
}

/// Where a rectangle lies.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Page, from 0.
    pub page: u32,
    /// Left column.
    pub x: u32,
    /// Upper row.
    pub y: u32,
}

/// A run of columns that are filled down to the same row.
#[derive(Debug, Clone, Copy)]
struct Step {
    x: u32,
    y: u32,
    width: u32,
}

/// A page being filled.
struct Skyline {
    side: u32,
    steps: Vec<Step>,
    /// A rectangle that found no room; larger ones need not be tried.
    refused: Option<(u32, u32)>,
}

impl Skyline {
    fn new(side: u32) -> Skyline {
        let whole = Step {
            x: 0,
            y: 0,
            width: side,
        };
        Skyline {
            side,
            steps: vec![whole],
            refused: None,
        }
    }

    /// The lowest row at which a rectangle of this width can begin at a step.
    fn row_at(&self, first: usize, width: u32) -> Option<u32> {
        let start = self.steps.get(first)?;
        if start.x + width > self.side {
            return None;
        }
        let spanned = self.steps.iter().skip(first);
        let spanned = spanned.take_while(|step| step.x < start.x + width);
        spanned.map(|step| step.y).max()
    }

    /// Places a rectangle where its lower edge lies highest on the page; `None` without room.
    fn insert(&mut self, width: u32, height: u32) -> Option<(u32, u32)> {
        if self.refused.is_some_and(|(w, h)| width >= w && height >= h) {
            return None;
        }
        let rows = (0..self.steps.len()).filter_map(|at| {
            let y = self.row_at(at, width)?;
            (y + height <= self.side).then_some((y, at))
        });
        let Some((y, at)) = rows.min() else {
            let smaller = |(w, h): (u32, u32)| u64::from(w) * u64::from(h);
            let area = u64::from(width) * u64::from(height);
            if self.refused.is_none_or(|refused| smaller(refused) > area) {
                self.refused = Some((width, height));
            }
            return None;
        };
        let x = self.steps.get(at)?.x;
        let top = Step {
            x,
            y: y + height,
            width,
        };
        let end = x + width;
        let mut steps = Vec::with_capacity(self.steps.len() + 2);
        steps.extend(self.steps.iter().take(at));
        steps.push(top);
        for step in self.steps.iter().skip(at) {
            let right = step.x + step.width;
            if right > end {
                let from = step.x.max(end);
                steps.push(Step {
                    x: from,
                    y: step.y,
                    width: right - from,
                });
            }
        }
        steps.dedup_by(|next, step| {
            let level = next.y == step.y;
            if level {
                step.width += next.width;
            }
            level
        });
        self.steps = steps;
        Some((x, y))
    }
}

/// Packs rectangles that are no larger than a page. Returns their places and the number of pages; the result depends on the
/// arguments alone.
///
/// Groups are placed one after the other, the largest first, and the rectangles of a group from high to low. A rectangle goes
/// into a page that its group is in already, else into the newest page with room, else into a new one.
pub(super) fn pack(items: &[Item], side: u32) -> (Vec<Place>, usize) {
    let area = |item: &Item| u64::from(item.width) * u64::from(item.height);
    let mut group_areas: BTreeMap<u32, u64> = BTreeMap::new();
    for item in items {
        *group_areas.entry(item.group).or_default() += area(item);
    }
    let mut order: Vec<(usize, &Item)> = items.iter().enumerate().collect();
    order.sort_by_key(|(index, item)| {
        let of_group = group_areas.get(&item.group).copied().unwrap_or(0);
        let size = (Reverse(item.height), Reverse(item.width));
        (Reverse(of_group), item.group, size, *index)
    });
    let mut pages: Vec<Skyline> = Vec::new();
    let mut places = vec![Place::default(); items.len()];
    let mut group = None;
    let mut of_group: Vec<usize> = Vec::new();
    for (index, item) in order {
        if group != Some(item.group) {
            group = Some(item.group);
            of_group.clear();
        }
        let put = |page: usize, pages: &mut [Skyline]| {
            let (x, y) = pages.get_mut(page)?.insert(item.width, item.height)?;
            let page = page as u32;
            Some(Place { page, x, y })
        };
        let known = of_group.iter().find_map(|&page| put(page, &mut pages));
        let found = known.or_else(|| {
            let newest_first = (0..pages.len()).rev();
            let mut others = newest_first.filter(|page| !of_group.contains(page));
            others.find_map(|page| put(page, &mut pages))
        });
        let found = found.or_else(|| {
            pages.push(Skyline::new(side));
            put(pages.len() - 1, &mut pages)
        });
        if let (Some(found), Some(place)) = (found, places.get_mut(index)) {
            *place = found;
            if !of_group.contains(&(found.page as usize)) {
                of_group.push(found.page as usize);
            }
        }
    }
    (places, pages.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn equal_squares_fill_pages_without_a_gap() {
        let square = Item {
            width: 16,
            height: 16,
            group: 0,
        };
        let (places, pages) = pack(&[square; 128], 128);
        assert_eq!(pages, 2);
        assert_eq!(places.iter().filter(|p| p.page == 0).count(), 64);
    }

    #[test]
    fn a_small_group_fills_the_room_that_others_leave() {
        let item = |width, height, group| Item {
            width,
            height,
            group,
        };
        let items = [item(100, 128, 1), item(20, 20, 2), item(100, 128, 3)];
        let (places, pages) = pack(&items, 128);
        assert_eq!(pages, 2);
        assert_eq!(places[1].page, 1, "the newest page with room");
    }

    proptest! {
        #![proptest_config(testkit::cases(64))]

        #[test]
        fn rectangles_lie_inside_and_never_overlap(
            sizes in prop::collection::vec((1u32..=64, 1u32..=64, 0u32..5), 1..120),
        ) {
            let items: Vec<Item> = sizes
                .iter()
                .map(|&(width, height, group)| Item { width, height, group })
                .collect();
            let (places, pages) = pack(&items, 64);
            prop_assert_eq!(pack(&items, 64), (places.clone(), pages));
            let mut taken = vec![false; pages * 64 * 64];
            for (item, place) in items.iter().zip(&places) {
                prop_assert!(place.x + item.width <= 64 && place.y + item.height <= 64);
                for y in place.y..place.y + item.height {
                    for x in place.x..place.x + item.width {
                        let texel = &mut taken[((place.page * 64 + y) * 64 + x) as usize];
                        prop_assert!(!*texel);
                        *texel = true;
                    }
                }
            }
            let last = (pages - 1) * 64 * 64;
            prop_assert!(taken[last..].contains(&true), "no page is empty");
        }
    }
}

//! Access to lists by indices that are in range by construction.
//!
//! An index out of range is a bug: it fails an assertion in debug builds. Release builds return an empty part, a default
//! or `None`, so that a frame continues without the missing item.

use std::ops::Range;
use std::slice::SliceIndex;

/// The places of `count` items from `first` on.
pub fn span(first: u32, count: u32) -> Range<usize> {
    let first = first as usize;
    first..first.saturating_add(count as usize)
}

/// The part of a list in a range that the list has.
#[track_caller]
pub fn part<T>(list: &[T], range: impl SliceIndex<[T], Output = [T]>) -> &[T] {
    let part = list.get(range);
    debug_assert!(part.is_some(), "outside the {} items", list.len());
    part.unwrap_or_default()
}

/// [`part`], to change it.
#[track_caller]
pub fn part_mut<T>(list: &mut [T], range: impl SliceIndex<[T], Output = [T]>) -> &mut [T] {
    let length = list.len();
    let part = list.get_mut(range);
    debug_assert!(part.is_some(), "outside the {length} items");
    part.unwrap_or_default()
}

/// The item of a list at an index that the list has.
#[track_caller]
pub fn item<T: Copy + Default>(list: &[T], index: usize) -> T {
    let item = list.get(index);
    debug_assert!(item.is_some(), "{index} of {}", list.len());
    item.copied().unwrap_or_default()
}

/// [`item`] by reference; `None` in release builds where the list does not have it.
#[track_caller]
pub fn get<T>(list: &[T], index: usize) -> Option<&T> {
    let entry = list.get(index);
    debug_assert!(entry.is_some(), "{index} of {}", list.len());
    entry
}

/// [`get`], to change it.
#[track_caller]
pub fn get_mut<T>(list: &mut [T], index: usize) -> Option<&mut T> {
    let length = list.len();
    let entry = list.get_mut(index);
    debug_assert!(entry.is_some(), "{index} of {length}");
    entry
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_what_the_range_says() {
        let mut list = [1, 2, 3, 4];
        assert_eq!(part(&list, span(1, 2)), [2, 3]);
        assert_eq!(part(&list, 4..), []);
        part_mut(&mut list, ..1).fill(9);
        assert_eq!(item(&list, 0), 9);
        assert_eq!(get(&list, 3), get_mut(&mut list.clone(), 3).as_deref());
    }

    #[test]
    #[cfg_attr(debug_assertions, should_panic(expected = "outside the 2 items"))]
    fn a_range_beyond_the_list_names_nothing() {
        assert_eq!(part(&[1, 2], span(1, 2)), []);
    }
}

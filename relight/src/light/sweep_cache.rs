//! Swept light lists in files of the cache folder, beside the calibrations.
//!
//! The file name is the hash of everything that the lists depend on: the map's bytes, its lights' geometry and
//! powers, the lists before the sweep, and [`VERSION`]. So a file is either current or absent; a damaged or foreign
//! file counts as absent and gives a warning.
//!
//! Format, all numbers little-endian: a header of [`MAGIC`], version, key, number of clusters, of entries before
//! and after the sweep, and of clusters without a receiver; one bit for each entry before the sweep, set if it is
//! kept, in the order of the rows; two 16-bit numbers for each kept entry, its [`LightShare`] ([`pack()`]); a hash
//! of all that. Kept entries are a subset of the existing ones, so no file can name a light that does not exist.

use super::sweep::SweepReport;
use super::{LightLists, LightShare};
use crate::cache::{CacheError, CalibrationCache, add_world, read_file};
use crate::world::RelitWorld;
use support::hash::Hash;

/// Version; to be incremented when the same world gives other lists.
const VERSION: u32 = 2;

/// First bytes of a file.
const MAGIC: &[u8; 16] = b"relight-lists\r\n\0";

/// Bytes of the header, and of the hash at the end.
const HEADER: usize = 16 + 4 + 16 + 4 * 4;
const END: usize = 16;

/// Extension of the files.
const KIND: &str = "lists";

/// Hash of everything that sweeping a world's lists depends on.
fn key(world: &RelitWorld) -> u128 {
    let mut hash = Hash::new();
    hash.number(u64::from(VERSION));
    add_world(&mut hash, world);
    for &index in &world.indices {
        hash.number(u64::from(index));
    }
    for light in &world.point_lights {
        hash.number(u64::from(light.radius.to_bits()));
        hash.number(u64::from(light.falloff.reach().unwrap_or(0.0).to_bits()));
        if let Some(spot) = light.spot {
            hash.vector(spot.direction);
            hash.number(u64::from(spot.tan_half_angle.to_bits()));
        }
    }
    let lists = &world.light_lists;
    for &number in lists.offsets.iter().chain(&lists.lights) {
        hash.number(u64::from(number));
    }
    hash.finish()
}

/// A share in 32 bits: the upper half of its `f32` light, at most 0.8 % below the value, and the visible part in
/// 65535ths, rounded up.
pub(super) fn pack(share: LightShare) -> [u16; 2] {
    let bare = share.bare.clamp(0.0, f32::MAX);
    let bare = if bare.is_finite() { bare } else { 0.0 };
    let visible = (share.visible * 65535.0).ceil().clamp(1.0, 65535.0);
    [(bare.to_bits() >> 16) as u16, visible as u16]
}

/// Inverse of [`pack()`]; `None` for values that it never gives.
fn unpack([bare, visible]: [u16; 2]) -> Option<LightShare> {
    let bare = f32::from_bits(u32::from(bare) << 16);
    let right = bare.is_finite() && bare.is_sign_positive() && visible > 0;
    right.then_some(LightShare {
        bare,
        visible: f32::from(visible) / 65535.0,
    })
}

/// A share after packing and unpacking, so that cached lists equal fresh ones.
pub(super) fn rounded(share: LightShare) -> LightShare {
    unpack(pack(share)).unwrap_or(LightShare::UNKNOWN)
}

/// Number of entries of all clusters.
fn entries(lists: &LightLists) -> usize {
    let end = lists.offsets.get(lists.clusters()).copied().unwrap_or(0);
    (end as usize).min(lists.lights.len())
}

/// Bytes of a file. `old`: the lists before the sweep; `new`: after it.
fn print(key: u128, old: &LightLists, new: &LightLists, unseen: usize) -> Vec<u8> {
    let [before, after] = [entries(old), entries(new)];
    let mut bytes = Vec::with_capacity(HEADER + before / 8 + 1 + after * 4 + END);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(key.to_le_bytes());
    for number in [old.clusters(), before, after, unseen] {
        bytes.extend((number as u32).to_le_bytes());
    }
    let mut mask = vec![0u8; before.div_ceil(8)];
    let mut at = 0;
    for cluster in 0..old.clusters() as i32 {
        let kept = new.row(cluster);
        for entry in old.row(cluster) {
            if kept.binary_search(entry).is_ok()
                && let Some(byte) = mask.get_mut(at / 8)
            {
                *byte |= 1 << (at % 8);
            }
            at += 1;
        }
    }
    bytes.extend(mask);
    for share in new.shares.iter().take(after) {
        bytes.extend(pack(*share).into_iter().flat_map(u16::to_le_bytes));
    }
    let mut hash = Hash::new();
    hash.bytes(&bytes);
    bytes.extend(hash.finish().to_le_bytes());
    bytes
}

/// Parses the bytes of [`print()`] for the lists `old`: the swept lists, and the number of clusters without a
/// receiver; else what is wrong.
fn parse(bytes: &[u8], key: u128, old: &LightLists) -> Result<(LightLists, usize), &'static str> {
    let rest = bytes.strip_prefix(MAGIC).ok_or("not lists of lights")?;
    let (version, _) = rest.split_first_chunk::<4>().ok_or("cut off")?;
    if u32::from_le_bytes(*version) != VERSION {
        return Err("of another version");
    }
    let (whole, end) = bytes.split_last_chunk::<END>().ok_or("cut off")?;
    let mut hash = Hash::new();
    hash.bytes(whole);
    if hash.finish() != u128::from_le_bytes(*end) {
        return Err("cut off or damaged");
    }
    let (header, rest) = whole.split_at_checked(HEADER).ok_or("cut off")?;
    let (counts, named) = header
        .split_last_chunk::<16>()
        .map(|(named, counts)| (counts.as_chunks::<4>().0, named))
        .ok_or("cut off")?;
    if !named.ends_with(&key.to_le_bytes()) {
        return Err("of another map or other lights");
    }
    let mut counts = counts.iter().map(|c| u32::from_le_bytes(*c) as usize);
    let mut count = || counts.next().unwrap_or(0);
    let [clusters, before, after, unseen] = [count(), count(), count(), count()];
    let foreign = "of another map or other lights";
    if clusters != old.clusters() || before != entries(old) || unseen > clusters {
        return Err(foreign);
    }
    let (mask, shares) = rest.split_at_checked(before.div_ceil(8)).ok_or("cut off")?;
    let (shares, left) = shares.as_chunks::<4>();
    let ones: usize = mask.iter().map(|b| b.count_ones() as usize).sum();
    if ones != after || shares.len() != after || !left.is_empty() {
        return Err("with entries missing");
    }
    let mut lists = LightLists {
        offsets: Vec::with_capacity(old.offsets.len()),
        lights: Vec::with_capacity(after + old.row(-1).len()),
        shares: Vec::with_capacity(after + old.row(-1).len()),
        ..old.clone()
    };
    lists.offsets.push(0);
    let mut at = 0usize;
    for cluster in 0..clusters as i32 {
        for &entry in old.row(cluster) {
            if mask.get(at / 8).is_some_and(|b| b >> (at % 8) & 1 == 1) {
                lists.lights.push(entry);
            }
            at += 1;
        }
        lists.offsets.push(lists.lights.len() as u32);
    }
    if lists.lights.len() != after {
        return Err("with entries missing");
    }
    for &[a, b, c, d] in shares {
        let share = unpack([u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])]);
        lists.shares.push(share.ok_or("with light below zero")?);
    }
    lists.end_with_all(old);
    Ok((lists, unseen))
}

/// Swept lists of a world from the cache, else from `fresh`, which are then written to it. Cache failures become
/// warnings of the world.
pub(super) fn load_or_sweep(
    world: &mut RelitWorld,
    cache: Option<&CalibrationCache>,
    fresh: impl FnOnce(&RelitWorld) -> (LightLists, SweepReport),
) -> (LightLists, SweepReport) {
    let Some(cache) = cache else {
        return fresh(world);
    };
    let key = key(world);
    let path = cache.path(key, KIND);
    let old = &world.light_lists;
    let read = read_file(&path).and_then(|bytes| {
        let parsed = bytes.map(|bytes| parse(&bytes, key, old)).transpose();
        parsed.map_err(|what| CacheError::Lists {
            path: path.clone(),
            what,
        })
    });
    let problem = match read {
        Ok(Some((lists, unseen))) => {
            let report = SweepReport {
                entries: [entries(old), entries(&lists)],
                unseen,
                cached: true,
                ..SweepReport::default()
            };
            return (lists, report);
        }
        Ok(None) => None,
        Err(problem) => Some(problem),
    };
    let (lists, report) = fresh(world);
    let written = cache.write_file(path, &print(key, old, &lists, report.unseen));
    let problems = problem.into_iter().chain(written.err());
    world.warnings.extend(problems.map(|p| p.to_string()));
    (lists, report)
}

#[cfg(test)]
mod tests {
    use super::super::sweep::{fresh, sweep};
    use super::*;
    use crate::Options;
    use crate::files::MemoryFiles;
    use crate::materials::Materials;
    use glam::Vec3;
    use q3bsp::builder::MapBuilder;
    use std::path::Path;

    const SCRIPT: &str = "
t/lamp
{
    q3map_surfacelight 2000
    { map *white }
}
t/wall
{
    { map *white }
}
";

    /// A row of rooms with closed walls between them, a lamp in each, and a matrix in which all see all.
    fn rooms(strength: f32) -> RelitWorld {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        let lamp = map.add_shader("t/lamp", 0, 1);
        for i in 0..4 {
            let low = Vec3::X * 256.0 * i as f32;
            map.add_cell(low, low + 256.0);
            map.add_box_faces(wall, low, low + 256.0, true);
            let at = low + Vec3::new(100.0, 100.0, 254.0);
            let (x, y) = (Vec3::X * 32.0, Vec3::Y * 32.0);
            map.add_quad(lamp, [at + y, at + x + y, at + x, at]);
        }
        map.set_sees(0, 0, true);
        let mut files = MemoryFiles::new();
        files.insert("scripts/t.shader", SCRIPT).unwrap();
        let (materials, _) = Materials::load(&files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        let mut world =
            RelitWorld::from_bsp(&files, &materials, "maps/t.bsp", map.build(), options);
        world.lights[0].radiance *= strength;
        world
    }

    fn swept(strength: f32, cache: Option<&CalibrationCache>) -> (RelitWorld, SweepReport) {
        let mut world = rooms(strength);
        let report = sweep(&mut world, cache);
        (world, report)
    }

    fn files(folder: &Path) -> Vec<std::path::PathBuf> {
        let files = std::fs::read_dir(folder).unwrap();
        files.map(|f| f.unwrap().path()).collect()
    }

    #[test]
    fn kept_lists_equal_fresh_ones() {
        let folder = tempfile::tempdir().unwrap();
        let cache = CalibrationCache::new(folder.path().join("light"));
        let (plain, _) = swept(1.0, None);
        let (first, report) = swept(1.0, Some(&cache));
        assert!(!report.cached && report.rays > 0);
        // rays shorten these lists: what is kept is not what was there before
        assert!(report.entries[1] < report.entries[0], "{report:?}");
        assert_eq!(first.light_lists, plain.light_lists);
        let (again, read) = swept(1.0, Some(&cache));
        assert!(read.cached && read.rays == 0);
        assert_eq!(again.light_lists, plain.light_lists);
        assert_eq!((read.entries, read.unseen), (report.entries, report.unseen));
        assert_eq!(again.report, first.report);
        assert_eq!(again.warnings, plain.warnings);
        // a light of another power is another result
        assert!(!swept(2.0, Some(&cache)).1.cached);
        assert_eq!(files(cache.folder()).len(), 2);
    }

    #[test]
    fn damaged_and_foreign_files_are_made_anew_with_a_warning() {
        let folder = tempfile::tempdir().unwrap();
        let cache = CalibrationCache::new(folder.path());
        let (plain, _) = swept(1.0, Some(&cache));
        let path = files(cache.folder()).pop().unwrap();
        let whole = std::fs::read(&path).unwrap();
        swept(3.0, Some(&cache));
        let foreign = files(cache.folder())
            .into_iter()
            .find(|p| *p != path)
            .unwrap();
        // damage with a correct hash: only the content is wrong
        let signed = |change: &dyn Fn(&mut Vec<u8>)| {
            let mut bytes = whole[..whole.len() - END].to_vec();
            change(&mut bytes);
            let mut hash = Hash::new();
            hash.bytes(&bytes);
            bytes.extend(hash.finish().to_le_bytes());
            bytes
        };
        let mut damaged = vec![
            std::fs::read(foreign).unwrap(),
            [&whole[..], b"x"].concat(),
            b"relight-calibration 3\n".to_vec(),
            signed(&|b| b[16] ^= 1),
            signed(&|b| b[36] ^= 1),
            signed(&|b| b[40] ^= 1),
            signed(&|b| b[44] ^= 1),
            signed(&|b| b[HEADER] ^= 1),
            signed(&|b| b[HEADER..].fill(0xFF)),
            signed(&|b| b.truncate(HEADER)),
            signed(&|b| b.truncate(b.len() - 3)),
            signed(&|b| b.extend([0; 4])),
        ];
        damaged.extend((0..whole.len()).step_by(7).map(|n| whole[..n].to_vec()));
        damaged.extend((0..whole.len()).step_by(5).map(|n| {
            let mut bytes = whole.clone();
            bytes[n] ^= 0x10;
            bytes
        }));
        for (number, bytes) in damaged.iter().enumerate() {
            std::fs::write(&path, bytes).unwrap();
            let (world, report) = swept(1.0, Some(&cache));
            assert!(!report.cached, "{number}");
            assert_eq!(world.light_lists, plain.light_lists, "{number}");
            let more = &world.warnings[plain.warnings.len()..];
            assert!(
                more.len() == 1 && more[0].contains(".lists: "),
                "{number}: {more:?}"
            );
            assert_eq!(std::fs::read(&path).unwrap(), whole, "{number}");
        }
    }

    #[test]
    fn a_folder_that_cannot_be_used_is_a_warning() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let cache = CalibrationCache::new(file.path());
        let (plain, _) = swept(1.0, None);
        let (world, report) = swept(1.0, Some(&cache));
        assert_eq!(world.light_lists, plain.light_lists);
        assert!(!report.cached && world.warnings.len() > plain.warnings.len());
    }

    #[test]
    fn what_no_ray_is_left_for_stays_in_the_lists() {
        let world = rooms(1.0);
        let old = &world.light_lists;
        let before = entries(old);
        for budget in [0, 20, 100, 200, 1000] {
            let (lists, report) = fresh(&world, before, budget);
            assert!(report.rays <= budget, "{report:?}");
            // at most those that were swept are gone
            assert!(report.entries[1] >= report.unswept, "{report:?}");
            if budget < 8 {
                assert_eq!(lists.lights, old.lights);
                assert_eq!(report.unswept, before);
            }
            for cluster in 0..old.clusters() as i32 {
                // lamps of a cluster's own room are in its list, however few the rays
                let own = |e: &u32| {
                    let light = &world.lights[*e as usize];
                    world.bsp.cluster_at(light.vertices[0] - Vec3::Z * 8.0) == cluster
                };
                assert_eq!(lists.row(cluster).iter().filter(|e| own(e)).count(), 2);
                assert!(
                    lists
                        .shares(cluster)
                        .iter()
                        .all(|s| s.bare >= 0.0 && s.visible > 0.0)
                );
            }
        }
        assert_eq!(fresh(&world, before, 1_000_000).1.unswept, 0);
    }

    #[test]
    fn shares_lose_little_when_rounded() {
        for (bare, visible) in [(0.0, 1.0), (1.0, 0.03), (3.3e-9, 0.777), (f32::MAX, 1e-9)] {
            let share = rounded(LightShare { bare, visible });
            assert!(
                share.bare <= bare && share.bare >= bare * 0.992,
                "{share:?}"
            );
            assert!(share.visible >= visible && share.visible <= visible + 2e-5);
            assert_eq!(rounded(share), share);
        }
        assert_eq!(rounded(LightShare::UNKNOWN), LightShare::UNKNOWN);
        let odd = LightShare {
            bare: f32::NAN,
            visible: f32::NAN,
        };
        assert!(rounded(odd).visible > 0.0 && rounded(odd).bare == 0.0);
        assert_eq!(unpack([0x7F80, 1]), None);
        assert_eq!(unpack([0x3F80, 0]), None);
    }
}

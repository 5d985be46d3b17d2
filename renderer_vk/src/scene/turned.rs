//! Geometry that faces the camera, in mirrors and portals.
//!
//! Sprites, bolts and `autosprite` surfaces are built for one view. The engine builds them again for the view in a
//! mirror. The traced look has one picture, so it builds a copy for each sequence of portals that a camera ray may
//! pass: none, one, or two. A ray carries the number of its sequence and ignores the copies of others. Glass and
//! liquids show the copy of the direct view: at angles where it would appear edge-on, they reflect little.

use shaders::trace_types::constants::{PATHS_DIRECT, PATHS_MOST, PATHS_PORTAL};

use super::portal::view_through;
use super::{Portal, View};

/// Every path hits the geometry.
pub(crate) const ALL: u8 = 0;
/// Paths that passed no portal hit it.
pub(crate) const DIRECT: u8 = PATHS_DIRECT as u8;
/// First number of the paths through portals.
pub(crate) const PORTAL: u8 = PATHS_PORTAL as u8;

/// A copy of such geometry.
#[derive(Clone, Copy)]
pub(super) struct Way {
    /// Number of the paths that hit it.
    pub paths: u8,
    /// View that it faces.
    pub view: View,
}

/// The views through portals, by path number less [`PORTAL`]: through each portal, then, if their number is small
/// enough, through each pair of portals. Longer sequences use the view of their last two. `None`: no path leads there.
pub(super) fn views(portals: &[Portal], camera: &View, out: &mut Vec<Option<View>>) {
    out.clear();
    let room = usize::from(u8::MAX - PORTAL) + 1;
    out.extend(
        portals
            .iter()
            .take(room)
            .map(|p| Some(view_through(p, camera))),
    );
    let count = portals.len();
    if usize::from(PORTAL) + count + count * count > PATHS_MOST as usize {
        return;
    }
    for (first, before) in portals.iter().enumerate() {
        let from = view_through(before, camera);
        for (second, portal) in portals.iter().enumerate() {
            // no path hits the same mirror twice in succession
            let leads = first != second || !portal.mirror;
            out.push(leads.then(|| view_through(portal, &from)));
        }
    }
}

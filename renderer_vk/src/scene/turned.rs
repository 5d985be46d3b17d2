//! What turns to the camera, as mirrors and portals show it.
//!
//! Sprites, bolts and `autosprite` surfaces are built for one camera. The engine builds them anew for the view in a mirror;
//! one picture of traced rays has them once for each way on which the camera may see them: straight on, through one
//! portal, through two. A path of the camera carries the number of its way and passes whatever is turned otherwise.
//! Glass and liquids show what the camera sees straight on: where such a thing would be seen from its edge there, they
//! reflect little.

use shaders::trace_types::constants::{PATHS_DIRECT, PATHS_MOST, PATHS_PORTAL};

use super::portal::view_through;
use super::{Portal, View};

/// Every path meets it: it is the same from everywhere.
pub(crate) const ALL: u8 = 0;
/// Paths that have passed no portal meet it.
pub(crate) const DIRECT: u8 = PATHS_DIRECT as u8;
/// From here on: paths through portals.
pub(crate) const PORTAL: u8 = PATHS_PORTAL as u8;

/// A way on which the camera may see something.
#[derive(Clone, Copy)]
pub(super) struct Way {
    /// The number of its paths.
    pub paths: u8,
    /// What turns to the camera turns to this one.
    pub view: View,
}

/// The views through portals, by the number of the paths that see so, less [`PORTAL`]: through each portal, and, while
/// there are few enough, through each after each other one. Paths through more see as the last two turn them. `None`:
/// there is no way that leads there.
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
            // what a mirror shows is on its front, and goes away from it
            let leads = first != second || !portal.mirror;
            out.push(leads.then(|| view_through(portal, &from)));
        }
    }
}

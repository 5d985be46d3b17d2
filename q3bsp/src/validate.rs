//! Every reference between lumps, checked once, so that no reader needs to check it again.
//!
//! The line between error and repair is the engine's behaviour: values that it ignores or maps to
//! something harmless are repaired, values that it refuses, or would follow out of its arrays, are errors.

mod surfaces;

use crate::Bsp;
use crate::container::Repair;
use crate::error::{Error, Lump, Warning};
use crate::ids::{Child, NodeId};

/// Most elements of one lump that the records of another may refer to in all. Sharing is normal, but
/// shipped maps stay far below a million; the limit keeps a file that shares one range a million times
/// from exhausting memory in whoever expands it.
const MAX_REFERENCES: u64 = 1 << 26;

/// Refuses a lump whose records refer to more than [`MAX_REFERENCES`] elements.
pub(crate) fn check_sharing(
    lump: Lump,
    target: Lump,
    counts: impl Iterator<Item = i32>,
) -> Result<(), Error> {
    let found = counts.map(|count| u64::try_from(count).unwrap_or(0)).sum();
    if found > MAX_REFERENCES {
        return Err(Error::TooMuchSharing {
            lump,
            target,
            found,
            limit: MAX_REFERENCES,
        });
    }
    Ok(())
}

/// A 32-bit field of a record: its name in messages and its byte offset.
#[derive(Clone, Copy)]
struct Field(&'static str, usize);

/// Collects repairs of one lump.
struct Repairs<'a> {
    lump: Lump,
    warnings: &'a mut Vec<Warning>,
    repairs: &'a mut Vec<Repair>,
}

impl Repairs<'_> {
    fn replace(
        &mut self,
        element: usize,
        Field(field, field_offset): Field,
        slot: &mut i32,
        replacement: i32,
        action: &'static str,
    ) {
        if *slot == replacement {
            return;
        }
        self.warnings.push(Warning {
            lump: self.lump,
            element: Some(element),
            field: field.into(),
            value: i64::from(*slot),
            action: action.into(),
        });
        self.repairs.push(Repair {
            lump: self.lump,
            element,
            field_offset,
            original: *slot,
            replacement,
        });
        *slot = replacement;
    }

    /// A range that must lie inside `target`; an empty one may start anywhere and is moved to 0.
    fn range(
        &mut self,
        element: usize,
        name: Field,
        first: &mut i32,
        count: i32,
        target: Lump,
        limit: usize,
    ) -> Result<(), Error> {
        if in_range(*first, count, limit) {
            return Ok(());
        }
        if count == 0 {
            self.replace(element, name, first, 0, "an empty range, taken as 0");
            return Ok(());
        }
        Err(Error::Range {
            lump: self.lump,
            element,
            field: name.0,
            first: *first,
            count,
            target,
            limit,
        })
    }
}

fn in_range(first: i32, count: i32, limit: usize) -> bool {
    first >= 0 && count >= 0 && i64::from(first) + i64::from(count) <= limit as i64
}

fn index(
    lump: Lump,
    element: usize,
    field: &'static str,
    value: i32,
    target: Lump,
    limit: usize,
) -> Result<usize, Error> {
    match usize::try_from(value) {
        Ok(index) if index < limit => Ok(index),
        _ => Err(Error::Value {
            lump,
            element,
            field,
            value: i64::from(value),
            expected: format!("outside the {limit} of lump {target}"),
        }),
    }
}

impl Bsp {
    /// Checks every reference between the lumps, as [`Bsp::parse`] does; for maps put together or
    /// changed in memory. Repairs what the engine tolerates and adds to [`Bsp::warnings`].
    ///
    /// # Errors
    /// The first reference that leads out of its lump, or a lump missing that every map needs.
    pub fn validate(&mut self) -> Result<(), Error> {
        for (lump, empty) in [
            (Lump::Shaders, self.shaders.is_empty()),
            (Lump::Planes, self.planes.is_empty()),
            (Lump::Nodes, self.nodes.is_empty()),
            (Lump::Leafs, self.leafs.is_empty()),
            (Lump::Models, self.models.is_empty()),
        ] {
            if empty {
                return Err(Error::Empty { lump });
            }
        }
        self.check_nodes()?;
        self.check_tree()?;
        self.check_leafs()?;
        self.check_models()?;
        self.check_brushes()?;
        self.check_fogs()?;
        self.check_surfaces()?;
        self.check_all_sharing()?;
        // Only now, as it expands the shared ranges.
        self.check_indices()?;
        self.warn_about_floats();
        Ok(())
    }

    fn check_nodes(&self) -> Result<(), Error> {
        for (element, node) in self.nodes.iter().enumerate() {
            let lump = Lump::Nodes;
            index(
                lump,
                element,
                "planeNum",
                node.plane.0,
                Lump::Planes,
                self.planes.len(),
            )?;
            for child in node.children {
                let (field, at, target, limit) = match child {
                    Child::Node(node) => ("child", node.0, Lump::Nodes, self.nodes.len()),
                    Child::Leaf(leaf) => ("leaf child", leaf.0, Lump::Leafs, self.leafs.len()),
                };
                index(lump, element, field, at, target, limit)?;
            }
        }
        Ok(())
    }

    /// The nodes under the root must form a tree: a node met twice would make walks endless or
    /// exponential.
    fn check_tree(&self) -> Result<(), Error> {
        let mut seen = vec![false; self.nodes.len()];
        let mut pending = vec![NodeId::ROOT];
        while let Some(at) = pending.pop() {
            let visited = seen.get_mut(at.index());
            if visited.is_some_and(|seen| std::mem::replace(seen, true)) {
                return Err(Error::Value {
                    lump: Lump::Nodes,
                    element: at.index(),
                    field: "number of parents",
                    value: 2,
                    expected: "but the nodes below the root must form a tree".to_owned(),
                });
            }
            pending.extend(self.node(at).children.iter().filter_map(|&c| match c {
                Child::Node(node) => Some(node),
                Child::Leaf(_) => None,
            }));
        }
        Ok(())
    }

    fn check_leafs(&mut self) -> Result<(), Error> {
        let clusters = self.visibility.as_ref().map(|v| v.clusters);
        let (surfaces, brushes) = (self.surfaces.len(), self.brushes.len());
        let (leaf_surfaces, leaf_brushes) = (self.leaf_surfaces.len(), self.leaf_brushes.len());
        let leafs = self.leafs.len();
        let mut log = Repairs {
            lump: Lump::Leafs,
            warnings: &mut self.warnings,
            repairs: &mut self.container.repairs,
        };
        for (element, leaf) in self.leafs.iter_mut().enumerate() {
            let cluster = Field("cluster", 0);
            if leaf.cluster < -1 {
                log.replace(element, cluster, &mut leaf.cluster, -1, "taken as outside");
            }
            match clusters {
                Some(count) if i64::from(leaf.cluster) >= count as i64 => {
                    let action = "not in the visibility lump: never drawn, sees everything";
                    log.replace(element, cluster, &mut leaf.cluster, -1, action);
                }
                // Without sets all clusters are alike, so that an absurdly large number
                // may as well be 0.
                None if i64::from(leaf.cluster) >= leafs as i64 => {
                    let action = "more than there are leafs; taken as 0, as all see each other";
                    log.replace(element, cluster, &mut leaf.cluster, 0, action);
                }
                _ => {}
            }
            log.range(
                element,
                Field("firstLeafSurface", 32),
                &mut leaf.first_leaf_surface,
                leaf.num_leaf_surfaces,
                Lump::LeafSurfaces,
                leaf_surfaces,
            )?;
            log.range(
                element,
                Field("firstLeafBrush", 40),
                &mut leaf.first_leaf_brush,
                leaf.num_leaf_brushes,
                Lump::LeafBrushes,
                leaf_brushes,
            )?;
        }
        for (element, &surface) in self.leaf_surfaces.iter().enumerate() {
            index(
                Lump::LeafSurfaces,
                element,
                "surface",
                surface.0,
                Lump::Surfaces,
                surfaces,
            )?;
        }
        for (element, &brush) in self.leaf_brushes.iter().enumerate() {
            index(
                Lump::LeafBrushes,
                element,
                "brush",
                brush.0,
                Lump::Brushes,
                brushes,
            )?;
        }
        Ok(())
    }

    fn check_models(&mut self) -> Result<(), Error> {
        let (surfaces, brushes) = (self.surfaces.len(), self.brushes.len());
        let mut log = Repairs {
            lump: Lump::Models,
            warnings: &mut self.warnings,
            repairs: &mut self.container.repairs,
        };
        for (element, model) in self.models.iter_mut().enumerate() {
            let name = Field("firstSurface", 24);
            let count = model.num_surfaces;
            log.range(
                element,
                name,
                &mut model.first_surface,
                count,
                Lump::Surfaces,
                surfaces,
            )?;
            let name = Field("firstBrush", 32);
            let count = model.num_brushes;
            log.range(
                element,
                name,
                &mut model.first_brush,
                count,
                Lump::Brushes,
                brushes,
            )?;
        }
        Ok(())
    }

    fn check_brushes(&mut self) -> Result<(), Error> {
        let (shaders, sides, planes) = (
            self.shaders.len(),
            self.brush_sides.len(),
            self.planes.len(),
        );
        let mut log = Repairs {
            lump: Lump::Brushes,
            warnings: &mut self.warnings,
            repairs: &mut self.container.repairs,
        };
        for (element, brush) in self.brushes.iter_mut().enumerate() {
            index(
                Lump::Brushes,
                element,
                "shaderNum",
                brush.shader.0,
                Lump::Shaders,
                shaders,
            )?;
            let name = Field("firstSide", 0);
            let count = brush.num_sides;
            log.range(
                element,
                name,
                &mut brush.first_side,
                count,
                Lump::BrushSides,
                sides,
            )?;
        }
        for (element, side) in self.brush_sides.iter().enumerate() {
            let lump = Lump::BrushSides;
            index(
                lump,
                element,
                "planeNum",
                side.plane.0,
                Lump::Planes,
                planes,
            )?;
            index(
                lump,
                element,
                "shaderNum",
                side.shader.0,
                Lump::Shaders,
                shaders,
            )?;
        }
        Ok(())
    }

    fn check_fogs(&mut self) -> Result<(), Error> {
        let mut log = Repairs {
            lump: Lump::Fogs,
            warnings: &mut self.warnings,
            repairs: &mut self.container.repairs,
        };
        for (element, fog) in self.fogs.iter_mut().enumerate() {
            // Quake III's own engine refuses these maps; engines of its mods do not.
            if fog.brush == -1 {
                continue;
            }
            let at = index(
                Lump::Fogs,
                element,
                "brushNum",
                fog.brush,
                Lump::Brushes,
                self.brushes.len(),
            )?;
            let sides = self.brushes.get(at).map_or(0, |brush| brush.num_sides);
            if sides < 6 {
                return Err(Error::Value {
                    lump: Lump::Fogs,
                    element,
                    field: "number of sides of its brush",
                    value: i64::from(sides),
                    expected: "but the first six give the bounds of the fog".to_owned(),
                });
            }
            if fog.visible_side < -1 || fog.visible_side >= sides {
                let action = "no side of its brush; taken as none";
                let field = Field("visibleSide", 68);
                log.replace(element, field, &mut fog.visible_side, -1, action);
            }
        }
        Ok(())
    }

    fn check_all_sharing(&self) -> Result<(), Error> {
        let leafs = self.leafs.iter();
        let brushes = self.brushes.iter();
        let models = self.models.iter();
        let surfaces = self.surfaces.iter();
        check_sharing(
            Lump::Leafs,
            Lump::LeafSurfaces,
            leafs.clone().map(|leaf| leaf.num_leaf_surfaces),
        )?;
        check_sharing(
            Lump::Leafs,
            Lump::LeafBrushes,
            leafs.map(|leaf| leaf.num_leaf_brushes),
        )?;
        check_sharing(
            Lump::Models,
            Lump::Surfaces,
            models.clone().map(|m| m.num_surfaces),
        )?;
        check_sharing(Lump::Models, Lump::Brushes, models.map(|m| m.num_brushes))?;
        check_sharing(
            Lump::Brushes,
            Lump::BrushSides,
            brushes.map(|b| b.num_sides),
        )?;
        check_sharing(
            Lump::Surfaces,
            Lump::DrawVerts,
            surfaces.clone().map(|s| s.num_verts),
        )?;
        check_sharing(
            Lump::Surfaces,
            Lump::DrawIndexes,
            surfaces.map(|s| s.num_indices),
        )
    }

    /// One warning each for vertices and planes that are not finite; they stay as they are.
    fn warn_about_floats(&mut self) {
        let vertices = |v: &crate::DrawVert| !v.is_finite();
        let planes = |p: &crate::Plane| !p.normal.is_finite() || !p.dist.is_finite();
        for (lump, first, count) in [
            (
                Lump::DrawVerts,
                self.vertices.iter().position(vertices),
                self.vertices.iter().filter(|v| vertices(v)).count(),
            ),
            (
                Lump::Planes,
                self.planes.iter().position(planes),
                self.planes.iter().filter(|p| planes(p)).count(),
            ),
        ] {
            if let Some(first) = first {
                self.warnings.push(Warning {
                    lump,
                    element: Some(first),
                    field: "number of records with NaN or infinity (this is the first)".into(),
                    value: count as i64,
                    action: "kept as they are".into(),
                });
            }
        }
    }
}

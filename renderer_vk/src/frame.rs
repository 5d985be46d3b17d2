//! Recording of a frame: its queued items in order. `trace` lists the passes of a traced view; a classic view is one
//! pass.

use glam::{Mat4, Vec3, Vec4};
use shaders::types::Instance;

use crate::assets::Assets;
use crate::gpu::{self, ColorMask, Image, Recorder};
use crate::raster::{
    Aids, DrawList, FlareTest, Flares, HybridSurfaces, Overlay, PixelLights, Raster, StageContext,
    Statics, SurfaceMapping, Target, UiMeshes, ViewParameters, overlay_instance, reflects,
    window_to_clip,
};
use crate::scene::{ClassicScene, TracedScene, ViewScene};
use crate::settings::Settings;
use crate::trace::hybrid::{HybridInput, HybridLook, HybridScene};
use crate::trace::{MapView, TraceLook};
use crate::world::World;

/// A queued command of the game.
pub enum Item {
    /// Clears the whole picture to a colour.
    Clear([f32; 4]),
    /// 2D pictures; shader time, seconds.
    Overlay(Overlay, f32),
    /// A user interface.
    Ui(UiMeshes),
    /// A 3D view in the classic look: at most one portal view, then the view itself.
    Classic(Vec<ClassicScene>),
    /// The same with traced shadows, and the scene that their rays traverse.
    Hybrid(Vec<ClassicScene>, Box<TracedScene>),
    /// A 3D view in the traced look.
    Traced(Box<TracedScene>),
}

/// Inputs and targets of a frame's items.
pub struct FrameContext<'a> {
    /// The picture; the traced look writes it directly.
    pub color: &'a Image,
    /// Colour target of the classic look.
    pub drawn: &'a Image,
    /// Depth target of the classic look.
    pub depth: &'a Image,
    /// Colour channels of the item.
    pub mask: ColorMask,
    /// Materials and textures.
    pub assets: &'a Assets,
    /// The map, once loaded.
    pub world: Option<&'a World>,
    /// Settings of the frame.
    pub settings: &'a Settings,
    /// The classic look.
    pub raster: &'a mut Raster,
    /// Flares of both looks.
    pub flares: &'a mut Flares,
    /// The traced look, if the device traces rays.
    pub trace: Option<&'a mut TraceLook>,
    /// The hybrid look, once it is in use.
    pub hybrid: Option<&'a mut HybridLook>,
    /// Draws the surfaces from which its rays start.
    pub hybrid_surfaces: &'a mut HybridSurfaces,
    /// Draw list, reused.
    pub list: &'a mut DrawList,
}

impl<'a> FrameContext<'a> {
    /// Records one item.
    ///
    /// # Errors
    /// The device is out of memory or lost.
    pub fn record(&mut self, recorder: &mut Recorder, item: &Item) -> Result<(), gpu::Error> {
        match item {
            Item::Clear(color) => self.clear(recorder, *color),
            Item::Overlay(overlay, time) => self.overlay(recorder, overlay, *time),
            Item::Ui(meshes) => self.ui(recorder, meshes),
            Item::Classic(scenes) => scenes
                .iter()
                .try_for_each(|scene| self.classic(recorder, scene, None)),
            Item::Hybrid(scenes, traversed) => {
                let traced = match (self.hybrid.as_deref_mut(), self.world) {
                    (Some(look), Some(world)) => {
                        Some(look.begin(recorder, traversed, world, self.assets)?)
                    }
                    _ => None,
                };
                scenes
                    .iter()
                    .try_for_each(|scene| self.classic(recorder, scene, traced))
            }
            Item::Traced(scene) => self.traced(recorder, scene),
        }
    }

    fn clear(&mut self, recorder: &mut Recorder, color: [f32; 4]) -> Result<(), gpu::Error> {
        self.list.clear();
        let parameters = ViewParameters {
            clear_color: Some(color),
            ..self.window_parameters(&[])
        };
        let target = self.target();
        self.raster
            .record(recorder, "clear", target, self.list, &parameters)
    }

    fn traced(&mut self, recorder: &mut Recorder, scene: &TracedScene) -> Result<(), gpu::Error> {
        let (Some(trace), Some(world)) = (self.trace.as_deref_mut(), self.world) else {
            return Ok(());
        };
        let test = self.flares.begin(recorder, scene)?;
        let view = MapView {
            scene,
            world,
            assets: self.assets,
            settings: self.settings,
            target: self.color,
            flares: test,
            mask: self.mask,
        };
        trace.record(recorder, view)?;
        if test.count == 0 {
            return Ok(());
        }
        let target = Target {
            color: self.color,
            depth: self.depth,
            mask: self.mask,
        };
        // no depth was drawn
        self.flares(recorder, target, scene, test, true)
    }

    /// Inputs of stage evaluation in this frame.
    fn stages(&self) -> StageContext<'a> {
        let assets = self.assets;
        StageContext {
            materials: &assets.materials,
            samplers: &assets.samplers,
            identity_light: self.settings.identity_light(),
            light_spot: assets.textures.dynamic_light(),
            pixel_lights: PixelLights::new(self.settings),
            mapping: SurfaceMapping::new(self.settings),
            only_texture: self
                .settings
                .no_bind
                .then(|| assets.textures.dynamic_light()),
            traced_shadows: false,
        }
    }

    fn overlay(
        &mut self,
        recorder: &mut Recorder,
        overlay: &Overlay,
        time: f32,
    ) -> Result<(), gpu::Error> {
        let instance = overlay_instance(time);
        let aids = Aids {
            edges: self.settings.show_tris && self.raster.draws_edges(),
            last_sort: self.settings.debug_sort,
            ..Aids::default()
        };
        overlay.draw(self.list, self.stages(), &instance, aids);
        let instances = [instance];
        let parameters = self.window_parameters(&instances);
        let target = self.target();
        self.raster
            .record(recorder, "overlay", target, self.list, &parameters)
    }

    fn ui(&mut self, recorder: &mut Recorder, meshes: &UiMeshes) -> Result<(), gpu::Error> {
        meshes.draw(self.list, self.stages());
        let instances = [overlay_instance(0.0)];
        let parameters = self.window_parameters(&instances);
        let target = self.target();
        self.raster
            .record(recorder, "user interface", target, self.list, &parameters)
    }

    /// View parameters of drawings in window pixels.
    fn window_parameters<'b>(&self, instances: &'b [Instance]) -> ViewParameters<'b> {
        let (width, height) = (self.color.width() as f32, self.color.height() as f32);
        ViewParameters {
            // window pixels to clip space; pictures lie at the near plane, at a depth of 1 before the far plane
            world_to_clip: Mat4::from_cols(
                Vec4::new(2.0 / width, 0.0, 0.0, 0.0),
                Vec4::new(0.0, 2.0 / height, 0.0, 0.0),
                Vec4::new(0.0, 0.0, -1.0, 0.0),
                Vec4::new(-1.0, -1.0, 0.0, 1.0),
            ),
            near_world_to_clip: None,
            clip_plane: [0.0; 4],
            origin: Vec3::new(0.0, 0.0, -1.0),
            forward: Vec3::Z,
            identity_light: self.settings.identity_light(),
            materials: self.assets.materials.addresses(),
            static_vertices: 0,
            mapped_vertices: 0,
            dynamic_vertices: None,
            fogs: 0,
            instances,
            lights: &[],
            light_backs: true,
            viewport: [0, 0, width as i32, height as i32],
            part: None,
            clear_depth: false,
            clear_color: None,
            shadows: None,
        }
    }

    /// Targets of the classic look.
    fn target(&self) -> Target<'a> {
        Target {
            color: self.drawn,
            depth: self.depth,
            mask: self.mask,
        }
    }

    /// Records a view of the classic look. `traced`: the scene that rays of the hybrid look traverse.
    fn classic(
        &mut self,
        recorder: &mut Recorder,
        scene: &ClassicScene,
        traced: Option<HybridScene>,
    ) -> Result<(), gpu::Error> {
        let settings = self.settings;
        let world = self.world.filter(|_| scene.has_world);
        self.list.clear();
        let stages = StageContext {
            traced_shadows: traced.is_some(),
            ..self.stages()
        };
        self.list.add_view(
            scene,
            stages,
            world.map_or(Statics::default(), |w| Statics {
                vertices: &w.vertices,
                indices: &w.indices,
            }),
            Aids {
                edges: settings.show_tris && self.raster.draws_edges(),
                normals: settings.show_normals && self.raster.draws_edges(),
                lightmaps: settings.lightmap != 0,
                sky_in_front: settings.show_sky,
                last_sort: settings.debug_sort,
                overdraw: settings.measure_overdraw,
            },
        );
        let view = &scene.view;
        let parameters = ViewParameters {
            world_to_clip: view.world_to_clip,
            near_world_to_clip: view.near_world_to_clip(),
            clip_plane: view.clip_plane.map_or([0.0; 4], |plane| plane.to_array()),
            origin: view.origin,
            forward: view.axis[0],
            identity_light: settings.identity_light(),
            materials: self.assets.materials.addresses(),
            static_vertices: world.map_or(0, |w| w.vertex_buffer.address()),
            mapped_vertices: world.map_or(0, |w| w.mapped_address()),
            dynamic_vertices: None,
            fogs: world.map_or(0, |w| w.fog_buffer.address()),
            instances: &scene.instances,
            lights: &scene.dlights,
            light_backs: settings.dlight_backs,
            viewport: view.viewport,
            part: scene.def.part,
            clear_depth: true,
            clear_color: clear_color(scene, settings),
            shadows: Some((&scene.look.shadows, view)),
        };
        let target = self.target();
        let mut uploaded = self.raster.upload(recorder, self.list, &parameters)?;
        if let (Some(traversed), Some(look)) = (traced, self.hybrid.as_deref_mut()) {
            let mirrors = self.list.calls.iter().any(reflects);
            let images = look.images([self.drawn.width(), self.drawn.height()], mirrors)?;
            (self.hybrid_surfaces).record(recorder, images, self.list, &parameters, &uploaded)?;
            let view = HybridInput {
                traversed,
                scene,
                parameters: &parameters,
                mirrors,
            };
            uploaded.hybrid = look.trace(recorder, view, self.assets)?;
        }
        self.raster.record_uploaded(
            recorder,
            "classic",
            target,
            self.list,
            &parameters,
            &uploaded,
        )?;
        let test = self.flares.begin(recorder, scene)?;
        if test.count == 0 || !self.flares.test_depth(recorder, target, test)? {
            return Ok(());
        }
        self.flares(recorder, target, scene, test, false)
    }

    /// Draws the tested flares of the view just drawn.
    fn flares(
        &mut self,
        recorder: &mut Recorder,
        target: Target<'_>,
        scene: &ViewScene,
        test: FlareTest,
        clear_depth: bool,
    ) -> Result<(), gpu::Error> {
        let Some(material) = self.assets.materials.internal().flare else {
            return Ok(());
        };
        let material = self.assets.materials.resolve(material);
        let speed = self.settings.flare_fade;
        let stages = self.stages();
        let (vertices, quads) = self.flares.finish(recorder, test, scene, material, speed)?;
        self.list.clear();
        self.list
            .add_view(quads, stages, Statics::default(), Aids::default());
        let parameters = ViewParameters {
            world_to_clip: window_to_clip(quads.view.viewport),
            near_world_to_clip: None,
            clip_plane: [0.0; 4],
            origin: Vec3::new(0.0, 0.0, -1.0),
            forward: Vec3::Z,
            identity_light: self.settings.identity_light(),
            materials: self.assets.materials.addresses(),
            static_vertices: 0,
            mapped_vertices: 0,
            dynamic_vertices: Some(vertices),
            fogs: 0,
            instances: &quads.instances,
            lights: &[],
            light_backs: true,
            viewport: quads.view.viewport,
            part: scene.def.part,
            clear_depth,
            clear_color: None,
            shadows: None,
        };
        self.raster
            .record(recorder, "flares", target, self.list, &parameters)
    }
}

/// Colour of each new frame with `r_clear`.
pub const CLEAR: [f32; 4] = [1.0, 0.0, 0.5, 1.0];

/// Clear colour of a view; the engine clears only if a setting or the game requests it.
pub fn clear_color(scene: &ClassicScene, settings: &Settings) -> Option<[f32; 4]> {
    if scene.def.flags & crate::api::rdflags::HYPERSPACE != 0 {
        let grey = (scene.def.time_ms & 255) as f32 / 255.0;
        Some([grey, grey, grey, 1.0])
    } else if settings.hides_sky() && scene.has_world {
        Some([0.0, 0.0, 0.0, 1.0])
    } else {
        None
    }
}

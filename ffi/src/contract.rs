//! Temporary signatures.
#![allow(dead_code, unused_variables, missing_docs)]
use glam::Vec3;
pub use renderer_vk::api::*;
pub use renderer_vk::settings::*;
use std::{ffi::*, sync::Arc};

#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("no world")]
    NoWorld,
    #[error("lost")]
    Gpu,
}
pub struct WindowSource {
    pub get_instance_proc_addr: *const c_void,
    pub instance_extensions: Vec<CString>,
    pub create_surface: Box<dyn FnMut(u64) -> Result<u64, String>>,
}
pub struct RendererOptions {
    pub width: u32,
    pub height: u32,
    pub window: Option<WindowSource>,
    pub validation: bool,
    pub device: Option<String>,
}
pub struct Renderer {
    i: DeviceInfo,
}
pub struct DeviceInfo {
    pub name: String,
    pub driver: String,
    pub api_version: (u32, u32, u32),
    pub vendor_id: u32,
    pub rt: bool,
}
pub struct VideoRequest {
    pub name: String,
    pub client: i32,
}
#[derive(Default)]
pub struct FrameStats {
    pub gpu_ms: f32,
}
pub struct FontInfo {
    pub glyphs: Vec<Glyph>,
    pub glyph_scale: f32,
    pub name: String,
}
pub struct Glyph {
    pub height: i32,
    pub shader_name: String,
    pub glyph: i32,
}
pub fn probe(device: Option<&str>) -> Result<DeviceInfo, Error> {
    Err(Error::Gpu)
}
impl Renderer {
    pub fn new(options: RendererOptions) -> Result<Renderer, Error> {
        Err(Error::Gpu)
    }
    pub fn device_info(&self) -> &DeviceInfo {
        &self.i
    }
    pub fn validation_messages(&self) -> Vec<String> {
        vec![]
    }
    pub fn resize(&mut self, width: u32, height: u32) {}
    pub fn begin_registration(
        &mut self,
        files: Arc<dyn relight::GameFiles>,
        settings: &Settings,
    ) -> Result<(), Error> {
        Ok(())
    }
    pub fn end_registration(&mut self) {}
    pub fn shutdown_registration(&mut self) {}
    pub fn register_shader(&mut self, name: &str, mip: bool) -> i32 {
        0
    }
    pub fn register_model(&mut self, name: &str) -> i32 {
        0
    }
    pub fn register_skin(&mut self, name: &str) -> i32 {
        0
    }
    pub fn register_font(&mut self, point_size: i32) -> Option<FontInfo> {
        None
    }
    pub fn load_world(&mut self, name: &str) -> Result<(), Error> {
        Ok(())
    }
    pub fn remap_shader(&mut self, old: &str, new: &str, time_offset: Option<f32>) {}
    pub fn set_settings(&mut self, s: &Settings) {}
    pub fn clear_scene(&mut self) {}
    pub fn add_entity(&mut self, e: &RefEntity) {}
    pub fn add_poly(&mut self, shader: i32, verts: &[PolyVert], verts_per_poly: usize) {}
    pub fn add_light(&mut self, l: DynamicLight) {}
    pub fn render_scene(&mut self, d: &RefDef) -> Result<(), Error> {
        Ok(())
    }
    pub fn set_color(&mut self, c: Option<[f32; 4]>) {}
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_pic(
        &mut self,
        x: f32,
        y: f32,
        w: f32,
        h: f32,
        s1: f32,
        t1: f32,
        s2: f32,
        t2: f32,
        shader: i32,
    ) {
    }
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_raw(
        &mut self,
        x: i32,
        y: i32,
        w: i32,
        h: i32,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) -> Result<(), Error> {
        Ok(())
    }
    pub fn upload_cinematic(
        &mut self,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) {
    }
    pub fn active_videos(&self) -> Vec<VideoRequest> {
        vec![]
    }
    pub fn begin_frame(&mut self, time_ms: i32) {}
    pub fn end_frame(&mut self) -> Result<FrameStats, Error> {
        Ok(FrameStats::default())
    }
    pub fn read_pixels(&mut self) -> Result<Picture, Error> {
        Err(Error::Gpu)
    }
    pub fn timings(&self) -> Vec<(String, f32)> {
        vec![]
    }
    pub fn light_for_point(&self, p: Vec3) -> Option<PointLighting> {
        None
    }
    pub fn mark_fragments(
        &self,
        points: &[Vec3],
        projection: Vec3,
        max_points: usize,
        max_fragments: usize,
    ) -> (Vec<Vec3>, Vec<MarkFragment>) {
        (vec![], vec![])
    }
    pub fn lerp_tag(
        &self,
        model: i32,
        start: i32,
        end: i32,
        frac: f32,
        name: &str,
    ) -> Option<Orientation> {
        None
    }
    pub fn model_bounds(&self, model: i32) -> (Vec3, Vec3) {
        (Vec3::ZERO, Vec3::ZERO)
    }
    pub fn leaf_cluster(&self, p: Vec3) -> i32 {
        -1
    }
    pub fn cluster_sees(&self, a: i32, b: i32) -> bool {
        true
    }
    pub fn entity_token(&mut self) -> Option<String> {
        None
    }
    pub fn world_name(&self) -> Option<&str> {
        None
    }
    pub fn image_list(&self) -> Vec<String> {
        vec![]
    }
    pub fn shader_list(&self, sorted: bool) -> Vec<String> {
        vec![]
    }
    pub fn skin_list(&self) -> Vec<String> {
        vec![]
    }
    pub fn model_list(&self) -> Vec<String> {
        vec![]
    }
}

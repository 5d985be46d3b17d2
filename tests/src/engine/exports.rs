//! The renderer's entry points as methods: arguments as the engine passes them, errors as values.

use std::ffi::{CStr, CString, c_char, c_int};

use glam::{Mat3, Vec3};
use relight::compare::Rgb8;

use super::abi::{fontInfo_t, markFragment_t, orientation_t, polyVert_t, refEntity_t, refdef_t};
use super::{Engine, Raised, call};

/// A camera.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Left and upper edge in the window, pixels.
    pub place: [i32; 2],
    /// Where it is.
    pub origin: Vec3,
    /// Down, left, roll: degrees.
    pub angles: Vec3,
    /// Pixels.
    pub width: i32,
    /// Pixels.
    pub height: i32,
    /// Full horizontal angle, degrees.
    pub fov: f32,
    /// Milliseconds.
    pub time: i32,
    /// `RDF_*`.
    pub flags: i32,
    /// The texts that surfaces can show, less than 32 characters each.
    pub text: [&'static str; 8],
}

impl View {
    /// The whole window of 320x240 from `origin`, turned left by `yaw` degrees.
    pub fn new(origin: Vec3, yaw: f32) -> Self {
        Self {
            place: [0; 2],
            origin,
            angles: Vec3::new(0.0, yaw, 0.0),
            width: 320,
            height: 240,
            fov: 90.0,
            time: 1000,
            flags: 0,
            text: [""; 8],
        }
    }

    /// Forward, left and up.
    fn axes(&self) -> Mat3 {
        let [pitch, yaw, roll] = self.angles.to_array().map(f32::to_radians);
        Mat3::from_rotation_z(yaw) * Mat3::from_rotation_y(pitch) * Mat3::from_rotation_x(roll)
    }

    fn refdef(&self) -> refdef_t {
        let fov_y = 2.0
            * ((self.fov.to_radians() / 2.0).tan() * self.height as f32 / self.width as f32).atan();
        let [x, y] = self.place;
        let text = self.text.map(|line| {
            let mut place = [0; 32];
            for (to, from) in place.iter_mut().take(31).zip(line.bytes()) {
                *to = from;
            }
            place
        });
        refdef_t {
            x,
            y,
            width: self.width,
            height: self.height,
            fov_x: self.fov,
            fov_y: fov_y.to_degrees(),
            vieworg: self.origin.to_array(),
            viewaxis: self.axes().to_cols_array_2d(),
            time: self.time,
            rdflags: self.flags,
            areamask: [0; 32],
            text,
        }
    }
}

/// Strings of a test have no NUL inside.
fn c(text: &str) -> CString {
    CString::new(text).expect("no NUL in a test's string")
}

/// Each method is the entry point of the same name.
#[allow(missing_docs)]
impl Engine {
    pub fn register_model(&mut self, name: &str) -> Result<i32, Raised> {
        let (re, name) = (self.exports(), c(name));
        let name = name.as_ptr();
        // SAFETY: the library is loaded, and the string is valid during the call.
        call(move || unsafe { (re.RegisterModel)(name) })
    }

    pub fn register_skin(&mut self, name: &str) -> Result<i32, Raised> {
        let (re, name) = (self.exports(), c(name));
        let name = name.as_ptr();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.RegisterSkin)(name) })
    }

    pub fn register_shader(&mut self, name: &str) -> Result<i32, Raised> {
        let (re, name) = (self.exports(), c(name));
        let name = name.as_ptr();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.RegisterShader)(name) })
    }

    pub fn register_shader_no_mip(&mut self, name: &str) -> Result<i32, Raised> {
        let (re, name) = (self.exports(), c(name));
        let name = name.as_ptr();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.RegisterShaderNoMip)(name) })
    }

    pub fn load_world(&mut self, name: &str) -> Result<(), Raised> {
        let (re, name) = (self.exports(), c(name));
        let name = name.as_ptr();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.LoadWorld)(name) })
    }

    pub fn set_world_vis_data(&mut self, rows: &[u8]) -> Result<(), Raised> {
        let (re, rows) = (self.exports(), rows.as_ptr());
        // SAFETY: as in `register_model`; the engine never calls it, so the rows are not looked at.
        call(move || unsafe { (re.SetWorldVisData)(rows) })
    }

    pub fn end_registration(&mut self) -> Result<(), Raised> {
        let re = self.exports();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.EndRegistration)() })
    }

    pub fn clear_scene(&mut self) -> Result<(), Raised> {
        let re = self.exports();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.ClearScene)() })
    }

    pub fn add_entity(&mut self, entity: &refEntity_t) -> Result<(), Raised> {
        let (re, entity) = (self.exports(), &raw const *entity);
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.AddRefEntityToScene)(entity) })
    }

    /// `vertices.len() / vertices_per_polygon` polygons.
    pub fn add_poly(
        &mut self,
        shader: i32,
        vertices: &[polyVert_t],
        vertices_per_polygon: usize,
    ) -> Result<(), Raised> {
        let count = vertices.len() / vertices_per_polygon.max(1);
        let (re, vertices) = (self.exports(), vertices.as_ptr());
        // SAFETY: as in `register_model`; there are that many vertices.
        call(move || unsafe {
            (re.AddPolyToScene)(
                shader,
                vertices_per_polygon as c_int,
                vertices,
                count as c_int,
            )
        })
    }

    /// Ambient and directed light and the direction towards it, if the map has a light grid.
    pub fn light_for_point(&mut self, point: Vec3) -> Result<Option<[Vec3; 3]>, Raised> {
        let re = self.exports();
        let mut point = point.to_array();
        let mut answer = [[0f32; 3]; 3];
        let (p, a) = (&raw mut point, &raw mut answer);
        // SAFETY: four places for three numbers each.
        let found = call(move || unsafe {
            let a = a.cast::<[f32; 3]>();
            (re.LightForPoint)(p, a, a.add(1), a.add(2))
        })?;
        Ok((found != 0).then_some(answer.map(Vec3::from)))
    }

    pub fn add_light(&mut self, origin: Vec3, radius: f32, color: Vec3) -> Result<(), Raised> {
        let re = self.exports();
        let place = origin.to_array();
        let place = &raw const place;
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.AddLightToScene)(place, radius, color.x, color.y, color.z) })
    }

    pub fn add_additive_light(
        &mut self,
        origin: Vec3,
        radius: f32,
        color: Vec3,
    ) -> Result<(), Raised> {
        let re = self.exports();
        let place = origin.to_array();
        let place = &raw const place;
        // SAFETY: as in `register_model`.
        call(move || unsafe {
            (re.AddAdditiveLightToScene)(place, radius, color.x, color.y, color.z)
        })
    }

    /// Quake3e's: an entity whose `shaderTime` is in milliseconds.
    pub fn add_entity_in_milliseconds(
        &mut self,
        entity: &refEntity_t,
        milliseconds: i32,
    ) -> Result<(), Raised> {
        let entity = refEntity_t {
            shaderTime: f32::from_bits(milliseconds.cast_unsigned()),
            ..*entity
        };
        let (re, entity) = (self.quake3e(), &raw const entity);
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.AddRefEntityToScene)(entity, 1) })
    }

    /// Quake3e's.
    pub fn add_linear_light(
        &mut self,
        ends: [Vec3; 2],
        radius: f32,
        color: Vec3,
    ) -> Result<(), Raised> {
        let re = self.quake3e();
        let ends = ends.map(|end| end.to_array());
        let start = ends.as_ptr();
        // SAFETY: two places of three numbers.
        call(move || unsafe {
            (re.AddLinearLightToScene)(start, start.add(1), radius, color.x, color.y, color.z)
        })
    }

    /// Quake3e's: the next frame need not be shown.
    pub fn throttle(&mut self) -> Result<(), Raised> {
        let re = self.quake3e();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.ThrottleBackend)() })
    }

    /// Quake3e's: width and height of the configuration that the renderer keeps.
    pub fn kept_size(&mut self) -> Result<(i32, i32), Raised> {
        let re = self.quake3e();
        // SAFETY: as in `register_model`; the structure is valid until the process ends.
        call(move || unsafe {
            let config = (re.GetConfig)();
            ((*config).vidWidth, (*config).vidHeight)
        })
    }

    /// Quake3e's: whether what is registered next may be lit by vertices.
    pub fn vertex_lighting(&mut self, allowed: bool) -> Result<(), Raised> {
        let re = self.quake3e();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.VertexLighting)(allowed.into()) })
    }

    pub fn render_scene(&mut self, view: &View) -> Result<(), Raised> {
        let (re, refdef) = (self.exports(), view.refdef());
        let refdef = &raw const refdef;
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.RenderScene)(refdef) })
    }

    pub fn set_color(&mut self, color: Option<[f32; 4]>) -> Result<(), Raised> {
        let re = self.exports();
        let color = color.as_ref().map_or(std::ptr::null(), |c| &raw const *c);
        // SAFETY: NULL or four numbers.
        call(move || unsafe { (re.SetColor)(color) })
    }

    /// `place`: x, y, width, height in pixels; `st`: texture coordinates of two corners.
    pub fn draw_stretch_pic(
        &mut self,
        place: [f32; 4],
        st: [f32; 4],
        shader: i32,
    ) -> Result<(), Raised> {
        let re = self.exports();
        let ([x, y, w, h], [s1, t1, s2, t2]) = (place, st);
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.DrawStretchPic)(x, y, w, h, s1, t1, s2, t2, shader) })
    }

    /// `rgba` holds `columns` pixels in each row.
    pub fn draw_stretch_raw(
        &mut self,
        place: [i32; 4],
        columns: i32,
        rgba: &[u8],
        client: i32,
        dirty: bool,
    ) -> Result<(), Raised> {
        let re = self.exports();
        let [x, y, w, h] = place;
        let rows = (rgba.len() / 4) as c_int / columns.max(1);
        let data = rgba.as_ptr();
        // SAFETY: columns times rows pixels are there.
        call(move || unsafe {
            (re.DrawStretchRaw)(x, y, w, h, columns, rows, data, client, dirty.into())
        })
    }

    pub fn upload_cinematic(&mut self, side: i32, rgba: &[u8], client: i32) -> Result<(), Raised> {
        assert_eq!(rgba.len(), (side * side * 4) as usize);
        let (re, data) = (self.exports(), rgba.as_ptr());
        // SAFETY: as just checked.
        call(move || unsafe { (re.UploadCinematic)(side, side, side, side, data, client, 1) })
    }

    pub fn begin_frame(&mut self, eye: i32) -> Result<(), Raised> {
        let re = self.exports();
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.BeginFrame)(eye) })
    }

    pub fn end_frame(&mut self) -> Result<(), Raised> {
        let re = self.exports();
        // SAFETY: both places may be NULL.
        call(move || unsafe { (re.EndFrame)(std::ptr::null_mut(), std::ptr::null_mut()) })
    }

    /// `EndFrame` with `com_speeds`: milliseconds of its front and back end.
    pub fn end_frame_timed(&mut self) -> Result<(i32, i32), Raised> {
        let re = self.exports();
        let mut times = [-1; 2];
        let place = (&raw mut times).cast::<c_int>();
        // SAFETY: two places.
        call(move || unsafe { (re.EndFrame)(place, place.add(1)) })?;
        Ok((times[0], times[1]))
    }

    /// At most as many points and fragments as asked for; more is the renderer's fault and fails the test.
    ///
    /// # Panics
    /// Then.
    pub fn mark_fragments(
        &mut self,
        points: &[Vec3],
        projection: Vec3,
        max_points: usize,
        max_fragments: usize,
    ) -> Result<(Vec<Vec3>, Vec<markFragment_t>), Raised> {
        const GUARD: f32 = 12345.5;
        let re = self.exports();
        let input: Vec<[f32; 3]> = points.iter().map(|p| p.to_array()).collect();
        let direction = projection.to_array();
        let mut buffer = vec![[GUARD; 3]; max_points + 1];
        let guard = markFragment_t {
            firstPoint: -77,
            numPoints: -77,
        };
        let mut fragments = vec![guard; max_fragments + 1];
        let (count, input, direction) =
            (input.len() as c_int, input.as_ptr(), &raw const direction);
        let (out, found) = (buffer.as_mut_ptr(), fragments.as_mut_ptr());
        // SAFETY: buffers of the sizes that are passed, and one more each.
        let n = call(move || unsafe {
            (re.MarkFragments)(
                count,
                input,
                direction,
                max_points as c_int,
                out,
                max_fragments as c_int,
                found,
            )
        })?;
        assert_eq!(
            buffer[max_points], [GUARD; 3],
            "points were written past the buffer"
        );
        assert_eq!(
            fragments[max_fragments], guard,
            "fragments were written past the buffer"
        );
        let n = usize::try_from(n).expect("a count");
        assert!(n <= max_fragments);
        fragments.truncate(n);
        let used = fragments
            .iter()
            .map(|f| f.firstPoint + f.numPoints)
            .max()
            .unwrap_or(0);
        buffer.truncate(usize::try_from(used).expect("a count"));
        Ok((buffer.into_iter().map(Vec3::from).collect(), fragments))
    }

    /// [`Self::mark_fragments`] of a square below a place, as a game asks each frame: how many pieces there are.
    pub fn ask_mark(&mut self, place: Vec3, side: f32) -> Result<i32, Raised> {
        let re = self.exports();
        let half = side / 2.0;
        let corners = [[-half, -half], [-half, half], [half, half], [half, -half]]
            .map(|[x, y]| [place.x + x, place.y + y, place.z]);
        let direction = [0.0, 0.0, -2.0 * place.z.abs() - 20.0];
        let mut points = [[0.0f32; 3]; 384];
        let mut fragments = [markFragment_t {
            firstPoint: 0,
            numPoints: 0,
        }; 128];
        let (input, direction) = (corners.as_ptr(), &raw const direction);
        let (out, found) = (points.as_mut_ptr(), fragments.as_mut_ptr());
        // SAFETY: buffers of the sizes that are passed.
        call(move || unsafe {
            (re.MarkFragments)(4, input, direction.cast(), 384, out, 128, found)
        })
    }

    /// [`Self::lerp_tag`] at a third of the way: whether the model has the tag.
    pub fn ask_tag(&mut self, model: i32, tag: &CStr) -> Result<bool, Raised> {
        let re = self.exports();
        let mut place = orientation_t::default();
        let (tag, out) = (tag.as_ptr(), &raw mut place);
        // SAFETY: as in `register_model`.
        Ok(call(move || unsafe { (re.LerpTag)(out, model, 0, 1, 0.3, tag) })? != 0)
    }

    /// The tag's place, if the model has it.
    pub fn lerp_tag(
        &mut self,
        model: i32,
        frames: [i32; 2],
        fraction: f32,
        tag: &str,
    ) -> Result<Option<orientation_t>, Raised> {
        let (re, tag) = (self.exports(), c(tag));
        let mut place = orientation_t::default();
        let (tag, out) = (tag.as_ptr(), &raw mut place);
        // SAFETY: as in `register_model`.
        let found =
            call(move || unsafe { (re.LerpTag)(out, model, frames[0], frames[1], fraction, tag) })?;
        Ok((found != 0).then_some(place))
    }

    pub fn model_bounds(&mut self, model: i32) -> Result<(Vec3, Vec3), Raised> {
        let re = self.exports();
        let mut bounds = [[f32::NAN; 3]; 2];
        let place = (&raw mut bounds).cast::<[f32; 3]>();
        // SAFETY: two places for three numbers.
        call(move || unsafe { (re.ModelBounds)(model, place, place.add(1)) })?;
        Ok((bounds[0].into(), bounds[1].into()))
    }

    pub fn register_font(&mut self, name: &str, points: i32) -> Result<Box<fontInfo_t>, Raised> {
        let (re, name) = (self.exports(), c(name));
        // SAFETY: numbers and characters alone.
        let mut font: Box<fontInfo_t> = Box::new(unsafe { std::mem::zeroed() });
        let (name, place) = (name.as_ptr(), &raw mut *font);
        // SAFETY: as in `register_model`.
        call(move || unsafe { (re.RegisterFont)(name, points, place) })?;
        Ok(font)
    }

    pub fn remap_shader(
        &mut self,
        old: &str,
        new: &str,
        offset: Option<&str>,
    ) -> Result<(), Raised> {
        let (re, old, new, offset) = (self.exports(), c(old), c(new), offset.map(c));
        let (old, new) = (old.as_ptr(), new.as_ptr());
        let offset = offset.as_ref().map_or(std::ptr::null(), |o| o.as_ptr());
        // SAFETY: the strings live for the call; the offset may be NULL.
        call(move || unsafe { (re.RemapShader)(old, new, offset) })
    }

    /// The next token of the map's entities, `None` at their end.
    pub fn entity_token(&mut self) -> Result<Option<String>, Raised> {
        let re = self.exports();
        let mut buffer: [c_char; 1024] = [0; 1024];
        let place = buffer.as_mut_ptr();
        // SAFETY: room for 1024 characters.
        let more = call(move || unsafe { (re.GetEntityToken)(place, 1024) })?;
        // SAFETY: the renderer wrote a string into it, or left it empty.
        let token = unsafe { CStr::from_ptr(place) }
            .to_string_lossy()
            .into_owned();
        Ok((more != 0).then_some(token))
    }

    pub fn in_pvs(&mut self, a: Vec3, b: Vec3) -> Result<bool, Raised> {
        let re = self.exports();
        let (a, b) = (a.to_array(), b.to_array());
        let (a, b) = (&raw const a, &raw const b);
        // SAFETY: two places.
        Ok(call(move || unsafe { (re.inPVS)(a, b) })? != 0)
    }

    /// Queues a frame for the video writer; it comes with the next `EndFrame`.
    pub fn take_video_frame(
        &mut self,
        width: i32,
        height: i32,
        capture: &mut [u8],
        encode: &mut [u8],
        motion_jpeg: bool,
    ) -> Result<(), Raised> {
        let re = self.exports();
        let (capture, encode) = (capture.as_mut_ptr(), encode.as_mut_ptr());
        // SAFETY: the test keeps both buffers until the frame has ended, as the engine does.
        call(move || unsafe {
            (re.TakeVideoFrame)(width, height, capture, encode, motion_jpeg.into())
        })
    }

    /// One frame with this view and nothing in it but the world; returns what it looks like.
    ///
    /// # Panics
    /// When the screenshot is no picture.
    pub fn picture(&mut self, view: &View) -> Result<Rgb8, Raised> {
        self.picture_of(|engine| {
            engine.clear_scene()?;
            engine.render_scene(view)
        })
    }

    /// One frame with what `draw` draws; returns what it looks like.
    ///
    /// # Panics
    /// When the screenshot is no picture.
    pub fn picture_of(
        &mut self,
        draw: impl FnOnce(&mut Self) -> Result<(), Raised>,
    ) -> Result<Rgb8, Raised> {
        self.begin_frame(0)?;
        draw(self)?;
        self.take_picture()
    }

    /// What a frame of two eyes looks like, the left one's calls first.
    pub fn stereo_picture_of(
        &mut self,
        draw: impl Fn(&mut Self) -> Result<(), Raised>,
    ) -> Result<Rgb8, Raised> {
        for eye in [1, 2] {
            self.begin_frame(eye)?;
            draw(self)?;
        }
        self.take_picture()
    }

    /// Ends the frame with a screenshot.
    fn take_picture(&mut self) -> Result<Rgb8, Raised> {
        self.command("screenshot picture")?;
        self.end_frame()?;
        let file = "screenshots/picture.tga";
        let written = self.home().join(file);
        let bytes = std::fs::read(&written).unwrap_or_else(|e| panic!("{file}: {e}"));
        let _ = std::fs::remove_file(written);
        let image = relight::image::decode(file, "tga", &bytes).expect("a picture");
        let pixels = image.pixels().flat_map(|[r, g, b, _]| [r, g, b]).collect();
        Ok(Rgb8::new(image.width as usize, image.height as usize, pixels).expect("its size"))
    }
}

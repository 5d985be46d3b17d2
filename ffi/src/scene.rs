//! Registration of assets, the scene and 2D drawing.

use crate::abi::{QBool, Vec3C, fontInfo_t, is_true, polyVert_t, refEntity_t, refdef_t};
use crate::boundary::entry;
use crate::convert;
pub use crate::convert::ShaderTime;
use crate::cvars::{self, Cvar, Cvars};
use crate::engine::{self, Engine, string_from, valid_game_path};
use crate::failure::Failure;
use crate::session::{draw, with_renderer};
use glam::{IVec2, Vec2, Vec3};
use renderer_vk::Renderer;
use renderer_vk::api::{CinematicFrame, DynamicLight, PolyVert, StretchedPicture, rdflags};
use renderer_vk::path::PathPoint;
use std::ffi::{c_char, c_float, c_int, c_uchar};

/// Maximum number of corners of a decal's polygon that are read.
pub const MAX_MARK_POINTS: usize = 64;
/// Maximum side of a raw picture; prevents overflow of sizes.
const MAX_RAW_SIDE: c_int = 1 << 14;

/// Runs a registration of something by name.
///
/// # Safety
/// `name` must be null or a NUL-terminated string.
unsafe fn register(name: *const c_char, f: impl FnOnce(&mut Renderer, &str) -> i32) -> c_int {
    entry(|| {
        // SAFETY: null or NUL-terminated by this function's contract; copied at once.
        let name = unsafe { string_from(name) };
        with_renderer(|renderer, _| Ok(f(renderer, &name)))
    })
}

/// `re.RegisterModel`. A name without a model returns 0.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string.
pub unsafe extern "C" fn register_model(name: *const c_char) -> c_int {
    // SAFETY: the requested name, null or NUL-terminated by this function's contract.
    unsafe { register(name, |renderer, name| renderer.register_model(name)) }
}

/// `re.RegisterSkin`. A name without a skin returns 0.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string.
pub unsafe extern "C" fn register_skin(name: *const c_char) -> c_int {
    // SAFETY: the requested name, null or NUL-terminated by this function's contract.
    unsafe { register(name, |renderer, name| renderer.register_skin(name)) }
}

/// `re.RegisterShader`. A name without a material or an image returns 0.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string.
pub unsafe extern "C" fn register_shader(name: *const c_char) -> c_int {
    // SAFETY: the requested name, null or NUL-terminated by this function's contract.
    unsafe { register(name, |renderer, name| renderer.register_shader(name, true)) }
}

/// `re.RegisterShaderNoMip`. A name without a material or an image returns 0.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string.
pub unsafe extern "C" fn register_shader_no_mip(name: *const c_char) -> c_int {
    // SAFETY: the requested name, null or NUL-terminated by this function's contract.
    unsafe { register(name, |renderer, name| renderer.register_shader(name, false)) }
}

/// `re.RegisterFont`. Where there is no font of that size, `out` keeps what it holds.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `out` must be null or have room for a `fontInfo_t`. The name is
/// not read.
pub unsafe extern "C" fn register_font(
    _name: *const c_char,
    point_size: c_int,
    out: *mut fontInfo_t,
) {
    entry(|| {
        with_renderer(|renderer, _| {
            // Only the size determines the file, whatever the font's name.
            match renderer.register_font(point_size) {
                // SAFETY: not null, so it has room for a `fontInfo_t` by this function's contract.
                Some(font) if !out.is_null() => unsafe {
                    out.write_unaligned(*convert::font(&font))
                },
                Some(_) => {}
                None => log::warn!("no font of {point_size} points is installed"),
            }
            Ok(())
        })
    });
}

/// `re.LoadWorld`. A map that cannot be loaded, or a second one, ends in the engine's `Error`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `name` must be null, which counts as an empty name, or a
/// NUL-terminated string.
pub unsafe extern "C" fn load_world(name: *const c_char) {
    entry(|| {
        // SAFETY: null or NUL-terminated by this function's contract; copied at once.
        let name = unsafe { string_from(name) };
        with_renderer(|renderer, front| {
            if renderer.world_name().is_some() {
                return Err(Failure::drop(format!("{name}: a map is loaded already")));
            }
            // The game may have changed a latched setting since the frame began, for example because its server forbids
            // a value.
            if let Some(cvars) = &front.cvars {
                cvars::apply(cvars, &mut front.settings);
                renderer.set_settings(&front.settings);
            }
            renderer.load_world(&name).map_err(Failure::from)
        })?;
        if let Some(engine) = engine::current() {
            for file in [
                relight::light::lights_file(&name),
                relight::materials::by_hand::materials_file(&name),
            ] {
                if let Some(line) = unread(engine, &file) {
                    engine.say(&line);
                }
            }
        }
        Ok(())
    });
}

/// What to print where the player has a file that the engine does not read, as on a pure server.
fn unread(engine: Engine, file: &str) -> Option<String> {
    let unread = engine.home_has(file) && engine.read_file(&valid_game_path(file)?).is_none();
    unread.then(|| {
        format!(
            "{file} is not used: this server reads packs only. Give \\sv_pure 0 before the map starts, or put the \
             file into a .pk3\n"
        )
    })
}

/// `re.SetWorldVisData`, the engine's copy of the map's visibility. The renderer reads the same data from the map
/// itself.
///
/// # Safety
/// None: the pointer is not used, and the call always returns.
pub unsafe extern "C" fn set_world_vis_data(_vis: *const c_uchar) {}

/// `re.ClearScene`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract); there are no arguments.
pub unsafe extern "C" fn clear_scene() {
    entry(|| {
        draw(|renderer, _| {
            renderer.clear_scene();
            Ok(())
        })
    });
}

/// `re.AddRefEntityToScene`. An entity with a NaN in its origin is omitted; one of an unknown type ends in the engine's
/// `Error`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `from` must be null, which adds nothing, or point at a
/// `refEntity_t`, whose members may hold any value. It is copied.
pub unsafe extern "C" fn add_ref_entity(from: *const refEntity_t) {
    // SAFETY: null or an entity by this function's contract.
    unsafe { add_entity(from, ShaderTime::Seconds) };
}

/// Adds an entity whose `shaderTime` has a unit.
///
/// # Safety
/// That of [`add_ref_entity`].
pub unsafe fn add_entity(from: *const refEntity_t, time: ShaderTime) {
    entry(|| {
        if from.is_null() {
            return Ok(());
        }
        // SAFETY: not null, so it points at an entity by this function's contract, possibly in a game module's
        // unaligned memory. All of its members are numbers: any bytes are valid.
        let from = unsafe { from.read_unaligned() };
        draw(|renderer, front| {
            if from.origin.iter().any(|v| v.is_nan()) {
                if !front.warned_bad_origin {
                    front.warned_bad_origin = true;
                    log::warn!(
                        "the game sent an entity with NaN coordinates; such entities are not drawn"
                    );
                }
                return Ok(());
            }
            let Some(entity) = convert::entity(&from, time) else {
                return Err(Failure::drop(format!(
                    "the game sent an entity of type {}, which does not exist",
                    from.reType
                )));
            };
            renderer.add_entity(&entity);
            Ok(())
        })
    });
}

/// `re.AddPolyToScene`: `num` polygons of `num_verts` corners each. Polygons with material 0 are omitted with a
/// warning.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `verts` must be null, or point at `num * num_verts` contiguous
/// corners, which are copied. Null, or a count below 1, adds nothing.
pub unsafe extern "C" fn add_poly(
    shader: c_int,
    num_verts: c_int,
    verts: *const polyVert_t,
    num: c_int,
) {
    entry(|| {
        let (Ok(per_poly @ 1..), Ok(polygons @ 1..), false) = (
            usize::try_from(num_verts),
            usize::try_from(num),
            verts.is_null(),
        ) else {
            return Ok(());
        };
        if shader == 0 {
            log::warn!("the game sent a polygon without a shader");
            return Ok(());
        }
        let Some(count) = per_poly.checked_mul(polygons) else {
            return Ok(());
        };
        let corner = |i: usize| {
            // SAFETY: `verts` has `num * num_verts` corners by this function's contract, and `i` is below that.
            convert::poly_vert(&unsafe { verts.add(i).read_unaligned() })
        };
        draw(|renderer, _| {
            // frames may have hundreds of marks and puffs with few corners: these need no allocation
            let mut few = [PolyVert::default(); 16];
            if let Some(corners) = few.get_mut(..per_poly) {
                for first in (0..count).step_by(per_poly) {
                    for (i, place) in (first..).zip(corners.iter_mut()) {
                        *place = corner(i);
                    }
                    renderer.add_poly(shader, corners, per_poly);
                }
            } else {
                let corners: Vec<_> = (0..count).map(corner).collect();
                renderer.add_poly(shader, &corners, per_poly);
            }
            Ok(())
        })
    });
}

/// Adds a light.
///
/// # Safety
/// `origin` must be null or point at three floats.
unsafe fn add_light_of(origin: *const Vec3C, radius: f32, color: Vec3, additive: bool) {
    entry(|| {
        // SAFETY: null or three floats by this function's contract.
        let origin = unsafe { convert::vector(origin) };
        draw(|renderer, _| {
            // Also false for a NaN radius.
            if radius > 0.0 && origin.is_finite() && color.is_finite() {
                renderer.add_light(DynamicLight {
                    origin,
                    radius,
                    color,
                    additive,
                    end: None,
                });
            }
            Ok(())
        })
    });
}

/// `re.AddLightToScene`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `origin` must be null, which counts as the world's origin, or
/// point at three floats. A radius that is not above 0, and an origin or colour that is not finite, add nothing.
pub unsafe extern "C" fn add_light(
    origin: *const Vec3C,
    radius: c_float,
    r: c_float,
    g: c_float,
    b: c_float,
) {
    // SAFETY: the light's origin, null or three floats by this function's contract.
    unsafe { add_light_of(origin, radius, Vec3::new(r, g, b), false) };
}

/// `re.AddAdditiveLightToScene`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `origin` must be null, which counts as the world's origin, or
/// point at three floats. A radius that is not above 0, and an origin or colour that is not finite, add nothing.
pub unsafe extern "C" fn add_additive_light(
    origin: *const Vec3C,
    radius: c_float,
    r: c_float,
    g: c_float,
    b: c_float,
) {
    // SAFETY: the light's origin, null or three floats by this function's contract.
    unsafe { add_light_of(origin, radius, Vec3::new(r, g, b), true) };
}

/// Adds a light along a line.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `start` and `end` must each be null, which counts as the world's
/// origin, or point at three floats.
pub unsafe fn add_light_along(start: *const Vec3C, end: *const Vec3C, radius: f32, color: Vec3) {
    entry(|| {
        // SAFETY: null or three floats each by this function's contract.
        let [origin, end] = [start, end].map(|place| unsafe { convert::vector(place) });
        draw(|renderer, _| {
            if radius > 0.0 && origin.is_finite() && end.is_finite() && color.is_finite() {
                renderer.add_light(DynamicLight {
                    origin,
                    radius,
                    color,
                    end: Some(end),
                    ..DynamicLight::default()
                });
            }
            Ok(())
        })
    });
}

/// `re.RenderScene`. A view of the map without a map ends in the engine's `Error`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `from` must be null, which draws nothing, or point at a
/// `refdef_t`, whose members may hold any value. It is copied.
pub unsafe extern "C" fn render_scene(from: *const refdef_t) {
    entry(|| {
        if from.is_null() {
            return Ok(());
        }
        // SAFETY: not null, so it points at a view by this function's contract, possibly in a game module's memory. All
        // of its members are numbers: any bytes are valid.
        let view = convert::view(&unsafe { from.read_unaligned() });
        draw(|renderer, front| {
            if front.settings.no_refresh {
                return Ok(());
            }
            if view.flags & rdflags::NO_WORLD_MODEL == 0 {
                front.world_view = Some(view);
                if let Some((_, lines)) = &mut front.path {
                    lines.push_str(&PathPoint::of(&view).line());
                }
                // a path is drawn in place of the game's view
                if let Some(benchmark) = &mut front.benchmark
                    && !benchmark.sees()
                {
                    renderer.clear_scene();
                    return Ok(());
                }
            }
            renderer.render_scene(&view).map_err(Failure::from)
        })?;
        // the engine calls back for each polygon, so that the state is in its cell meanwhile
        let debugs = |cvars: &Cvars| cvars.flag(Cvar::DebugSurface);
        let wanted = with_renderer(|_, front| Ok(front.cvars.as_ref().is_some_and(debugs)))?;
        if let Some(engine) = engine::current().filter(|_| wanted) {
            engine.draw_debug_surface(debug_polygon);
        }
        Ok(())
    });
}

/// Receives a polygon of the engine's collision debugging: the callback of `ri.CM_DrawDebugSurface`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `points` must be null, which draws nothing, or point at `count`
/// vectors of three floats; only the first 64 are read. A count below 0 counts as 0.
unsafe extern "C" fn debug_polygon(color: c_int, count: c_int, points: *mut c_float) {
    entry(|| {
        let count = usize::try_from(count).unwrap_or(0).min(MAX_MARK_POINTS);
        if points.is_null() {
            return Ok(());
        }
        let mut corners = [Vec3::ZERO; MAX_MARK_POINTS];
        for (i, corner) in corners.iter_mut().enumerate().take(count) {
            // SAFETY: not null, so it has `count` vectors by this function's contract, and `i` is below `count`.
            *corner = unsafe { convert::vector(points.cast::<Vec3C>().add(i)) };
        }
        draw(|renderer, _| {
            renderer.add_debug_polygon(color.cast_unsigned(), &corners[..count]);
            Ok(())
        })
    });
}

/// `re.SetColor`. Null is white.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `rgba` must be null or point at four floats, which may have
/// any value.
pub unsafe extern "C" fn set_color(rgba: *const [c_float; 4]) {
    entry(|| {
        // SAFETY: read where it is not null, which makes it four floats by this function's contract.
        let color = (!rgba.is_null()).then(|| unsafe { rgba.read_unaligned() });
        draw(|renderer, _| {
            renderer.set_color(color);
            Ok(())
        })
    });
}

/// `re.DrawStretchPic`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract); there are no pointers. A handle without a material draws the
/// default one.
#[rustfmt::skip]
#[allow(clippy::too_many_arguments)] // the engine's signature
pub unsafe extern "C" fn stretch_pic(x: c_float, y: c_float, w: c_float, h: c_float, s1: c_float, t1: c_float, s2: c_float, t2: c_float, shader: c_int) {
    entry(|| {
        draw(|renderer, front| {
            let (position, size) = (Vec2::new(x, y), Vec2::new(w, h));
            let (st1, st2) = (Vec2::new(s1, t1), Vec2::new(s2, t2));
            let whole = StretchedPicture { position, size, st1, st2 };
            if let Some(picture) = convert::clipped(whole, front.clip_region.unwrap_or_default()) {
                renderer.stretch_pic(&picture, shader);
            }
            Ok(())
        })
    });
}

/// The pixels of a raw picture: `cols * rows` of four bytes.
///
/// # Safety
/// `data` must be null or hold that many bytes while the result is used.
unsafe fn raw_pixels<'a>(
    cols: c_int,
    rows: c_int,
    data: *const c_uchar,
) -> Option<(u32, u32, &'a [u8])> {
    let sides = 1..=MAX_RAW_SIDE;
    if data.is_null() || !sides.contains(&cols) || !sides.contains(&rows) {
        return None;
    }
    let (cols, rows) = (u32::try_from(cols).ok()?, u32::try_from(rows).ok()?);
    // SAFETY: not null, so it holds that many bytes by this function's contract: 2^14 * 2^14 * 4 = 2^30 at most.
    let pixels = unsafe { std::slice::from_raw_parts(data, cols as usize * rows as usize * 4) };
    Some((cols, rows, pixels))
}

/// `re.DrawStretchRaw`. Sides that are no powers of two end in the engine's `Error`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `data` must be null, which draws nothing, or hold
/// `cols * rows` pixels of four bytes. They are copied. Sides above 16384 and a client below 0 draw nothing.
#[rustfmt::skip]
#[allow(clippy::too_many_arguments)] // the engine's signature
pub unsafe extern "C" fn stretch_raw(x: c_int, y: c_int, w: c_int, h: c_int, cols: c_int, rows: c_int, data: *const c_uchar, client: c_int, dirty: QBool) {
    entry(|| {
        // Checked before data is read: the engine's own renderer also refuses such sizes.
        if [cols, rows].iter().any(|&n| n <= 0 || !n.cast_unsigned().is_power_of_two()) {
            return Err(Failure::drop(format!("a raw picture of {cols}x{rows} pixels: both must be powers of two")));
        }
        // SAFETY: null or `cols * rows` pixels by this function's contract, for as long as the call lasts.
        let pixels = unsafe { raw_pixels(cols, rows, data) };
        draw(|renderer, _| match (pixels, usize::try_from(client)) {
            (Some((cols, rows, rgba)), Ok(client)) => {
                let frame = CinematicFrame { cols, rows, rgba, client, dirty: is_true(dirty) };
                renderer.stretch_raw(IVec2::new(x, y), IVec2::new(w, h), &frame).map_err(Failure::from)
            }
            _ => Ok(()),
        })
    });
}

/// `re.UploadCinematic`, which the engine also calls from inside `ri.CIN_UploadCinematic`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `data` must be null, which uploads nothing, or hold
/// `cols * rows` pixels of four bytes. They are copied. Sides out of 1 to 16384 and a handle below 0 upload nothing.
pub unsafe extern "C" fn upload_cinematic(
    _w: c_int,
    _h: c_int,
    cols: c_int,
    rows: c_int,
    data: *const c_uchar,
    handle: c_int,
    dirty: QBool,
) {
    entry(|| {
        // SAFETY: null or the video's `cols * rows` pixels by this function's contract, for as long as the call lasts.
        let pixels = unsafe { raw_pixels(cols, rows, data) };
        with_renderer(
            |renderer, front| match (pixels, front.cinematics.client_of(handle)) {
                (Some((cols, rows, rgba)), Some(client)) => {
                    let frame = CinematicFrame {
                        cols,
                        rows,
                        rgba,
                        client,
                        dirty: is_true(dirty),
                    };
                    renderer.upload_cinematic(&frame).map_err(Failure::from)
                }
                _ => Ok(()),
            },
        )
    });
}

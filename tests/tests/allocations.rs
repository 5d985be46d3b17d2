//! A frame like the ones before takes nothing from the heap.

use std::ffi::CStr;

use glam::Vec3;
use tests::engine::abi::{polyVert_t, refEntity_t};
use tests::engine::allocations::{Counting, count};
use tests::engine::{Engine, Options, Raised, View};
use tests::maps::{self, HERE, ROOMS};

/// Near the floor.
const FEET: Vec3 = Vec3::new(HERE.x, HERE.y, HERE.z - 30.0);
/// A tag of the model.
const TAG: &CStr = c"tag_top";
/// A view without the map.
const RDF_NOWORLDMODEL: i32 = 1;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What a frame shows, registered beforehand.
struct Things {
    entities: Vec<refEntity_t>,
    mark: Vec<polyVert_t>,
    mark_shader: i32,
    picture: i32,
    model: i32,
    head: View,
}

impl Things {
    fn register(engine: &mut Engine) -> Result<Self, Raised> {
        let model = engine.register_model("models/test.md3")?;
        let scroll = engine.register_shader("textures/test/scroll")?;
        let picture = engine.register_shader_no_mip("gfx/2d/tinted")?;
        assert!(model > 0 && scroll > 0 && picture > 0);
        let place = HERE + Vec3::new(80.0, 0.0, 0.0);
        let entity = |kind: i32, side: f32| refEntity_t {
            reType: kind,
            hModel: model,
            customShader: if kind == 0 { 0 } else { scroll },
            axis: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            origin: (place + Vec3::new(0.0, side, 0.0)).to_array(),
            oldorigin: (place + Vec3::new(40.0, side, 20.0)).to_array(),
            lightingOrigin: place.to_array(),
            shaderRGBA: [255; 4],
            radius: 12.0,
            backlerp: 0.5,
            ..Default::default()
        };
        let corner = |y: f32, z: f32| polyVert_t {
            xyz: (place + Vec3::new(10.0, y, z)).to_array(),
            st: [y / 8.0, z / 8.0],
            modulate: [255; 4],
        };
        let mut head = View::new(HERE, 0.0);
        head.flags = RDF_NOWORLDMODEL;
        (head.place, head.width, head.height) = ([240, 180], 64, 48);
        Ok(Self {
            // a model, a sprite, a beam, the core and the rings of a rail, a lightning bolt
            entities: [0, 2, 3, 4, 5, 6]
                .into_iter()
                .zip([0.0, 20.0, 30.0, -20.0, -30.0, -40.0])
                .map(|(kind, side)| entity(kind, side))
                .collect(),
            mark: vec![
                corner(0.0, 0.0),
                corner(8.0, 0.0),
                corner(8.0, 8.0),
                corner(0.0, 8.0),
            ],
            mark_shader: scroll,
            picture,
            model,
            head,
        })
    }

    /// One frame of a game: the world, what moves in it, pictures, a view of a model on the screen.
    fn draw(&self, engine: &mut Engine, number: i32) -> Result<(), Raised> {
        engine.set_clock(1000 + number * 16);
        engine.begin_frame(0)?;
        engine.draw_stretch_pic([0.0, 0.0, 32.0, 32.0], [0.0, 0.0, 1.0, 1.0], self.picture)?;
        engine.clear_scene()?;
        for entity in &self.entities {
            engine.add_entity(entity)?;
        }
        for _ in 0..number {
            engine.add_poly(self.mark_shader, &self.mark, 4)?;
        }
        // what a game asks for the shadow below a player, and where his head is
        engine.ask_mark(FEET, 24.0)?;
        engine.ask_tag(self.model, TAG)?;
        engine.add_light(HERE + Vec3::new(100.0, 0.0, 0.0), 200.0, Vec3::ONE)?;
        engine.render_scene(&View::new(HERE, number as f32))?;
        engine.set_color(Some([1.0, 0.5, 0.0, 0.5]))?;
        engine.draw_stretch_pic([0.0, 0.0, 64.0, 64.0], [0.0, 0.0, 1.0, 1.0], self.picture)?;
        engine.set_color(None)?;
        if let Some(model) = self.entities.first() {
            engine.clear_scene()?;
            engine.add_entity(model)?;
            engine.render_scene(&self.head)?;
        }
        engine.end_frame()
    }
}

#[test]
fn a_steady_frame_allocates_nothing() {
    // The validation layer's messages go through callbacks of the renderer, so it is left out here.
    let options = Options {
        files: maps::files(),
        cvars: vec![("r_vkValidation".into(), "0".into())],
        clock: Some(1000),
        ..Options::default()
    };
    let entry = relight_ffi::GetRefAPI as *const ();
    // SAFETY: this is the library's `GetRefAPI`.
    let mut engine = unsafe { Engine::start_linked(entry, options) }.expect("the library starts");
    engine.start_map(ROOMS).expect("the map loads");
    let things = Things::register(&mut engine).expect("everything is there");
    assert!(engine.ask_mark(FEET, 24.0).expect("an answer") > 0);
    assert!(engine.ask_tag(things.model, TAG).expect("an answer"));
    // passes are timed from now on; shadows are volumes
    engine.command("rt_timings").expect("a command");
    engine.set("cg_shadows", "2");
    for number in 0..24 {
        things.draw(&mut engine, number % 8).expect("a frame");
    }
    let taken: Vec<u64> = (0..8)
        .map(|number| {
            let (taken, drawn) = count(|| things.draw(&mut engine, number));
            drawn.expect("a frame");
            taken
        })
        .collect();
    drop(engine);
    // the library's panic hook prints to its engine, which is gone
    let _ = std::panic::take_hook();
    assert_eq!(taken, [0; 8], "blocks taken by frames like the ones before");
}

//! Maps to JSON and back.

use super::*;
use crate::SearchPath;
use crate::export::uncalibrated as world;
use crate::files::GameFiles;
use crate::sample::Sample;
use proptest::prelude::*;
use q3bsp::builder::MapBuilder;
use q3bsp::{DrawVert, Format, GridLayers, GridPoint, SurfaceLayers, VertexLayers};

/// A small map with something in every list.
fn map() -> Bsp {
    let mut map = MapBuilder::new();
    let wall = map.add_shader("textures/wall \"x\"", 3, 1);
    let one = map.add_room(wall, Vec3::splat(-64.0), Vec3::splat(64.0));
    let two = map.add_room(
        wall,
        Vec3::new(64.0, -32.0, -32.0),
        Vec3::new(128.0, 32.0, 32.0),
    );
    map.set_sees(one, two, false);
    map.add_fog_brush(wall, Vec3::splat(-64.0), Vec3::splat(0.0), 5);
    let page = map.add_lightmap([1, 2, 3]);
    map.set_lightmap(0, page);
    map.add_flare(wall, Vec3::X, Vec3::Z, Vec3::ONE);
    map.add_entity(&[("classname", "light"), ("origin", "0 0 8")]);
    map.build_with_grid(Vec3::splat(32.0), |p| GridPoint {
        ambient: [p.x as i8 as u8; 3],
        directed: [2; 3],
        longitude: 3,
        latitude: 255,
    })
}

fn read_back(bsp: Bsp) -> Result<Bsp, JsonError> {
    read_map(&document(&world(bsp), &|_| Finish::default()).unwrap())
}

/// Whether everything in two maps is the same, numbers that are none included.
fn same(a: &Bsp, b: &Bsp) {
    let strip = |bsp: &Bsp| {
        let mut bsp = bsp.clone();
        bsp.warnings.clear();
        bsp
    };
    // Debug output shows every field; NaN is not equal to itself.
    assert_eq!(format!("{:?}", strip(a)), format!("{:?}", strip(b)));
    assert!(a.write() == b.write());
}

#[test]
fn maps_survive_the_way_there_and_back() {
    let bytes = map().write();
    let mut odd = bytes.clone();
    odd.extend(b"behind the last lump");
    for bytes in [bytes, odd] {
        let bsp = Bsp::parse(&bytes).unwrap();
        let read = read_back(bsp.clone()).unwrap();
        same(&read, &bsp);
        assert!(read.write() == bytes);
    }
    let mut layered = map();
    layered.format = Format::Rbsp;
    layered.layers.grid_points = vec![GridLayers::from_point(&layered.light_grid[0])];
    let bsp = Bsp::parse(&layered.write()).unwrap();
    same(&read_back(bsp.clone()).unwrap(), &bsp);
}

#[test]
fn repaired_values_are_written_as_they_were() {
    let mut bsp = map();
    bsp.surfaces[0].fog = 77;
    bsp.vertices[0].lightmap.x = f32::NAN;
    let bytes = bsp.write();
    let bsp = Bsp::parse(&bytes).unwrap();
    assert_eq!(bsp.container.repairs.len(), 1);
    assert!(read_back(bsp).unwrap().write() == bytes);
}

#[test]
fn what_was_found_is_told() {
    let document: Value =
        serde_json::from_slice(&document(&world(map()), &|_| Finish::default()).unwrap()).unwrap();
    assert_eq!(document["schema"], SCHEMA);
    assert_eq!(document["entities"][1][0][1], "light");
    assert_eq!(document["lights"]["points"][0]["origin"][2], 8.0);
    assert_eq!(document["clusters"].as_array().unwrap().len(), 3);
    assert_eq!(document["clusters"][0]["sees"], serde_json::json!([0]));
    assert_eq!(
        document["clusters"][0]["point_lights"],
        serde_json::json!([0])
    );
    assert_eq!(document["materials"][0]["name"], "textures/wall \"x\"");
}

#[test]
fn what_is_no_such_document_is_refused_with_its_place() {
    let good = String::from_utf8(document(&world(map()), &|_| Finish::default()).unwrap()).unwrap();
    for (from, to, part) in [
        ("\"relight-map\"", "\"other\"", "schema"),
        ("\"version\":1", "\"version\":2", "version 2, not 1"),
        ("\"plane\":0", "\"plane\":\"a\"", "expected i32 at line 10 "),
        ("\"plane\":0", "\"plane\":99999", "valid map"),
        ("\"kind\":\"planar\"", "\"kind\":\"round\"", "any variant"),
        ("\"nodes\":", "\"knots\":", "missing field `nodes`"),
        ("{", "", "line 2 "),
    ] {
        let broken = good.replacen(from, to, 1);
        assert_ne!(broken, good, "{from}");
        let problem = read_map(broken.as_bytes()).unwrap_err().to_string();
        assert!(problem.contains(part), "{part}: {problem}");
    }
}

#[test]
fn the_sample_and_a_shipped_map_survive() {
    let files = Sample::Hall.files().unwrap();
    let bytes = files.read(Sample::Hall.map()).unwrap().unwrap();
    let bsp = Bsp::parse(&bytes).unwrap();
    let read = read_back(bsp).unwrap();
    assert!(read.write() == bytes);
    let Some(folder) = testkit::folder() else {
        return;
    };
    let files = SearchPath::open(&[folder]).unwrap();
    let bytes = files.read("maps/oa_minia.bsp").unwrap().unwrap();
    let bsp = Bsp::parse(&bytes).unwrap();
    let read = read_back(bsp).unwrap();
    assert!(read.write() == bytes);
}

/// Any number of 32 bits, NaN with all its patterns included.
fn number() -> impl Strategy<Value = f32> {
    any::<u32>().prop_map(f32::from_bits)
}

proptest! {
    #![proptest_config(testkit::cases(40))]

    #[test]
    fn any_values_survive(
        numbers in prop::collection::vec(number(), 12),
        bytes in any::<[u8; 8]>(),
        words in any::<[i32; 4]>(),
        name in "[ -~äß]{0,60}",
        text in prop::collection::vec(any::<u8>(), 0..50),
    ) {
        let mut bsp = map();
        bsp.format = Format::Fbsp;
        bsp.lightmaps.clear();
        bsp.surfaces[0].lightmap = -3;
        bsp.vertices[3] = DrawVert {
            position: Vec3::new(numbers[0], numbers[1], numbers[2]),
            st: glam::Vec2::new(numbers[3], numbers[4]),
            lightmap: glam::Vec2::new(numbers[5], numbers[6]),
            normal: Vec3::new(numbers[7], numbers[8], numbers[9]),
            color: [bytes[0], bytes[1], bytes[2], bytes[3]],
        };
        bsp.planes[0].dist = numbers[10];
        bsp.surfaces[1].lightmap_x = words[0];
        bsp.surfaces[1].lightmap_origin.y = numbers[11];
        bsp.nodes[0].mins = [words[0], words[1], words[2]];
        bsp.shaders[0] = q3bsp::ShaderRef::new(&name, words[3] as u32, words[2] as u32);
        bsp.entities = text;
        bsp.layers.surfaces = vec![SurfaceLayers {
            lightmap_styles: [bytes[4], bytes[5], bytes[6], bytes[7]],
            lightmap_x: [words[1], words[2], words[3]],
            ..SurfaceLayers::default()
        }; bsp.surfaces.len()];
        bsp.layers.vertices = vec![VertexLayers { color: [[bytes[1]; 4]; 3], ..VertexLayers::default() }; bsp.vertices.len()];
        let file = bsp.write();
        let bsp = Bsp::parse(&file).unwrap();
        let text = serde_json::to_string(&bsp).unwrap();
        let read: Bsp = serde_json::from_str(&text).unwrap();
        same(&read, &bsp);
        prop_assert!(read.write() == file);
    }
}

/// Checks a value against the published schema, for the keywords that the schema uses.
fn conforms(value: &Value, schema: &Value, root: &Value, path: &str) {
    if let Some(reference) = schema["$ref"].as_str() {
        let schema = root.pointer(reference.trim_start_matches('#')).unwrap();
        return conforms(value, schema, root, path);
    }
    if let Some(choices) = schema["anyOf"].as_array() {
        let fits = |choice: &Value| {
            std::panic::catch_unwind(|| conforms(value, choice, root, path)).is_ok()
        };
        // Choices that their kind distinguishes come first, so that a fault inside is shown.
        let null = |s: &Value| s["type"] == "null";
        if let ([one, other], false) = (choices.as_slice(), value.is_null())
            && null(other)
        {
            return conforms(value, one, root, path);
        }
        assert!(choices.iter().any(fits), "{path}: {value}");
        return;
    }
    if let Some(expected) = schema.get("const") {
        assert_eq!(value, expected, "{path}");
    }
    if let Some(list) = schema["enum"].as_array() {
        assert!(list.contains(value), "{path}: {value}");
    }
    let kind_fits = match schema["type"].as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("integer") => value.is_i64() || value.is_u64(),
        Some("number") => value.is_number(),
        Some("boolean") => value.is_boolean(),
        Some("null") => value.is_null(),
        _ => true,
    };
    assert!(kind_fits, "{path}: {value}");
    if let Some(object) = value.as_object() {
        for key in schema["required"].as_array().into_iter().flatten() {
            assert!(
                object.contains_key(key.as_str().unwrap()),
                "{path}: no {key}"
            );
        }
        for (key, value) in object {
            match schema["properties"].get(key) {
                Some(schema) => conforms(value, schema, root, &format!("{path}.{key}")),
                None => assert_ne!(schema["additionalProperties"], false, "{path}.{key}"),
            }
        }
    }
    if let (Some(list), Some(items)) = (value.as_array(), schema.get("items")) {
        let count = list.len() as u64;
        assert!(
            schema["minItems"]
                .as_u64()
                .is_none_or(|least| count >= least),
            "{path}"
        );
        assert!(
            schema["maxItems"].as_u64().is_none_or(|most| count <= most),
            "{path}"
        );
        if items.is_object() {
            for (at, value) in list.iter().enumerate() {
                conforms(value, items, root, &format!("{path}[{at}]"));
            }
        }
    }
}

#[test]
fn documents_are_what_the_schema_says() {
    let schema = include_str!("../../../../docs/src/map-json.schema.json");
    let schema: Value = serde_json::from_str(schema).unwrap();
    let mut layered = map();
    layered.format = Format::Rbsp;
    let layered = Bsp::parse(&layered.write()).unwrap();
    for bsp in [map(), layered] {
        let document: Value =
            serde_json::from_slice(&document(&world(bsp), &|_| Finish::default()).unwrap())
                .unwrap();
        conforms(&document, &schema, &schema, "");
    }
}

//! The feature `serde`: what was serialized is deserialized again.

use q3bsp::quake::QuakeMap;
use q3bsp::{Bsp, Format};

#[path = "quake/room.rs"]
#[allow(dead_code, reason = "the tests of these formats take all of it")]
mod room;
#[path = "common/sample.rs"]
mod sample;

fn through_json(bsp: &Bsp) -> Bsp {
    serde_json::from_str(&serde_json::to_string(bsp).unwrap()).unwrap()
}

#[test]
fn maps_keep_their_bytes() {
    for format in [Format::Ibsp46, Format::QuakeLive, Format::Rbsp] {
        let mut bsp = sample::sample();
        bsp.format = format;
        // A repair and its warning, and numbers that JSON does not have.
        bsp.surfaces[0].fog = 7;
        bsp.vertices[0].st.x = f32::from_bits(0xffc1_2345);
        bsp.planes[0].dist = f32::NEG_INFINITY;
        if format == Format::QuakeLive {
            bsp.advertisements = vec![sample::advertisement()];
        }
        let bytes = bsp.write();
        let bsp = Bsp::parse(&bytes).unwrap();
        assert_eq!(bsp.container.repairs.len(), 1);
        let mut read = through_json(&bsp);
        assert!(read.write() == bytes, "{format}");
        read.validate().unwrap();
    }
}

#[test]
fn indices_are_plain_numbers() {
    let bsp = sample::sample();
    let json = serde_json::to_value(&bsp).unwrap();
    for (node, json) in bsp.nodes.iter().zip(json["nodes"].as_array().unwrap()) {
        assert_eq!(json["plane"], node.plane.raw());
        assert_eq!(json["children"][0], node.children[0].raw());
        assert_eq!(json["children"][1], node.children[1].raw());
    }
    assert_eq!(json["leaf_surfaces"][1], bsp.leaf_surfaces[1].raw());
    assert_eq!(json["surfaces"][0]["shader"], bsp.surfaces[0].shader.raw());
}

#[test]
fn converted_maps_keep_what_their_formats_add() {
    for format in room::FORMATS {
        let map = room::room(format);
        let json = serde_json::to_string(&map).unwrap();
        assert_eq!(serde_json::from_str::<QuakeMap>(&json).unwrap(), map);
        let bsp = map.to_bsp().unwrap();
        let read = through_json(&bsp);
        assert!(!read.texture_uses.is_empty());
        assert_eq!(read.texture_uses, bsp.texture_uses);
        assert_eq!(read.embedded_textures, bsp.embedded_textures);
        assert_eq!(read.texel_coordinates, bsp.texel_coordinates);
    }
}

#[test]
fn what_no_map_can_hold_is_an_error() {
    let json = serde_json::to_string(&room::room(Format::Quake).to_bsp().unwrap()).unwrap();
    for (from, to, error) in [
        (
            "\"nolightmap\"",
            "\"sparkles\"",
            "unknown variant `sparkles`",
        ),
        (
            "\"raw_name\":\"",
            "\"raw_name\":\"AAAA",
            "invalid length 67, expected [u8; 64]",
        ),
        (
            "\"format\":\"BSP 29 (Quake)\"",
            "\"format\":\"Doom\"",
            "unknown format \"Doom\"",
        ),
    ] {
        assert!(json.contains(from), "{from}");
        let broken = json.replacen(from, to, 1);
        let found = serde_json::from_str::<Bsp>(&broken)
            .unwrap_err()
            .to_string();
        assert!(found.starts_with(error), "{found}");
    }
}

//! The `surfaceparm` table: names to surface and content flags, as the renderer reads it.

/// Damage from falling is not given.
pub const SURF_NODAMAGE: u32 = 0x1;
/// Little friction.
pub const SURF_SLICK: u32 = 0x2;
/// Sky.
pub const SURF_SKY: u32 = 0x4;
/// Can be climbed.
pub const SURF_LADDER: u32 = 0x8;
/// Missiles vanish here.
pub const SURF_NOIMPACT: u32 = 0x10;
/// No marks are left.
pub const SURF_NOMARKS: u32 = 0x20;
/// Sounds of flesh.
pub const SURF_FLESH: u32 = 0x40;
/// The compiler makes no surface.
pub const SURF_NODRAW: u32 = 0x80;
/// Splits the BSP first.
pub const SURF_HINT: u32 = 0x100;
/// Removed by the compiler.
pub const SURF_SKIP: u32 = 0x200;
/// No lightmap is stored.
pub const SURF_NOLIGHTMAP: u32 = 0x400;
/// Lit at its vertices.
pub const SURF_POINTLIGHT: u32 = 0x800;
/// Sounds of metal.
pub const SURF_METALSTEPS: u32 = 0x1000;
/// No step sounds.
pub const SURF_NOSTEPS: u32 = 0x2000;
/// Does not collide.
pub const SURF_NONSOLID: u32 = 0x4000;
/// Colours the light that passes.
pub const SURF_LIGHTFILTER: u32 = 0x8000;
/// Its shadow follows the texture's alpha.
pub const SURF_ALPHASHADOW: u32 = 0x10000;
/// No dynamic lights.
pub const SURF_NODLIGHT: u32 = 0x20000;
/// Steps raise dust.
pub const SURF_DUST: u32 = 0x40000;

/// Lava.
pub const CONTENTS_LAVA: u32 = 0x8;
/// Slime.
pub const CONTENTS_SLIME: u32 = 0x10;
/// Water.
pub const CONTENTS_WATER: u32 = 0x20;
/// Fog.
pub const CONTENTS_FOG: u32 = 0x40;
/// Divides areas.
pub const CONTENTS_AREAPORTAL: u32 = 0x8000;
/// Stops players.
pub const CONTENTS_PLAYERCLIP: u32 = 0x10000;
/// Stops monsters.
pub const CONTENTS_MONSTERCLIP: u32 = 0x20000;
/// For bots.
pub const CONTENTS_CLUSTERPORTAL: u32 = 0x100000;
/// For bots.
pub const CONTENTS_DONOTENTER: u32 = 0x200000;
/// Centre of a rotating brush.
pub const CONTENTS_ORIGIN: u32 = 0x1000000;
/// Not part of the structure.
pub const CONTENTS_DETAIL: u32 = 0x8000000;
/// Part of the structure.
pub const CONTENTS_STRUCTURAL: u32 = 0x10000000;
/// Does not hide what it contains.
pub const CONTENTS_TRANSLUCENT: u32 = 0x20000000;
/// No items stay here.
pub const CONTENTS_NODROP: u32 = 0x80000000;

/// What one `surfaceparm` means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SurfaceParam {
    /// Name in lower case.
    pub name: &'static str,
    /// Takes away the solidity that brushes have otherwise; for the map compiler.
    pub clears_solid: bool,
    /// `SURF_*` bits.
    pub surface_flags: u32,
    /// `CONTENTS_*` bits.
    pub content_flags: u32,
}

const fn param(
    name: &'static str,
    clears_solid: bool,
    surface_flags: u32,
    content_flags: u32,
) -> SurfaceParam {
    SurfaceParam {
        name,
        clears_solid,
        surface_flags,
        content_flags,
    }
}

/// All names of the engine.
pub const SURFACE_PARAMS: &[SurfaceParam] = &[
    param("water", true, 0, CONTENTS_WATER),
    param("slime", true, 0, CONTENTS_SLIME),
    param("lava", true, 0, CONTENTS_LAVA),
    param("playerclip", true, 0, CONTENTS_PLAYERCLIP),
    param("monsterclip", true, 0, CONTENTS_MONSTERCLIP),
    param("nodrop", true, 0, CONTENTS_NODROP),
    param("nonsolid", true, SURF_NONSOLID, 0),
    param("origin", true, 0, CONTENTS_ORIGIN),
    param("trans", false, 0, CONTENTS_TRANSLUCENT),
    param("detail", false, 0, CONTENTS_DETAIL),
    param("structural", false, 0, CONTENTS_STRUCTURAL),
    param("areaportal", true, 0, CONTENTS_AREAPORTAL),
    param("clusterportal", true, 0, CONTENTS_CLUSTERPORTAL),
    param("donotenter", true, 0, CONTENTS_DONOTENTER),
    param("fog", true, 0, CONTENTS_FOG),
    param("sky", false, SURF_SKY, 0),
    param("lightfilter", false, SURF_LIGHTFILTER, 0),
    param("alphashadow", false, SURF_ALPHASHADOW, 0),
    param("hint", false, SURF_HINT, 0),
    param("slick", false, SURF_SLICK, 0),
    param("noimpact", false, SURF_NOIMPACT, 0),
    param("nomarks", false, SURF_NOMARKS, 0),
    param("ladder", false, SURF_LADDER, 0),
    param("nodamage", false, SURF_NODAMAGE, 0),
    param("metalsteps", false, SURF_METALSTEPS, 0),
    param("flesh", false, SURF_FLESH, 0),
    param("nosteps", false, SURF_NOSTEPS, 0),
    param("nodraw", false, SURF_NODRAW, 0),
    param("pointlight", false, SURF_POINTLIGHT, 0),
    param("nolightmap", false, SURF_NOLIGHTMAP, 0),
    param("nodlight", false, SURF_NODLIGHT, 0),
    param("dust", false, SURF_DUST, 0),
];

/// Looks a name up without case.
pub fn surface_param(name: &str) -> Option<&'static SurfaceParam> {
    SURFACE_PARAMS
        .iter()
        .find(|param| param.name.eq_ignore_ascii_case(name))
}

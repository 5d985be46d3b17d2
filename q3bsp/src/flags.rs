//! Flag bits of the shader lump, as the map compiler wrote them (the engine's `surfaceflags.h` values), and how the
//! bits of other games are converted to them.

/// Surface flags ([`crate::ShaderRef::surface_flags`]).
pub mod surface_flags {
    /// No falling damage.
    pub const NODAMAGE: u32 = 0x1;
    /// Low friction.
    pub const SLICK: u32 = 0x2;
    /// Shows the sky.
    pub const SKY: u32 = 0x4;
    /// Can be climbed.
    pub const LADDER: u32 = 0x8;
    /// Projectiles vanish without an explosion.
    pub const NOIMPACT: u32 = 0x10;
    /// No decals.
    pub const NOMARKS: u32 = 0x20;
    /// Flesh sounds and effects.
    pub const FLESH: u32 = 0x40;
    /// Not drawn. For patches the engine honours this bit of the *map*, not of the script.
    pub const NODRAW: u32 = 0x80;
    /// Compiler hint brush.
    pub const HINT: u32 = 0x100;
    /// Skipped by the compiler.
    pub const SKIP: u32 = 0x200;
    /// Has no lightmap.
    pub const NOLIGHTMAP: u32 = 0x400;
    /// Vertex lit.
    pub const POINTLIGHT: u32 = 0x800;
    /// Metal footsteps.
    pub const METALSTEPS: u32 = 0x1000;
    /// No footsteps.
    pub const NOSTEPS: u32 = 0x2000;
    /// No collision.
    pub const NONSOLID: u32 = 0x4000;
    /// Tints light that the compiler traced through it.
    pub const LIGHTFILTER: u32 = 0x8000;
    /// Casts shadows by its texture's alpha.
    pub const ALPHASHADOW: u32 = 0x10000;
    /// Not lit by dynamic lights.
    pub const NODLIGHT: u32 = 0x20000;
    /// Leaves dust.
    pub const DUST: u32 = 0x40000;
}

/// Content flags ([`crate::ShaderRef::content_flags`]).
pub mod content_flags {
    /// Solid.
    pub const SOLID: u32 = 0x1;
    /// Lava.
    pub const LAVA: u32 = 0x8;
    /// Slime.
    pub const SLIME: u32 = 0x10;
    /// Water.
    pub const WATER: u32 = 0x20;
    /// Fog.
    pub const FOG: u32 = 0x40;
    /// Separates areas.
    pub const AREAPORTAL: u32 = 0x8000;
    /// Blocks players.
    pub const PLAYERCLIP: u32 = 0x10000;
    /// Blocks monsters.
    pub const MONSTERCLIP: u32 = 0x20000;
    /// Bot information: teleporter.
    pub const TELEPORTER: u32 = 0x40000;
    /// Bot information: jump pad.
    pub const JUMPPAD: u32 = 0x80000;
    /// Bot information: cluster portal.
    pub const CLUSTERPORTAL: u32 = 0x100000;
    /// Bot information: do not enter.
    pub const DONOTENTER: u32 = 0x200000;
    /// Blocks bots.
    pub const BOTCLIP: u32 = 0x400000;
    /// Moving brush.
    pub const MOVER: u32 = 0x800000;
    /// Marks the origin of a brush model; removed by the compiler.
    pub const ORIGIN: u32 = 0x1000000;
    /// Living body.
    pub const BODY: u32 = 0x2000000;
    /// Dead body.
    pub const CORPSE: u32 = 0x4000000;
    /// Detail brush: does not split the tree.
    pub const DETAIL: u32 = 0x8000000;
    /// Structural brush.
    pub const STRUCTURAL: u32 = 0x10000000;
    /// Does not hide what is behind it.
    pub const TRANSLUCENT: u32 = 0x20000000;
    /// Trigger volume.
    pub const TRIGGER: u32 = 0x40000000;
    /// Items dropped inside vanish.
    pub const NODROP: u32 = 0x80000000;
}

/// Pairs of Raven's surface flags and ours; what has no pair means nothing outside their games.
const RAVEN_SURFACE: [(u32, u32); 9] = [
    (0x2000, surface_flags::SKY),
    (0x4000, surface_flags::SLICK),
    (0x8000, surface_flags::METALSTEPS),
    (0x4_0000, surface_flags::NODAMAGE),
    (0x8_0000, surface_flags::NOIMPACT),
    (0x10_0000, surface_flags::NOMARKS),
    (0x20_0000, surface_flags::NODRAW),
    (0x40_0000, surface_flags::NOSTEPS),
    (0x80_0000, surface_flags::NODLIGHT),
];

/// The same for content flags.
const RAVEN_CONTENT: [(u32, u32); 15] = [
    (0x1, content_flags::SOLID),
    (0x2, content_flags::LAVA),
    (0x4, content_flags::WATER),
    (0x8, content_flags::FOG),
    (0x10, content_flags::PLAYERCLIP),
    (0x20, content_flags::MONSTERCLIP),
    (0x40, content_flags::BOTCLIP),
    (0x100, content_flags::BODY),
    (0x200, content_flags::CORPSE),
    (0x400, content_flags::TRIGGER),
    (0x800, content_flags::NODROP),
    (0x2_0000, content_flags::SLIME),
    (0x8_0000, content_flags::TELEPORTER),
    (0x800_0000, content_flags::DETAIL),
    (0x8000_0000, content_flags::TRANSLUCENT),
];

fn translate(bits: u32, pairs: impl Iterator<Item = (u32, u32)>) -> u32 {
    pairs
        .filter(|(from, _)| bits & from != 0)
        .fold(0, |all, (_, to)| all | to)
}

fn swapped(pairs: &[(u32, u32)]) -> impl Iterator<Item = (u32, u32)> + '_ {
    pairs.iter().map(|&(theirs, ours)| (ours, theirs))
}

/// Surface and content flags of Raven's games in the bits used here.
pub(crate) fn from_raven([surface, content]: [u32; 2]) -> [u32; 2] {
    [
        translate(surface, RAVEN_SURFACE.into_iter()),
        translate(content, RAVEN_CONTENT.into_iter()),
    ]
}

/// The way back, as far as there are pairs.
pub(crate) fn to_raven([surface, content]: [u32; 2]) -> [u32; 2] {
    [
        translate(surface, swapped(&RAVEN_SURFACE)),
        translate(content, swapped(&RAVEN_CONTENT)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_raven_and_we_both_know_survives_the_way_there_and_back() {
        for bit in (0..32).map(|shift| 1u32 << shift) {
            let back = to_raven(from_raven([bit, bit]));
            assert!(back[0] == bit || back[0] == 0, "{bit:x}");
            assert!(back[1] == bit || back[1] == 0, "{bit:x}");
        }
        let flags = [
            surface_flags::SKY | surface_flags::NODRAW,
            content_flags::WATER,
        ];
        assert_eq!(to_raven(flags), [0x20_2000, 0x4]);
        assert_eq!(from_raven([0x20_2000, 0x4]), flags);
    }
}

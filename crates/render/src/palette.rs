//! Colors: sRGB constants, conversion to linear light and back, and default colors of models.

use glam::DVec3;

/// Horizon and zenith.
pub(crate) const SKY: [u32; 2] = [0xd3e1ec, 0x4a86c5];
/// The two tones of the checker.
pub(crate) const CHECKER: [u32; 2] = [0x5f6d7c, 0x788694];
/// Painted on the ground: meter numbers, lines every five cells, the start line.
pub(crate) const NUMBER: u32 = 0xeef2f5;
pub(crate) const FIFTH_LINE: u32 = 0xf5f7f8;
pub(crate) const START_LINE: u32 = 0xf2b632;

/// One base color per agent of a row. A single agent has the first.
const AGENTS: [u32; 6] = [0xe8792e, 0x2f86c1, 0x45a35c, 0xc94f7c, 0x8a63c7, 0xd0a52a];
/// Color of a ghost, which shows a reference pose.
pub(crate) const GHOST: u32 = 0xd8ecff;
/// Objects of the world: steps, walls, ramps.
pub(crate) const WORLD: u32 = 0xb9b2a6;

/// Side of the body that a geom belongs to. The far limb is drawn darker to distinguish the legs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Middle,
    Left,
    Right,
}

/// `0xrrggbb` in linear light.
pub(crate) fn linear(hex: u32) -> DVec3 {
    let channel = |shift: u32| to_linear(f64::from((hex >> shift) & 0xff) / 255.0);
    DVec3::new(channel(16), channel(8), channel(0))
}

/// sRGB value in `0..=1` to linear light (IEC 61966-2-1).
pub(crate) fn to_linear(value: f64) -> f64 {
    let value = value.clamp(0.0, 1.0);
    if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

/// Default color of an agent's geom in linear light.
pub(crate) fn agent(index: usize, side: Side) -> DVec3 {
    sided(linear(AGENTS[index % AGENTS.len()]), side)
}

/// A body's color on one of its sides.
pub(crate) fn sided(base: DVec3, side: Side) -> DVec3 {
    match side {
        Side::Middle => base,
        Side::Right => base * 0.86,
        // left: darker and slightly slate
        Side::Left => (base * 0.42).lerp(linear(0x3c4a63), 0.35),
    }
}

/// Linear light in `0..=1` to 8-bit sRGB, by table: the same bytes on every platform.
pub(crate) struct Encoder {
    table: Vec<u8>,
}

impl Encoder {
    const STEPS: usize = 8192;

    pub fn new() -> Self {
        let encode = |i: usize| {
            let linear = i as f64 / (Self::STEPS - 1) as f64;
            let srgb =
                if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 };
            (srgb * 255.0 + 0.5) as u8
        };
        Self { table: (0..Self::STEPS).map(encode).collect() }
    }

    #[inline]
    pub fn encode(&self, color: DVec3) -> [u8; 3] {
        let last = (Self::STEPS - 1) as f64;
        // a float-to-integer cast saturates, so no value can index past the end
        let pick = |c: f64| self.table[(((c * last) + 0.5) as usize).min(Self::STEPS - 1)];
        [pick(color.x), pick(color.y), pick(color.z)]
    }
}

/// Compresses highlights: Narkowicz's fit of the ACES film curve (2015).
#[inline]
pub(crate) fn tone(color: DVec3) -> DVec3 {
    let curve = |x: f64| (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14);
    DVec3::new(curve(color.x), curve(color.y), curve(color.z)).clamp(DVec3::ZERO, DVec3::ONE)
}

//! The checker on the ground: one-meter cells whose flow reads as speed, with a tick at every corner and a line every eight.

use bevy::asset::RenderAssetUsages;
use bevy::image::{ImageAddressMode, ImageFilterMode, ImageSampler, ImageSamplerDescriptor};
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
use bevy::render::renderer::RenderAdapterInfo;

/// Cells along a side of the texture, one meter each.
pub const PERIOD: f32 = 8.0;
/// Pixels along its side.
const SIDE: usize = 1024;
/// The two tones of warm stone, the ticks, and the lines; sRGB. They are darker and less saturated than characters are.
const TONES: [[u8; 3]; 2] = [[122, 114, 103], [143, 135, 123]];
const TICK: [u8; 3] = [176, 167, 152];
const LINE: [u8; 3] = [236, 231, 220];
/// Width of the line every eight meters, pixels; it is split over both edges of the texture.
const LINE_WIDTH: usize = 6;
/// Length and width of the arms of a tick, which marks a corner of four cells, pixels.
const TICK_SIZE: [usize; 2] = [10, 2];

/// Samples along the direction in which a texture is squeezed. A processor takes seconds for a frame with more than one.
pub fn anisotropy(adapter: Option<&RenderAdapterInfo>) -> u16 {
    if adapter.is_some_and(|a| a.device_type == wgpu::DeviceType::Cpu) { 1 } else { 16 }
}

/// The texture, with all its smaller versions: without them a far checker turns into noise.
pub fn checker(anisotropy: u16) -> Image {
    let cell = SIDE / PERIOD as usize;
    let mut level: Vec<[u8; 3]> = (0..SIDE * SIDE)
        .map(|i| {
            let (x, y) = (i % SIDE, i / SIDE);
            let edge = |v: usize| !(LINE_WIDTH / 2..SIDE - LINE_WIDTH / 2).contains(&v);
            // distance from the next line between cells
            let [u, v] = [x, y].map(|v| (v % cell).min(cell - 1 - v % cell));
            let tick = u.max(v) < TICK_SIZE[0] && u.min(v) < TICK_SIZE[1];
            match () {
                () if edge(x) || edge(y) => LINE,
                () if tick => TICK,
                () => TONES[(x / cell + y / cell) % 2],
            }
        })
        .collect();
    let mut side = SIDE;
    let mut data = Vec::new();
    let mut levels = 0;
    loop {
        data.extend(level.iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]));
        levels += 1;
        if side == 1 {
            break;
        }
        level = halve(&level, side);
        side /= 2;
    }
    let size = Extent3d { width: SIDE as u32, height: SIDE as u32, depth_or_array_layers: 1 };
    let mut image =
        Image::new_uninit(size, TextureDimension::D2, TextureFormat::Rgba8UnormSrgb, RenderAssetUsages::RENDER_WORLD);
    image.data = Some(data);
    image.texture_descriptor.mip_level_count = levels;
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        address_mode_u: ImageAddressMode::Repeat,
        address_mode_v: ImageAddressMode::Repeat,
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        anisotropy_clamp: anisotropy,
        ..default()
    });
    image
}

/// Half the size: means of four pixels in linear light.
fn halve(level: &[[u8; 3]], side: usize) -> Vec<[u8; 3]> {
    let half = side / 2;
    let linear = |c: u8| (f32::from(c) / 255.0).powf(2.2);
    (0..half * half)
        .map(|i| {
            let (x, y) = (2 * (i % half), 2 * (i / half));
            let four = [
                level[y * side + x],
                level[y * side + x + 1],
                level[(y + 1) * side + x],
                level[(y + 1) * side + x + 1],
            ];
            std::array::from_fn(|k| {
                let mean = four.iter().map(|p| linear(p[k])).sum::<f32>() / 4.0;
                (mean.powf(1.0 / 2.2) * 255.0).round() as u8
            })
        })
        .collect()
}

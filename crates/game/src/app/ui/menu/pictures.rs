//! The pictures of the main menu. `crates/game/assets/menu/make.sh` makes them with the recorder of the game.

use bevy::asset::RenderAssetUsages;
use bevy::image::{CompressedImageFormats, ImageSampler, ImageType};
use bevy::platform::collections::HashMap;
use bevy::prelude::*;
use bevy_egui::egui::{self, ColorImage, TextureHandle, TextureId, TextureOptions};

/// A picture of the main menu.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Picture {
    /// Marathon Man runs.
    Play,
    /// A course.
    Courses,
    /// A hopper that learns.
    Learn,
    /// A character and the ghost of its clip.
    Motion,
    /// A model with its joints.
    Testbed,
    /// A row of runners.
    Replays,
}

/// The pictures that have been decoded.
#[derive(Resource, Default)]
pub struct Pictures(HashMap<Picture, TextureHandle>);

pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Pictures>();
}

impl Picture {
    /// The bytes of its file.
    const fn bytes(self) -> &'static [u8] {
        match self {
            Picture::Play => include_bytes!("../../../../assets/menu/play.png"),
            Picture::Courses => include_bytes!("../../../../assets/menu/courses.png"),
            Picture::Learn => include_bytes!("../../../../assets/menu/learn.png"),
            Picture::Motion => include_bytes!("../../../../assets/menu/motion.png"),
            Picture::Testbed => include_bytes!("../../../../assets/menu/testbed.png"),
            Picture::Replays => include_bytes!("../../../../assets/menu/replays.png"),
        }
    }
}

impl Pictures {
    /// The texture of a picture, which is decoded when it is first used.
    pub fn texture(&mut self, ctx: &egui::Context, picture: Picture) -> TextureId {
        let load = || ctx.load_texture(format!("{picture:?}"), decode(picture.bytes()), TextureOptions::LINEAR);
        self.0.entry(picture).or_insert_with(load).id()
    }
}

/// Decodes a PNG; one gray pixel if it is damaged.
fn decode(bytes: &[u8]) -> ColorImage {
    let image = Image::from_buffer(
        bytes,
        ImageType::Extension("png"),
        CompressedImageFormats::NONE,
        true,
        ImageSampler::Default,
        RenderAssetUsages::MAIN_WORLD,
    );
    let pixels = image.ok().and_then(|image| Some((image.width() as usize, image.height() as usize, image.data?)));
    match pixels {
        Some((width, height, data)) if data.len() == 4 * width * height => {
            ColorImage::from_rgba_unmultiplied([width, height], &data)
        }
        _ => ColorImage::filled([1, 1], egui::Color32::GRAY),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_picture_is_small_and_wide() {
        use Picture::{Courses, Learn, Motion, Play, Replays, Testbed};
        for picture in [Play, Courses, Learn, Motion, Testbed, Replays] {
            let [width, height] = decode(picture.bytes()).size;
            assert_eq!(width * 9, height * 16, "{picture:?}: {width} x {height}");
            assert!(picture.bytes().len() < 60_000, "{picture:?}: {} bytes", picture.bytes().len());
        }
    }
}

//! The resolution of the picture: below 1, the scene is drawn into a smaller image, which a second camera shows under the text.
//! Text keeps the resolution of the window.
//!
//! A game that starts at full resolution draws without the detour; a lower one then counts from the next start on.

use crate::app::pacing::IsVideo;
use crate::app::settings::values::{SCALE, Settings};
use bevy::asset::RenderAssetUsages;
use bevy::camera::{ImageRenderTarget, RenderTarget};
use bevy::prelude::*;
use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages};
use bevy::window::PrimaryWindow;
use bevy_egui::egui::{Color32, LayerId, Pos2, Rect};
use bevy_egui::{EguiContexts, EguiGlobalSettings, EguiPrimaryContextPass, EguiTextureHandle, PrimaryEguiContext};
use bevy_marathon::look::FollowCamera;

/// The image that the scene is drawn into.
#[derive(Resource)]
struct SmallPicture {
    image: Handle<Image>,
    size: UVec2,
}

/// Shows the image. Menus that darken the picture come after it.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ShowSet;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(PostStartup, divide.run_if(not(resource_exists::<IsVideo>)))
        .add_systems(
            PostUpdate,
            resize.before(bevy::camera::CameraUpdateSystems).run_if(resource_exists::<SmallPicture>),
        )
        .add_systems(EguiPrimaryContextPass, show.in_set(ShowSet).run_if(resource_exists::<SmallPicture>));
}

/// Gives text and bars a camera of their own, if the scene is to be smaller than the window.
fn divide(
    mut commands: Commands,
    settings: Res<Settings>,
    windows: Query<(), With<PrimaryWindow>>,
    cameras: Query<Entity, (With<FollowCamera>, With<PrimaryEguiContext>)>,
    mut images: ResMut<Assets<Image>>,
    mut egui: ResMut<EguiGlobalSettings>,
) {
    let Some(camera) = cameras.iter().next() else { return };
    if settings.display.resolution_scale >= *SCALE.end() || windows.is_empty() {
        return;
    }
    // else the camera of the scene would get its context again
    egui.auto_create_primary_context = false;
    commands.entity(camera).remove_with_requires::<PrimaryEguiContext>();
    commands.spawn((Camera2d, Msaa::Off, PrimaryEguiContext));
    commands.insert_resource(SmallPicture { image: images.add(blank(UVec2::ONE)), size: UVec2::ONE });
}

/// An image that a camera can draw into.
fn blank(size: UVec2) -> Image {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let (format, usage) = (TextureFormat::Bgra8UnormSrgb, RenderAssetUsages::default());
    let mut image = Image::new_fill(extent, TextureDimension::D2, &[0, 0, 0, 255], format, usage);
    image.texture_descriptor.usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
    image
}

/// Follows the size of the window and the setting. In points, the image is as large as the window, so that the cursor means the
/// same place in both.
fn resize(
    mut commands: Commands,
    settings: Res<Settings>,
    windows: Query<&Window, With<PrimaryWindow>>,
    cameras: Query<Entity, With<FollowCamera>>,
    mut picture: ResMut<SmallPicture>,
    mut images: ResMut<Assets<Image>>,
) {
    let Ok(window) = windows.single() else { return };
    let full = window.physical_size().as_vec2();
    let size = (full * settings.display.resolution_scale).round().as_uvec2().max(UVec2::ONE);
    if size == picture.size {
        return;
    }
    *picture = SmallPicture { image: images.add(blank(size)), size };
    let scale_factor = window.scale_factor() * size.x as f32 / full.x.max(1.0);
    let target = ImageRenderTarget { handle: picture.image.clone(), scale_factor };
    for camera in &cameras {
        commands.entity(camera).insert(RenderTarget::Image(target.clone()));
    }
}

/// Draws the image over all of the window.
fn show(mut contexts: EguiContexts, picture: Res<SmallPicture>, mut last: Local<Option<AssetId<Image>>>) -> Result {
    let id = picture.image.id();
    if let Some(old) = last.replace(id).filter(|old| *old != id) {
        contexts.remove_image(old);
    }
    let texture = contexts.add_image(EguiTextureHandle::Strong(picture.image.clone()));
    let ctx = contexts.ctx_mut()?;
    let whole = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
    ctx.layer_painter(LayerId::background()).image(texture, ctx.content_rect(), whole, Color32::WHITE);
    Ok(())
}

//! Effects of the camera that the quality switches: ambient occlusion, contact shadows and smoothed edges.

use crate::look::FollowCamera;
use crate::look::quality::Quality;
use bevy::core_pipeline::prepass::{DepthPrepass, NormalPrepass};
use bevy::pbr::{ContactShadows, ScreenSpaceAmbientOcclusion, ScreenSpaceAmbientOcclusionQualityLevel};
use bevy::prelude::*;
use bevy_anti_alias::AntiAliasPlugin;
use bevy_anti_alias::fxaa::Fxaa;

/// Thickness that surfaces are assumed to have, m: that of a limb, so that one leg does not darken the other from afar.
const THICKNESS: f32 = 0.12;
/// Length of contact shadows, m.
const CONTACT: f32 = 0.25;

pub(super) fn plugin(app: &mut App) {
    if !app.is_plugin_added::<AntiAliasPlugin>() {
        app.add_plugins(AntiAliasPlugin);
    }
    app.add_systems(Update, equip);
}

/// Gives cameras the effects of the quality.
fn equip(
    mut commands: Commands,
    quality: Res<Quality>,
    cameras: Query<(Entity, Ref<FollowCamera>, Has<ScreenSpaceAmbientOcclusion>)>,
) {
    let full = *quality == Quality::High;
    for (entity, camera, has) in &cameras {
        if full == has || !(quality.is_changed() || camera.is_added()) {
            continue;
        }
        let mut camera = commands.entity(entity);
        camera.insert(quality.msaa());
        if full {
            let occlusion = ScreenSpaceAmbientOcclusion {
                quality_level: ScreenSpaceAmbientOcclusionQualityLevel::High,
                constant_object_thickness: THICKNESS,
            };
            let shadows = ContactShadows { length: CONTACT, thickness: THICKNESS, ..default() };
            camera.insert((occlusion, shadows, Fxaa::default()));
        } else {
            type Effects = (ScreenSpaceAmbientOcclusion, ContactShadows, DepthPrepass, NormalPrepass, Fxaa);
            camera.remove::<Effects>();
        }
    }
}

//! Depth of field for pictures: a free camera is in focus at the character in the middle of its picture.

use crate::look::quality::Quality;
use crate::look::{CameraMode, FollowCamera};
use crate::marathon::RagdollState;
use crate::place::CharacterPose;
use bevy::prelude::*;
use bevy_post_process::PostProcessPlugin;
use bevy_post_process::dof::{DepthOfField, DepthOfFieldMode};

/// Aperture in f-stops. A real lens of this field of view and sensor would blur less than a pixel.
const APERTURE: f32 = 0.16;
/// Largest blur, pixels.
const WIDEST: f32 = 24.0;
/// Distance beyond which the blur does not grow, m: that of the far ground and the sky.
const FARTHEST: f32 = 60.0;
/// Nearest distance in focus, m.
const NEAREST: f32 = 0.3;
/// Rate at which the focus moves, 1/s.
const RATE: f32 = 8.0;
/// Largest slope from the middle of the picture at which a character is in focus.
const MIDDLE: f32 = 0.35;

/// A camera whose depth of field is set here.
#[derive(Component)]
struct Lens;

pub(super) fn plugin(app: &mut App) {
    if !app.is_plugin_added::<PostProcessPlugin>() {
        app.add_plugins(PostProcessPlugin);
    }
    app.add_systems(Update, focus);
}

/// Focuses free cameras at high quality. Other cameras see everything sharply.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn focus(
    mut commands: Commands,
    time: Res<Time<Real>>,
    quality: Res<Quality>,
    mut cameras: Query<(Entity, &FollowCamera, &Transform, Option<&mut DepthOfField>, Has<Lens>)>,
    characters: Query<&CharacterPose, With<RagdollState>>,
) {
    for (entity, camera, place, lens, own) in &mut cameras {
        if *quality != Quality::High || camera.mode != CameraMode::Free {
            if own {
                commands.entity(entity).remove::<(DepthOfField, Lens)>();
            }
            continue;
        }
        let positions = characters.iter().map(|pose| pose.position);
        let wanted = distance(place, positions).unwrap_or(FARTHEST);
        match lens {
            Some(mut lens) if own => {
                let share = 1.0 - (-RATE * time.delta_secs()).exp();
                // in steps of equal ratio, as a ring of a lens turns
                lens.focal_distance *= (wanted / lens.focal_distance).powf(share);
            }
            // the app has set one itself
            Some(_) => {}
            None => {
                let lens = DepthOfField {
                    mode: DepthOfFieldMode::Bokeh,
                    focal_distance: wanted,
                    aperture_f_stops: APERTURE,
                    max_circle_of_confusion_diameter: WIDEST,
                    max_depth: FARTHEST,
                    ..default()
                };
                commands.entity(entity).insert((lens, Lens));
            }
        }
    }
}

/// Distance of the nearest character near the middle of the picture, along the axis of the camera, m.
fn distance(camera: &Transform, characters: impl Iterator<Item = Vec3>) -> Option<f32> {
    let seen = characters.filter_map(|position| {
        let way = position - camera.translation;
        let ahead = way.dot(*camera.forward());
        let aside = way - ahead * *camera.forward();
        (ahead > NEAREST && aside.length() < MIDDLE * ahead).then_some(ahead)
    });
    seen.min_by(f32::total_cmp)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_character_in_the_middle_is_in_focus() {
        let camera = Transform::from_xyz(0.0, 1.0, 5.0).looking_at(Vec3::Y, Vec3::Y);
        let at = |places: &[Vec3]| distance(&camera, places.iter().copied());
        assert!((at(&[Vec3::new(0.2, 1.0, 0.0), Vec3::new(0.0, 1.0, -4.0)]).expect("one") - 5.0).abs() < 1e-5);
        // beside the middle, and behind the camera
        assert_eq!(at(&[Vec3::new(4.0, 1.0, 0.0), Vec3::new(0.0, 1.0, 7.0)]), None);
    }
}

//! Meters beside the track of the ragdoll that a camera follows: a line across the ground and a number that stands there.

use crate::look::FollowCamera;
use crate::ragdoll::Anatomy;
use crate::track::Track;
use bevy::asset::RenderAssetUsages;
use bevy::light::NotShadowCaster;
use bevy::mesh::{Indices, PrimitiveTopology};
use bevy::prelude::*;

/// Distance between two numbers, m.
const EVERY: i32 = 2;
/// Numbers on each side of the camera's focus.
const AROUND: i32 = 9;
/// Height of a digit, m, its width, and that of its strokes.
const DIGIT: [f32; 3] = [0.22, 0.12, 0.028];
/// Distance between two digits, m.
const ADVANCE: f32 = 0.17;
/// Where the numbers are beside the track, m: beyond the runner as the camera at its side sees it.
const ASIDE: f32 = -1.0;
/// Length and width of the line, m.
const LINE: [f32; 2] = [2.0, 0.04];
/// Height above the ground, m: over its checker, under every foot.
const ABOVE: f32 = 0.004;

/// Strokes of a seven-segment digit that are lit, from the lowest bit: top, both upper ones from the left, middle, both
/// lower ones from the left, bottom.
const SEGMENTS: [u8; 10] = [0x77, 0x24, 0x5d, 0x6d, 0x2e, 0x6b, 0x7b, 0x25, 0x7f, 0x6f];

/// A line on the ground, or a number that stands at its end and faces the camera.
#[derive(Component)]
pub(crate) struct Meter {
    meters: i32,
    stands: bool,
}

/// Mesh of a line across the track.
fn line() -> Mesh {
    Plane3d::default().mesh().size(LINE[1], LINE[0]).build()
}

/// Mesh of a number that stands upright and looks along `z`.
fn number(meters: i32) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let mut rect = |x: [f32; 2], y: [f32; 2]| {
        let first = positions.len() as u32;
        positions.extend([[x[0], y[0], 0.0], [x[1], y[0], 0.0], [x[1], y[1], 0.0], [x[0], y[1], 0.0]]);
        triangles.extend([0, 1, 2, 0, 2, 3].map(|i| first + i));
    };
    let [height, width, stroke] = DIGIT;
    let text = meters.to_string();
    let left = -0.5 * (ADVANCE * (text.len() - 1) as f32 + width);
    for (place, digit) in text.chars().enumerate() {
        let x = left + ADVANCE * place as f32;
        let lit = match digit.to_digit(10) {
            Some(digit) => SEGMENTS[digit as usize],
            // a minus is a zero's missing stroke
            None => 0x08,
        };
        let half = 0.5 * height;
        let across = |y: f32| ([x, x + width], [y, y + stroke]);
        let up = |right: bool, y: f32| {
            let x = if right { x + width - stroke } else { x };
            ([x, x + stroke], [y, y + half + 0.5 * stroke])
        };
        let (top, middle, bottom) = (height - stroke, half - 0.5 * stroke, 0.0);
        let strokes = [
            across(top),
            up(false, middle),
            up(true, middle),
            across(middle),
            up(false, bottom),
            up(true, bottom),
            across(bottom),
        ];
        for (bit, (x, y)) in strokes.into_iter().enumerate() {
            if lit >> bit & 1 == 1 {
                rect(x, y);
            }
        }
    }
    let normals = vec![[0.0, 0.0, 1.0]; positions.len()];
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_indices(Indices::U32(triangles))
}

/// Keeps numbers about the place that the camera looks at.
pub(crate) fn paint(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut paint: Local<Option<Handle<StandardMaterial>>>,
    cameras: Query<&FollowCamera>,
    tracks: Query<(&Track, &Anatomy)>,
    mut meters: Query<(Entity, &Meter, &mut Transform), Without<Anatomy>>,
) {
    let target = cameras.iter().next().and_then(|c| Some((c, tracks.get(c.target?).ok()?)));
    // numbers lie on level ground alone
    let target = target.filter(|(_, (_, anatomy))| anatomy.model.hfields.is_empty());
    let Some((camera, (track, _))) = target else {
        meters.iter().for_each(|(entity, ..)| commands.entity(entity).despawn());
        return;
    };
    let track = track.place();
    let here = track.compute_affine().inverse().transform_point3(camera.focus).x;
    let nearest = (here / EVERY as f32).round() as i32;
    let wanted = (nearest - AROUND)..=(nearest + AROUND);
    let place = |meter: &Meter| {
        let aside = if meter.stands { ASIDE } else { ASIDE + 0.5 * LINE[0] };
        let at = track.transform_point(Vec3::new(meter.meters as f32, 0.0, aside));
        let turn = if meter.stands { Quat::from_rotation_y(camera.yaw) } else { track.rotation };
        Transform::from_translation(at + Vec3::Y * ABOVE).with_rotation(turn)
    };
    let mut there = Vec::new();
    for (entity, meter, mut transform) in &mut meters {
        let number = meter.meters / EVERY;
        if !wanted.contains(&number) {
            commands.entity(entity).despawn();
            continue;
        }
        there.push(number);
        // the focus may have gone to another track, the camera may have turned
        let place = place(meter);
        if *transform != place {
            *transform = place;
        }
    }
    let make = || StandardMaterial {
        base_color: Color::srgb(0.93, 0.95, 0.97),
        unlit: true,
        // in front of the ground, which is nearly in the same plane
        depth_bias: 200.0,
        ..default()
    };
    let paint = paint.get_or_insert_with(|| materials.add(make()));
    for meters in wanted.filter(|number| !there.contains(number)).map(|number| number * EVERY) {
        for stands in [false, true] {
            let mesh = meshes.add(if stands { number(meters) } else { line() });
            let meter = Meter { meters, stands };
            let skin = (Mesh3d(mesh), MeshMaterial3d(paint.clone()), place(&meter));
            commands.spawn((Name::new("meters"), meter, skin, NotShadowCaster));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_made_of_their_strokes() {
        for (meters, strokes) in [(0, 6), (1, 2), (8, 7), (-5, 1 + 5), (10, 2 + 6)] {
            assert_eq!(number(meters).count_vertices(), 4 * strokes, "{meters}");
        }
    }
}

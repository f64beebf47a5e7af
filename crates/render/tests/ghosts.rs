//! A ghost is the character at another `qpos`: pale, without a shadow, and equally translucent where its parts overlap.

use marathon_physics::Model;
use marathon_render::{Antialias, Camera, GhostPlace, Image, Renderer, Scene};

const SIDE: usize = 120;

fn scene(geoms: &str) -> Scene {
    let text = format!(
        "<mujoco><worldbody><geom type='plane' size='0 0 1'/>\
         <body pos='0 0 1'><freejoint/>{geoms}</body></worldbody></mujoco>"
    );
    Scene::new(&Model::from_xml_str(&text, "ball").unwrap())
}

/// A ball at the origin, 1 m high, and its ghost at the given position, if any.
fn picture(geoms: &str, ghost: Option<[f64; 3]>, place: GhostPlace) -> Image {
    let pose = |[x, y, z]: [f64; 3]| vec![x, y, z, 1.0, 0.0, 0.0, 0.0];
    let ghosts: Vec<Vec<f64>> = ghost.map(pose).into_iter().collect();
    let frame = scene(geoms).frame_with_ghosts(&[pose([0.0, 0.0, 1.0])], &ghosts, place).unwrap();
    assert_eq!(frame.agents().len(), 1, "a camera follows the agent alone");
    let mut renderer = Renderer::new(SIDE, SIDE).unwrap();
    renderer.antialias = Antialias::Off;
    renderer.render(&frame, &Camera { eye: [0.0, -8.0, 4.0], target: [0.0, 0.0, 1.0], fovy: 40.0 })
}

/// Columns, rows and number of the pixels in which two pictures differ.
fn differences(a: &Image, b: &Image) -> ([usize; 2], [usize; 2], usize) {
    let pairs = a.rgb().chunks(3).zip(b.rgb().chunks(3)).enumerate();
    let spots: Vec<[usize; 2]> = pairs.filter(|(_, (a, b))| a != b).map(|(i, _)| [i % SIDE, i / SIDE]).collect();
    let ends = |k: usize| {
        let values = spots.iter().map(|spot| spot[k]);
        [values.clone().min().unwrap_or(0), values.max().unwrap_or(0)]
    };
    (ends(0), ends(1), spots.len())
}

const BALL: &str = "<geom size='.3'/>";

#[test]
fn a_ghost_is_a_disk_without_a_shadow() {
    let alone = picture(BALL, None, GhostPlace::Inside);
    let with = picture(BALL, Some([1.2, 0.0, 1.6]), GhostPlace::Inside);
    let ([left, right], [top, bottom], count) = differences(&alone, &with);
    let (width, height) = (right - left + 1, bottom - top + 1);
    // a shadow would lie far below
    assert!(width.abs_diff(height) <= 2 && width > 8, "{width} x {height}");
    let disk = std::f64::consts::FRAC_PI_4 * (width * height) as f64;
    assert!((count as f64 / disk - 1.0).abs() < 0.1, "{count} pixels of {disk}");
}

#[test]
fn parts_within_parts_do_not_thicken_it() {
    let two = "<geom size='.3'/><geom size='.28'/>";
    let [one, nested] = [BALL, two].map(|geoms| picture(geoms, Some([2.0, 0.0, 1.6]), GhostPlace::Inside));
    let alone = picture(BALL, None, GhostPlace::Inside);
    let pixels = alone.rgb().chunks(3).zip(one.rgb().chunks(3)).zip(nested.rgb().chunks(3));
    let ghost: Vec<_> = pixels.filter(|((alone, one), _)| alone != one).collect();
    assert!(ghost.len() > 50, "it is seen in {} pixels", ghost.len());
    assert!(ghost.iter().all(|((_, one), nested)| one == nested));
}

#[test]
fn a_figure_on_its_clip_hides_its_ghost() {
    let at = Some([0.0, 0.0, 1.0]);
    let alone = picture(BALL, None, GhostPlace::Inside);
    assert_eq!(differences(&alone, &picture(BALL, at, GhostPlace::Inside)).2, 0);
    // in the lane behind, which is higher in the picture, it is visible
    let (_, [top, bottom], count) = differences(&alone, &picture(BALL, at, GhostPlace::Beside));
    assert!(count > 20 && top < bottom && bottom < SIDE / 2, "rows {top} to {bottom}, {count} pixels");
}

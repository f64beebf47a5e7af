//! Every model of the repository gets a skin that is closed, has few triangles, normals that point outward, and weights that
//! sum to one. The same model gives the same bytes.

use crate::common::models;
use glam::DVec3;
use marathon_skin::{MAX_TRIANGLES, Options, Skin, skin};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// The skins of all models, made once.
fn skins() -> &'static [(String, Skin)] {
    static SKINS: LazyLock<Vec<(String, Skin)>> = LazyLock::new(|| {
        let make = |(name, model)| {
            let skin = skin(&model, &Options::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
            (name, skin)
        };
        models().into_iter().map(make).collect()
    });
    &SKINS
}

fn vector(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(f64::from))
}

#[test]
fn surfaces_are_closed_and_small() {
    for (name, skin) in skins() {
        let count = skin.triangles.len();
        assert!((3000..=Options::default().triangles).contains(&count), "{name}: {count} triangles");
        let mut edges: BTreeMap<(u16, u16), usize> = BTreeMap::new();
        for [a, b, c] in &skin.triangles {
            for edge in [(*a, *b), (*b, *c), (*c, *a)] {
                *edges.entry(edge).or_default() += 1;
            }
        }
        for ((a, b), times) in &edges {
            assert!(*times == 1 && edges.get(&(*b, *a)) == Some(&1), "{name}: edge {a} {b}");
        }
        let used: BTreeSet<u16> = skin.triangles.iter().flatten().copied().collect();
        assert_eq!(used.len(), skin.positions.len(), "{name}: every vertex is used");
    }
}

#[test]
fn the_largest_skin_stays_below_the_limit() {
    for (name, model) in models() {
        let skin = skin(&model, &Options { triangles: MAX_TRIANGLES }).expect("a skin");
        assert!((5000..MAX_TRIANGLES).contains(&skin.triangles.len()), "{name}: {}", skin.triangles.len());
    }
}

#[test]
fn normals_are_unit_vectors_that_point_outward() {
    for (name, skin) in skins() {
        let mut volume = 0.0;
        let (mut against, mut area) = (0.0, 0.0);
        for triangle in &skin.triangles {
            let [a, b, c] = triangle.map(|i| vector(skin.positions[usize::from(i)]));
            let face = (b - a).cross(c - a);
            volume += a.dot(face) / 6.0;
            area += face.length();
            for i in triangle {
                let normal = vector(skin.normals[usize::from(*i)]);
                against += if normal.dot(face) < 0.0 { face.length() / 3.0 } else { 0.0 };
            }
        }
        assert!(volume > 0.0, "{name}: the surface is inside out");
        assert!(against < 2e-3 * area, "{name}: {against} of {area} m2 have normals that point inward");
        let unit = skin.normals.iter().all(|normal| (vector(*normal).length() - 1.0).abs() < 1e-5);
        assert!(unit, "{name}: normals are unit vectors");
    }
}

#[test]
fn weights_sum_to_one_and_name_joints() {
    for (name, skin) in skins() {
        let mut used = vec![false; skin.skeleton.len()];
        for (joints, weights) in skin.joints.iter().zip(&skin.weights) {
            assert_eq!(weights.iter().map(|w| u32::from(*w)).sum::<u32>(), 255, "{name}");
            for (joint, weight) in joints.iter().zip(weights) {
                used[usize::from(*joint)] |= *weight > 0;
                assert!(*weight > 0 || *joint == 0, "{name}: a joint without weight is 0");
            }
        }
        // several joints move something, unless the character is one body
        let moving = used.iter().filter(|used| **used).count();
        assert!(2 * moving > skin.skeleton.len(), "{name}: {moving} of {} joints", skin.skeleton.len());
    }
}

#[test]
fn the_same_model_gives_the_same_bytes() {
    for ((name, first), (_, model)) in skins().iter().zip(models()) {
        let again = skin(&model, &Options::default()).expect("a skin");
        assert!(again.to_glb() == first.to_glb(), "{name}");
    }
}

/// Both sides of a symmetric character look alike.
#[test]
fn left_and_right_are_mirror_images() {
    let (_, skin) = skins().iter().find(|(name, _)| name.ends_with("marathon_man.xml")).expect("the model");
    let left: f64 = skin.positions.iter().map(|p| f64::from(p[0]).max(0.0)).sum();
    let right: f64 = skin.positions.iter().map(|p| f64::from(-p[0]).max(0.0)).sum();
    assert!((left / right - 1.0).abs() < 0.01, "{left} {right}");
    let most = |sign: f32| skin.positions.iter().map(|p| sign * p[0]).fold(0.0, f32::max);
    assert!((most(1.0) - most(-1.0)).abs() < 2e-3);
}

//! A small scene with every shape looks as it did when a person last checked it.
//!
//! After a wanted change: `MARATHON_UPDATE_GOLDEN=1 cargo test -p marathon-render golden::`, then look at
//! `tests/golden/shapes.png` before committing it.

use crate::common;
use marathon_render::{Antialias, Camera, Corner, Renderer, Scene};

const WIDTH: usize = 240;
const HEIGHT: usize = 150;

#[test]
fn every_shape_looks_as_before() {
    let (frame, camera) = common::shapes();
    let mut image = Renderer::new(WIDTH, HEIGHT).unwrap().render(&frame, &camera);
    image.caption(Corner::TopLeft, &["0.5 m/s"]);

    let path = common::file("golden/shapes.png");
    if std::env::var_os("MARATHON_UPDATE_GOLDEN").is_some() {
        image.save_png(&path).unwrap();
    }
    let (width, height, golden) = common::read_png(&path);
    assert_eq!([width, height], [WIDTH, HEIGHT]);

    // a different compiler may round the last bit of a shade; a moved edge or a lost shadow is more than that
    let gaps: Vec<u8> = image.rgb().iter().zip(&golden).map(|(a, b)| a.abs_diff(*b)).collect();
    let mean = gaps.iter().map(|&gap| f64::from(gap)).sum::<f64>() / gaps.len() as f64;
    let far = gaps.iter().filter(|&&gap| gap > 6).count();
    if mean > 0.1 || far > gaps.len() / 500 {
        let seen = std::env::temp_dir().join("marathon-render-golden-seen.png");
        image.save_png(&seen).unwrap();
        panic!("mean difference {mean:.3}, {far} values off by more than 6; see {}", seen.display());
    }
}

#[test]
fn bytes_do_not_depend_on_threads() {
    let (frame, camera) = common::shapes();
    let mut renderer = Renderer::new(97, 61).unwrap();
    for antialias in [Antialias::Off, Antialias::Adaptive, Antialias::Grid(2)] {
        renderer.antialias = antialias;
        renderer.threads = 1;
        let alone = renderer.render(&frame, &camera);
        for threads in [2, 3, 16] {
            renderer.threads = threads;
            assert_eq!(renderer.render(&frame, &camera), alone, "{antialias:?}, {threads} threads");
        }
    }
}

#[test]
fn adaptive_antialiasing_is_close_to_brute_force() {
    let (frame, camera) = common::shapes();
    let mut renderer = Renderer::new(160, 100).unwrap();
    let picture = |renderer: &Renderer| renderer.render(&frame, &camera);
    let adaptive = picture(&renderer);
    renderer.antialias = Antialias::Grid(4);
    let full = picture(&renderer);
    renderer.antialias = Antialias::Off;
    let rough = picture(&renderer);

    let error = |image: &marathon_render::Image| {
        let gaps = image.rgb().iter().zip(full.rgb()).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        gaps.sum::<f64>() / full.rgb().len() as f64
    };
    // the rest is the floor: its paint is filtered once per ray, not once per pixel
    assert!(error(&adaptive) < 0.15 * error(&rough), "{} against {}", error(&adaptive), error(&rough));
}

#[test]
fn what_the_model_hides_is_not_drawn() {
    let model = common::model("shapes.xml");
    let mut bare = model.clone();
    // the alpha-0 box and the group-3 hull enclose everything: if they were drawn, the picture would change
    bare.geoms.retain(|geom| geom.name != "invisible" && geom.name != "hull");
    let camera = Camera { eye: [0.9, -6.4, 2.5], target: [0.25, 0.0, 0.42], fovy: 38.0 };
    let renderer = Renderer::new(64, 40).unwrap();
    let picture = |model| renderer.render(&Scene::new(model).frame(&[&model.qpos0]).unwrap(), &camera);
    assert_eq!(picture(&model), picture(&bare));
}

#[test]
fn culling_loses_nothing() {
    // the same solids seen by cameras that are near, inside, behind and above: tiles must agree with a picture in
    // which one tile covers all, which a tiny image has
    let (frame, _) = common::shapes();
    for eye in [[0.2, -0.9, 0.7], [-0.9, 0.01, 0.61], [0.3, 3.0, 4.0], [0.2, 0.1, 6.0], [2.0, -0.4, 0.2]] {
        let camera = Camera { eye, target: [0.2, 0.0, 0.5], fovy: 70.0 };
        let mut renderer = Renderer::new(176, 176).unwrap();
        renderer.antialias = Antialias::Off;
        let large = renderer.render(&frame, &camera);
        let mut renderer = Renderer::new(16, 16).unwrap();
        renderer.antialias = Antialias::Off;
        let small = renderer.render(&frame, &camera);
        // pixel centers of the small picture are centers of the large one's 11-pixel blocks
        let mut far = 0;
        for (x, y) in (0..16).flat_map(|x| (0..16).map(move |y| (x, y))) {
            let (a, b) = (small.pixel(x, y), large.pixel(11 * x + 5, 11 * y + 5));
            // the floor's paint is filtered over different footprints, so only solids must agree: they are colorful
            let colorful = |p: [u8; 3]| p.iter().max().unwrap() - p.iter().min().unwrap() > 70;
            far += usize::from(colorful(a) != colorful(b));
        }
        assert!(far <= 2, "from {eye:?}: {far} of 256 pixels differ");
    }
}

//! Scratch.
use marathon_motion::*;
use marathon_render::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let model = marathon_physics::Model::from_xml_file(&a[1]).unwrap();
    let p = std::path::Path::new(&a[2]);
    let clip = Clip::parse(p, &std::fs::read(p).unwrap()).unwrap();
    let n: usize = a[4].parse().unwrap();
    let (w, h) = (230, 300);
    let scene = Scene::new(&model);
    let renderer = Renderer::new(w, h).unwrap();
    let mut camera = Follow::new(&scene, 1, w, h);
    let mut rec = Recorder::create(&a[3], 25.0, n.min(8)).unwrap();
    let mut q = vec![0.0; model.nq];
    let end = clip.duration() * a.get(5).map_or(1.0, |x| x.parse::<f64>().unwrap());
    for i in 0..n {
        let t = end * i as f64 / (n - 1) as f64;
        clip.qpos(t, &mut q);
        let frame = scene.frame(&[&q]).unwrap();
        let mut image = renderer.render(&frame, &camera.update(&frame, 1.0));
        image.caption(Corner::TopLeft, &[format!("{t:.2} s")]);
        rec.push(&image).unwrap();
    }
    rec.finish().unwrap();
}

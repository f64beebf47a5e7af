//! Scratch.
use marathon_motion::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let (src, model, map, out) = (&a[1], &a[2], &a[3], &a[4]);
    let model = marathon_physics::Model::from_xml_file(model).unwrap();
    let p = std::path::Path::new(src);
    let mut an = import::deepmimic(p, &std::fs::read(p).unwrap()).unwrap();
    if an.wraps() && a.get(5).is_none() { an = an.looped(); }
    an = an.with_clip(an.clip().resample(p, 1.0 / 60.0).unwrap());
    let _ = map;
    let m = Mapping::built_in(p, an.skeleton(), &model).unwrap_or_else(|e| panic!("{e}"));
    let t = std::time::Instant::now();
    let clip = retarget(p, &an, &model, &m).unwrap();
    let about = About {
        source: "DeepMimic (Peng et al., 2018), from pybullet 3.2.7; retargeted by Marathon".into(),
        license: "Zlib".into(),
        name: std::path::Path::new(out).file_stem().unwrap().to_string_lossy().into(),
        ..clip.about().clone()
    };
    let clip = clip.with_about(about);
    eprintln!("{} frames in {:.2} s, cycle {:?}", clip.frames(), t.elapsed().as_secs_f64(), clip.cycle());
    let clip = clip.rounded();
    let r = check(p, &clip, &model, m.soles()).unwrap();
    eprintln!("    slide {:.1} cm {} f{} speed {:.3} m/s standing {:.2} jump {:.1} {:?}", 100.0*r.slide.value, r.slide.name, r.slide.frame, r.slide_speed, r.standing, r.jump.value, r.warnings());
    std::fs::write(out, clip.rounded().to_bytes()).unwrap();
}

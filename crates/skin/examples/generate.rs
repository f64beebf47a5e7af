//! Writes the skin of an MJCF model: `cargo run --release -p marathon-skin --example generate -- model.xml skin.glb`

use marathon_physics::Model;
use marathon_skin::{Options, skin};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().collect();
    let [_, model, out] = &words[..] else { return Err("expected a model and a file to write".into()) };
    let model = Model::from_xml_file(model)?;
    let start = Instant::now();
    let skin = skin(&model, &Options::default())?;
    let bytes = skin.to_glb();
    let seconds = start.elapsed().as_secs_f64();
    std::fs::write(out, &bytes)?;
    let (joints, triangles) = (skin.skeleton.len(), skin.triangles.len());
    println!(
        "{out}: {joints} joints, {triangles} triangles, cells of {:.1} mm, {} bytes, {seconds:.2} s",
        1e3 * skin.cell,
        bytes.len()
    );
    Ok(())
}

//! Helpers shared by the tests.

use std::path::{Path, PathBuf};

use marathon_physics::Model;
use marathon_render::{Camera, Frame, Scene};

/// A file under this crate's `tests` folder.
pub fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(name)
}

/// A model under `tests/models`.
pub fn model(name: &str) -> Model {
    Model::from_xml_file(file("models").join(name)).expect("the test model loads")
}

/// The scene with every shape and a camera that sees all of it.
pub fn shapes() -> (Frame, Camera) {
    let model = model("shapes.xml");
    let frame = Scene::new(&model).frame(&[&model.qpos0]).expect("the reference pose is valid");
    (frame, Camera { eye: [0.9, -3.4, 1.5], target: [0.25, 0.0, 0.42], fovy: 38.0 })
}

/// An empty folder for one test, removed at the end.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("marathon-render-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).expect("the temporary folder can be made");
        Self(path)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Names of the files in it.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(&self.0).expect("the folder exists");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Width, height and RGB bytes of a PNG file.
pub fn read_png(path: &Path) -> (usize, usize, Vec<u8>) {
    let file = std::fs::File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("a PNG file");
    let mut rgb = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut rgb).expect("a whole picture");
    assert_eq!(info.color_type, png::ColorType::Rgb);
    (info.width as usize, info.height as usize, rgb)
}

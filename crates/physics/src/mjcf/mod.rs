//! MJCF: reads a model file and compiles it as MuJoCo 4.0 does.
//!
//! ```no_run
//! let model = marathon_physics::Model::from_xml_file("hopper.xml")?;
//! println!("{} has {} degrees of freedom", model.name, model.nv);
//! # Ok::<(), marathon_physics::mjcf::MjcfError>(())
//! ```
//!
//! The way of a file: `document` parses the XML and expands includes, `schema` refuses what is misspelled or not
//! supported, `defaults` lays classes under elements, `tree` reads the bodies, `inertia` gives them mass,
//! `asset`, `tendon`, `equality`, `actuator`, `sensor` and `custom` read the rest, `assemble` puts the [`Model`] together,
//! `mass_matrix` (with `factor`) and `statistics` compute what follows from the reference configuration. `room` counts the memory
//! that all of them ask for.
//!
//! What changes the dynamics and is not supported is an error with file and line, never skipped.

mod actuator;
mod actuator_params;
mod assemble;
mod asset;
mod contact;
mod custom;
mod defaults;
mod document;
mod equality;
mod error;
mod factor;
mod geom;
mod inertia;
mod joint;
mod limit;
mod mass_matrix;
mod math;
mod names;
mod orientation;
mod room;
mod schema;
mod sensor;
mod settings;
mod solver_params;
mod statistics;
mod tendon;
mod tree;
mod value;

pub use error::{MjcfError, MjcfErrorKind};

use crate::budget::{self, MODEL_FILE};
use crate::model::Model;
use room::Room;
use std::path::{Path, PathBuf};

impl Model {
    /// Reads and compiles a model file.
    ///
    /// Included files are looked up relative to this file, then relative to the file that includes them.
    ///
    /// # Errors
    ///
    /// The file or an included one cannot be read, is not a valid, supported model, or asks for more than the
    /// [budget] allows.
    pub fn from_xml_file(path: impl AsRef<Path>) -> Result<Model, MjcfError> {
        let path = path.as_ref();
        let shown = path.display().to_string();
        let text = read(path).and_then(utf8).map_err(|reason| MjcfError {
            file: shown.clone(),
            line: 0,
            kind: MjcfErrorKind::Read(reason),
        })?;
        let dir: PathBuf = path.parent().map(Path::to_owned).unwrap_or_default();
        Self::from_xml_str_with(&text, &shown, &|file| read(&dir.join(file)))
    }

    /// Compiles a model given as text, without other files. `name` stands for the file in messages.
    ///
    /// # Errors
    ///
    /// The text is not a valid, supported model.
    pub fn from_xml_str(xml: &str, name: &str) -> Result<Model, MjcfError> {
        Self::from_xml_str_with(xml, name, &|_| Err("a model given as text has no other files".to_owned()))
    }

    /// Compiles a model given as text. `resolve` returns the content of an included file or a height field, given its
    /// path relative to the model, or why there is none.
    ///
    /// # Errors
    ///
    /// The text or another file is not a valid, supported model.
    pub fn from_xml_str_with(
        xml: &str,
        name: &str,
        resolve: &dyn Fn(&str) -> Result<Vec<u8>, String>,
    ) -> Result<Model, MjcfError> {
        let room = Room::default();
        let root = document::parse(xml, name, &|file| utf8(resolve(file)?), &room)?;
        assemble::compile(&root, resolve, &room)
    }
}

/// The bytes of a file within the budget.
fn read(path: &Path) -> Result<Vec<u8>, String> {
    budget::read(path, &MODEL_FILE).map_err(|e| e.to_string())
}

fn utf8(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|e| format!("the file is not UTF-8 text: {e}"))
}

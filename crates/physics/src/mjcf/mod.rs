//! MJCF: reads a model file and compiles it as MuJoCo 4.0 does.
//!
//! ```no_run
//! let model = marathon_physics::Model::from_xml_file("hopper.xml")?;
//! println!("{} has {} degrees of freedom", model.name, model.nv);
//! # Ok::<(), marathon_physics::mjcf::MjcfError>(())
//! ```
//!
//! The way of a file: `document` parses the XML (with `xml`) and expands includes, `spec` expands copies, `schema` refuses what is
//! misspelled or not supported, `settings` reads the options and fills `compiler`, `defaults` lays classes under elements, `tree`
//! reads the bodies, `inertia` gives them mass, `asset` (with `mesh`), `tendon` (with `tendon_path`), `equality`, `actuator` (with
//! `transmission` and `muscle`), `sensor` and `custom` read the rest, `assemble` puts the [`Model`] together, `mass_matrix` (with
//! `pose` and `factor`) and `statistics` compute what follows from the reference configuration. `room` counts the memory that all
//! of them ask for. [`spec`] edits the document before it is compiled.
//!
//! An unsupported element or attribute that changes the dynamics is an error with file and line; it is never skipped.

mod actuator;
mod actuator_params;
mod assemble;
mod asset;
mod compiler;
mod contact;
mod custom;
mod defaults;
mod document;
mod equality;
mod error;
mod factor;
mod file;
mod fluid;
mod geom;
mod inertia;
mod joint;
mod limit;
mod mass_matrix;
mod math;
mod mesh;
mod muscle;
mod names;
mod orientation;
mod pose;
pub(crate) mod reweigh;
mod room;
mod schema;
mod sensor;
mod settings;
mod solver_params;
pub mod spec;
mod statistics;
mod tendon;
mod tendon_path;
mod transmission;
mod tree;
mod value;
mod xml;

pub use error::{MjcfError, MjcfErrorKind};

use crate::model::Model;
use spec::ModelSpec;
use std::path::Path;

impl Model {
    /// Reads and compiles a model file.
    ///
    /// Included files are looked up relative to this file, then relative to the file that includes them.
    ///
    /// # Errors
    ///
    /// The file or an included one cannot be read, is not a valid, supported model, or asks for more than the
    /// [budget](crate::budget) allows.
    pub fn from_xml_file(path: impl AsRef<Path>) -> Result<Model, MjcfError> {
        ModelSpec::from_xml_file(path)?.compile()
    }

    /// Compiles a model given as text, without other files. `name` stands for the file in messages.
    ///
    /// # Errors
    ///
    /// The text is not a valid, supported model.
    pub fn from_xml_str(xml: &str, name: &str) -> Result<Model, MjcfError> {
        ModelSpec::from_xml_str(xml, name)?.compile()
    }

    /// Compiles a model given as text. `resolve` returns the content of an included file, a mesh or a height field, given its
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
        ModelSpec::from_xml_str_with(xml, name, resolve)?.compile_with(resolve)
    }
}

fn utf8(bytes: Vec<u8>) -> Result<String, String> {
    String::from_utf8(bytes).map_err(|e| {
        let text = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = 1 + text.iter().filter(|byte| **byte == b'\n').count();
        format!("the file is not UTF-8 text: line {line} has other bytes")
    })
}

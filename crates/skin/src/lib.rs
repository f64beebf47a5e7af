//! Generates a skin for a model: one smooth surface around its geoms, with a joint for each body.
//!
//! ```
//! use marathon_physics::Model;
//! use marathon_skin::{Options, skin};
//!
//! let model = Model::from_xml_str(
//!     "<mujoco model='pendulum'><worldbody><body name='rod'><joint axis='0 1 0'/>
//!        <geom type='capsule' fromto='0 0 0 0 0 -.5' size='.05'/></body></worldbody></mujoco>",
//!     "pendulum.xml",
//! )?;
//! let skin = skin(&model, &Options::default())?;
//! assert_eq!(skin.skeleton[0].name, "rod");
//! let file: Vec<u8> = skin.to_glb();
//! assert!(file.starts_with(b"glTF"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! 1. The character is the tree of the model's first joint, in the reference pose. The geoms that a viewer shows become
//!    solids; gaps between neighbors are filled.
//! 2. The signed distance to all solids has fillets between bodies with at most two joints between them.
//! 3. Surface nets cut the distance field into triangles. Limbs that overlap in the reference pose, such as both legs of a planar
//!    walker, become closed surfaces of their own.
//! 4. A vertex follows the bodies near it, and at most two joints from the nearest one.
//!
//! The bytes depend only on the model and the options.

mod color;
mod error;
mod field;
mod figure;
mod glb;
mod grid;
mod layer;
mod mesh;
mod nets;
mod shape;
mod solid;
mod weights;

pub use error::SkinError;

use field::Field;
use figure::Figure;
use glam::DVec3;
use marathon_physics::Model;
use mesh::Piece;

/// Largest value of [`Options::triangles`].
pub const MAX_TRIANGLES: usize = 20_000;
/// Smallest value of [`Options::triangles`].
pub const MIN_TRIANGLES: usize = 500;

/// Options of [`skin`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Options {
    /// Largest number of triangles, [`MIN_TRIANGLES`] to [`MAX_TRIANGLES`]. The grid is chosen so that the skin has nearly as many.
    pub triangles: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options { triangles: 10_000 }
    }
}

/// A joint of a skin: a body of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name of the body; `body` and its index for a body without a name.
    pub name: String,
    /// Index of the joint that it hangs from, lower than its own.
    pub parent: Option<usize>,
    /// Position at rest, m, y up, facing +z. Joints are not turned at rest.
    pub position: [f32; 3],
}

/// A skinned mesh. Positions are in m, y up, facing +z.
#[derive(Clone, Debug, PartialEq)]
pub struct Skin {
    /// Name of the model.
    pub name: String,
    /// The joints; a parent precedes its children.
    pub skeleton: Vec<Joint>,
    /// Positions of the vertices, m.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, outward.
    pub normals: Vec<[f32; 3]>,
    /// Linear RGB with ambient occlusion, and alpha 255.
    pub colors: Vec<[u8; 4]>,
    /// Indices into [`Skin::skeleton`].
    pub joints: Vec<[u8; 4]>,
    /// Weights of the joints in 255ths; they sum to 255.
    pub weights: Vec<[u8; 4]>,
    /// Indices of the vertices, counterclockwise seen from outside. Every edge has two triangles.
    pub triangles: Vec<[u16; 3]>,
    /// Size of the grid's cells, m: details smaller than this are lost.
    pub cell: f64,
}

impl Skin {
    /// The bytes of a binary glTF 2.0 file (.glb).
    pub fn to_glb(&self) -> Vec<u8> {
        glb::write(self)
    }
}

/// Generates the skin of a model.
///
/// # Errors
/// If the model has no suitable geom, too many bodies, or numbers that are not finite, or if an option is outside its range.
pub fn skin(model: &Model, options: &Options) -> Result<Skin, SkinError> {
    let (min, max) = (MIN_TRIANGLES, MAX_TRIANGLES);
    if !(min..=max).contains(&options.triangles) {
        return Err(SkinError::Triangles { found: options.triangles, min, max });
    }
    let figure = Figure::new(model)?;
    let cell = mesh::cell(&figure, options.triangles);
    let figure = mesh::thick(&figure, cell);
    let solids = solid::solids(&figure);
    let field = Field::new(&figure, &solids);
    let name = if model.name.is_empty() { "skin".into() } else { model.name.clone() };
    let skeleton = figure.bones.iter().map(|bone| Joint {
        name: bone.name.clone(),
        parent: bone.parent,
        position: to_gltf(bone.anchor),
    });
    let mut skin = Skin {
        name,
        skeleton: skeleton.collect(),
        positions: Vec::new(),
        normals: Vec::new(),
        colors: Vec::new(),
        joints: Vec::new(),
        weights: Vec::new(),
        triangles: Vec::new(),
        cell,
    };
    let parts = color::of_parts(&figure);
    for piece in mesh::pieces(&field, cell) {
        skin.add(&field, &parts, &piece);
    }
    Ok(skin)
}

impl Skin {
    /// Adds the surface of a layer.
    fn add(&mut self, field: &Field, parts: &[DVec3], piece: &Piece) {
        let Piece { layer, surface, normals, neighbors } = piece;
        let first = self.positions.len() as u32;
        for influences in weights::influences(field, layer, &surface.points, neighbors, self.cell) {
            self.joints.push(influences.bones);
            self.weights.push(influences.weights);
        }
        let colors = color::of_piece(field, parts, piece, self.cell);
        for ((p, normal), color) in surface.points.iter().zip(normals).zip(colors) {
            let [r, g, b] = color.to_array().map(|c| (255.0 * c + 0.5) as u8);
            self.colors.push([r, g, b, 255]);
            self.positions.push(to_gltf(*p));
            self.normals.push(to_gltf(*normal));
        }
        // at most 20,000 triangles have at most 10,000 vertices more than pieces
        self.triangles.extend(surface.triangles.iter().map(|triangle| triangle.map(|i| (first + i) as u16)));
    }
}

/// From x forward, z up to z forward, y up.
fn to_gltf(v: DVec3) -> [f32; 3] {
    [v.y as f32, v.z as f32, v.x as f32]
}

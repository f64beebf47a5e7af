//! Triangle meshes: their files, their mass properties and their convex hulls.
//!
//! [`read`] reads a file, [`builtin`] makes a shape from parameters, [`moments`] integrates over the faces, [`hull`] finds the
//! convex hull and [`polygons`] merges its coplanar triangles. The rules are MuJoCo 4.0's. Nothing here knows MJCF:
//! errors say what was found and what was expected, and the caller adds the file and the element.

pub(crate) mod builtin;
mod grid;
mod hull;
pub(crate) mod moments;
mod msh;
mod obj;
pub(crate) mod polygons;
mod stl;

#[cfg(test)]
mod tests;

/// Most vertices of a mesh.
pub(crate) const MAX_VERTICES: usize = 1 << 20;
/// Most triangles of a mesh.
pub(crate) const MAX_FACES: usize = 1 << 20;

/// A mesh as a file describes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Triangles {
    /// Points in the file's frame and unit.
    pub vertices: Vec<[f32; 3]>,
    /// Three points of each triangle, counterclockwise from outside. Empty: the convex hull of the points.
    pub faces: Vec<[u32; 3]>,
}

/// A format of mesh files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Binary STL.
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// MuJoCo's binary format.
    Msh,
}

/// Content types and endings of the formats.
const FORMATS: [(Format, &str, &str); 3] = [
    (Format::Stl, "model/stl", ".stl"),
    (Format::Obj, "model/obj", ".obj"),
    (Format::Msh, "model/vnd.mujoco.msh", ".msh"),
];

impl Format {
    /// The format of a content type, or without one that of the file's ending.
    pub fn of(file: &str, content_type: Option<&str>) -> Result<Format, String> {
        let file = file.to_ascii_lowercase();
        let matches = |(_, kind, ending): &&(Format, &str, &str)| match content_type {
            Some(given) => given == *kind,
            None => file.ends_with(ending),
        };
        FORMATS.iter().find(matches).map(|(format, ..)| *format).ok_or_else(|| match content_type {
            Some(given) => {
                format!("found content type '{given}', expected model/stl, model/obj or model/vnd.mujoco.msh")
            }
            None => "expected a file name that ends with .stl, .obj or .msh".to_owned(),
        })
    }
}

/// Reads a mesh file.
///
/// # Errors
/// The place in the file, what is there and what was expected. The result is sound: all points are finite, and all
/// faces have points that exist.
pub(crate) fn read(format: Format, bytes: &[u8]) -> Result<Triangles, String> {
    let mesh = match format {
        Format::Stl => stl::read(bytes),
        Format::Obj => obj::read(bytes),
        Format::Msh => msh::read(bytes),
    }?;
    mesh.check()?;
    Ok(mesh)
}

impl Triangles {
    /// Checks that there are enough points, and that all points are finite and all faces have points that exist.
    pub fn check(&self) -> Result<(), String> {
        let (points, faces) = (self.vertices.len(), self.faces.len());
        if points < 4 {
            return Err(format!("found {points} vertices, expected at least 4"));
        }
        too_many("vertices", points, MAX_VERTICES)?;
        too_many("faces", faces, MAX_FACES)?;
        if let Some(i) = self.vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(format!("vertex {i} is {:?}, expected finite numbers", self.vertices[i]));
        }
        match self.faces.iter().position(|f| f.iter().any(|v| *v as usize >= points)) {
            Some(i) => Err(format!("face {i} is {:?}, but there are only {points} vertices", self.faces[i])),
            None => Ok(()),
        }
    }
}

fn too_many(what: &str, found: usize, most: usize) -> Result<(), String> {
    if found > most { Err(format!("found {found} {what}, expected at most {most}")) } else { Ok(()) }
}

/// The little-endian 32-bit word at a byte.
fn word(bytes: &[u8], at: usize) -> Option<[u8; 4]> {
    bytes.get(at..at + 4)?.try_into().ok()
}

/// The three floats at a byte.
fn point(bytes: &[u8], at: usize) -> Option<[f32; 3]> {
    let number = |i: usize| word(bytes, at + 4 * i).map(f32::from_le_bytes);
    Some([number(0)?, number(1)?, number(2)?])
}

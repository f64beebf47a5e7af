//! Binary STL: a header of 80 bytes, the number of triangles, then 50 bytes for each triangle.
//!
//! A triangle has a normal, three corners and two bytes of attributes. Normals and attributes are ignored. Corners with the same
//! bits are one vertex.

use super::{Triangles, point, word};
use std::collections::HashMap;
use std::collections::hash_map::Entry;

const HEADER: usize = 84;
const TRIANGLE: usize = 50;
/// Most triangles of a file, as in MuJoCo.
const MAX_TRIANGLES: usize = 200_000;
/// Largest coordinate, as in MuJoCo.
const LARGEST: f32 = (1u32 << 30) as f32;

pub(super) fn read(bytes: &[u8]) -> Result<Triangles, String> {
    let text =
        if bytes.starts_with(b"solid") { "; text STL is not supported, save the mesh as binary STL" } else { "" };
    let count = word(bytes, 80).map(u32::from_le_bytes);
    let Some(count) = count else {
        return Err(format!("found {} bytes, expected a binary STL header of {HEADER}{text}", bytes.len()));
    };
    let triangles = usize::try_from(count).ok().filter(|n| (1..=MAX_TRIANGLES).contains(n));
    let Some(triangles) = triangles else {
        return Err(format!("byte 80: found {count} triangles, expected 1 to {MAX_TRIANGLES}{text}"));
    };
    let expected = HEADER + TRIANGLE * triangles;
    if bytes.len() != expected {
        return Err(format!("found {} bytes, expected {expected} for {triangles} triangles{text}", bytes.len()));
    }
    let mut mesh = Triangles::default();
    let mut known: HashMap<[u32; 3], u32> = HashMap::new();
    for at in (HEADER..expected).step_by(TRIANGLE) {
        let mut face = [0; 3];
        for (corner, index) in face.iter_mut().enumerate() {
            let at = at + 12 * (corner + 1);
            let vertex = point(bytes, at).ok_or_else(|| format!("the file ends at byte {at}"))?;
            if !vertex.iter().all(|x| x.abs() <= LARGEST) {
                return Err(format!("byte {at}: found the vertex {vertex:?}, expected finite numbers up to {LARGEST}"));
            }
            *index = match known.entry(vertex.map(f32::to_bits)) {
                Entry::Occupied(entry) => *entry.get(),
                Entry::Vacant(entry) => {
                    mesh.vertices.push(vertex);
                    *entry.insert(mesh.vertices.len() as u32 - 1)
                }
            };
        }
        mesh.faces.push(face);
    }
    Ok(mesh)
}

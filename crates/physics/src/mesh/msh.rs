//! MuJoCo's binary format: the numbers of vertices, normals, texture coordinates and faces, then these as 32-bit floats and
//! integers, all little endian.

use super::{MAX_FACES, MAX_VERTICES, Triangles, point, too_many, word};

const HEADER: usize = 16;

pub(super) fn read(bytes: &[u8]) -> Result<Triangles, String> {
    let mut counts = [0usize; 4];
    for (i, (name, count)) in
        ["vertices", "normals", "texture coordinates", "faces"].iter().zip(&mut counts).enumerate()
    {
        let found = word(bytes, 4 * i).map(i32::from_le_bytes);
        let found = found.ok_or_else(|| format!("found {} bytes, expected a header of {HEADER}", bytes.len()))?;
        *count = usize::try_from(found).map_err(|_| format!("byte {}: found {found} {name}", 4 * i))?;
    }
    let [vertices, normals, coordinates, faces] = counts;
    too_many("vertices", vertices, MAX_VERTICES)?;
    too_many("faces", faces, MAX_FACES)?;
    for (name, count) in [("normals", normals), ("texture coordinates", coordinates)] {
        if count != 0 && count != vertices {
            return Err(format!("found {count} {name}, expected none or {vertices}, one per vertex"));
        }
    }
    let before_faces = HEADER + 12 * vertices + 12 * normals + 8 * coordinates;
    let expected = before_faces + 12 * faces;
    if bytes.len() != expected {
        return Err(format!("found {} bytes, expected {expected} for the numbers in its header", bytes.len()));
    }
    let points = (0..vertices).filter_map(|i| point(bytes, HEADER + 12 * i));
    let mut mesh = Triangles { vertices: points.collect(), faces: Vec::with_capacity(faces) };
    for face in 0..faces {
        let mut corners = [0; 3];
        for (i, corner) in corners.iter_mut().enumerate() {
            let at = before_faces + 12 * face + 4 * i;
            let found = word(bytes, at).map_or(-1, i32::from_le_bytes);
            *corner =
                u32::try_from(found).map_err(|_| format!("byte {at}: found the vertex {found} in face {face}"))?;
        }
        mesh.faces.push(corners);
    }
    Ok(mesh)
}

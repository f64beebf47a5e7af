//! Wavefront OBJ: the vertices of the file and the faces of its first object.
//!
//! The rules are those of the reader in MuJoCo (tinyobjloader 2). Negative indices count from the last vertex. Quads are
//! cut along the shorter diagonal, and larger polygons lose one ear after the other. Materials, normals, texture coordinates,
//! lines and points are ignored.

use super::{MAX_FACES, MAX_VERTICES, Triangles, too_many};

/// Most corners of a face. Cutting off ears takes quadratic time.
const MAX_CORNERS: usize = 1000;

pub(super) fn read(bytes: &[u8]) -> Result<Triangles, String> {
    let mut mesh = Triangles::default();
    let mut faces: Vec<(usize, Vec<u32>)> = Vec::new();
    let mut first_object = true;
    for (i, line) in bytes.split(|b| matches!(b, b'\n' | b'\r')).enumerate() {
        let text = String::from_utf8_lossy(line);
        let mut words = text.split_ascii_whitespace();
        let place = |message: String| format!("line {}: {message}", i + 1);
        match words.next() {
            Some("v") => {
                too_many("vertices", mesh.vertices.len() + 1, MAX_VERTICES)?;
                mesh.vertices.push(vertex(words).map_err(place)?);
            }
            Some("f") if first_object => {
                too_many("faces", faces.len() + 1, MAX_FACES)?;
                let corners = corners(words, mesh.vertices.len()).map_err(place)?;
                if corners.len() > 2 {
                    faces.push((i + 1, corners));
                }
            }
            Some("g" | "o") if !faces.is_empty() => first_object = false,
            _ => {}
        }
    }
    // faces may stand before their vertices
    for (line, corners) in &faces {
        if let Some(missing) = corners.iter().find(|c| **c as usize >= mesh.vertices.len()) {
            let (index, count) = (u64::from(*missing) + 1, mesh.vertices.len());
            return Err(format!("line {line}: found the vertex {index}, but there are only {count}"));
        }
        triangulate(&mesh.vertices, corners, &mut mesh.faces);
        too_many("faces", mesh.faces.len(), MAX_FACES)?;
    }
    Ok(mesh)
}

/// Three numbers; missing ones are 0, further ones are a weight or a color.
fn vertex<'a>(words: impl Iterator<Item = &'a str>) -> Result<[f32; 3], String> {
    let mut vertex = [0.0; 3];
    for (x, word) in vertex.iter_mut().zip(words) {
        let finite = number(word).map(|x| x as f32).filter(|x| x.is_finite());
        *x = finite.ok_or_else(|| format!("found '{}', expected a coordinate", shown(word)))?;
    }
    Ok(vertex)
}

/// The vertices of a face, counted from 0.
fn corners<'a>(words: impl Iterator<Item = &'a str>, vertices: usize) -> Result<Vec<u32>, String> {
    let mut corners = Vec::new();
    for word in words {
        // a comment behind the face
        if word.starts_with('#') {
            break;
        }
        let index: Option<i64> = word.split('/').next().and_then(|index| index.parse().ok());
        let corner = match index {
            Some(i) if i > 0 => Some(i - 1),
            Some(i) if i < 0 => Some(vertices as i64 + i),
            _ => None,
        };
        let corner = corner.and_then(|i| u32::try_from(i).ok());
        corners.push(corner.ok_or_else(|| format!("found '{}', expected the number of a vertex", shown(word)))?);
        too_many("corners of a face", corners.len(), MAX_CORNERS)?;
    }
    Ok(corners)
}

fn shown(word: &str) -> String {
    word.chars().take(20).collect()
}

/// A number in MuJoCo's rounding: digits behind the point are added one by one.
fn number(text: &str) -> Option<f64> {
    const TENTHS: [f64; 8] = [1.0, 0.1, 0.01, 0.001, 0.0001, 0.00001, 0.000001, 0.0000001];
    let (negative, unsigned) = match text.as_bytes() {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        all => (false, all),
    };
    let digits = |bytes: &[u8]| bytes.iter().take_while(|b| b.is_ascii_digit()).count();
    let whole = digits(unsigned);
    let mut mantissa = unsigned[..whole].iter().fold(0.0, |m, b| 10.0 * m + f64::from(b - b'0'));
    let mut rest = &unsigned[whole..];
    let mut fraction = 0;
    if let [b'.', behind @ ..] = rest {
        fraction = digits(behind);
        for (i, b) in behind[..fraction].iter().enumerate() {
            let place = TENTHS.get(i + 1).copied().unwrap_or_else(|| libm::pow(10.0, -(i as f64 + 1.0)));
            mantissa += f64::from(b - b'0') * place;
        }
        rest = &behind[fraction..];
    }
    if whole + fraction == 0 {
        return None;
    }
    if let [b'e' | b'E', exponent @ ..] = rest {
        let exponent: i32 = std::str::from_utf8(exponent).ok()?.parse().ok()?;
        let exponent = exponent.clamp(-400, 400);
        mantissa = libm::scalbn(mantissa * libm::pow(5.0, f64::from(exponent)), exponent);
    } else if !rest.is_empty() {
        return None;
    }
    Some(if negative { -mantissa } else { mantissa })
}

/// Cuts a face into triangles.
fn triangulate(vertices: &[[f32; 3]], corners: &[u32], out: &mut Vec<[u32; 3]>) {
    let at = |corner: u32| vertices[corner as usize];
    match *corners {
        [a, b, c] => out.push([a, b, c]),
        [a, b, c, d] => {
            let square = |p: [f32; 3], q: [f32; 3]| (0..3).map(|k| (q[k] - p[k]) * (q[k] - p[k])).sum::<f32>();
            if square(at(a), at(c)) < square(at(b), at(d)) {
                out.extend([[a, b, c], [a, c, d]]);
            } else {
                out.extend([[a, b, d], [b, c, d]]);
            }
        }
        _ => cut_ears(vertices, corners, out),
    }
}

/// Cuts off a corner whose triangle lies inside the polygon and holds no other corner, until three corners are left.
fn cut_ears(vertices: &[[f32; 3]], corners: &[u32], out: &mut Vec<[u32; 3]>) {
    let [x, y] = plane(vertices, corners);
    let at = |corner: u32| [vertices[corner as usize][x], vertices[corner as usize][y]];
    let next = |i: usize| (i + 1) % corners.len();
    let area: f32 = (0..corners.len())
        .map(|i| (at(corners[i]), at(corners[next(i)])))
        .map(|(p, q)| (p[0] * q[1] - p[1] * q[0]) * 0.5)
        .sum();
    let mut left = corners.to_vec();
    let (mut guess, mut tries) = (0, left.len());
    while left.len() > 3 && tries > 0 {
        let n = left.len();
        guess %= n;
        let ear = [0, 1, 2].map(|k| left[(guess + k) % n]);
        let [p, q, r] = ear.map(at);
        let turn = (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]);
        let holds = |k: usize| inside([p, q, r], at(left[(guess + k) % n]));
        if turn * area < 0.0 || (3..n).any(holds) {
            guess += 1;
            tries -= 1;
            continue;
        }
        out.push(ear);
        left.remove((guess + 1) % n);
        tries = left.len();
    }
    if let [a, b, c] = left[..] {
        out.push([a, b, c]);
    }
}

/// The two axes along which a polygon is seen best.
fn plane(vertices: &[[f32; 3]], corners: &[u32]) -> [usize; 2] {
    let n = corners.len();
    for k in 0..n {
        let [p, q, r] = [0, 1, 2].map(|i| vertices[corners[(k + i) % n] as usize]);
        let (a, b) = ([0, 1, 2].map(|i| q[i] - p[i]), [0, 1, 2].map(|i| r[i] - q[i]));
        let [x, y, z] = [[1, 2], [2, 0], [0, 1]].map(|[i, j]: [usize; 2]| (a[i] * b[j] - a[j] * b[i]).abs());
        if x.max(y).max(z) > f32::EPSILON {
            return match (x > y && x > z, z > x && z > y) {
                (true, _) => [1, 2],
                (_, true) => [0, 1],
                _ => [0, 2],
            };
        }
    }
    [1, 2]
}

/// Whether a point lies in a triangle.
fn inside(triangle: [[f32; 2]; 3], [x, y]: [f32; 2]) -> bool {
    let crosses = |i: usize| {
        let ([ax, ay], [bx, by]) = (triangle[i], triangle[(i + 2) % 3]);
        (ay > y) != (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax
    };
    (0..3).filter(|i| crosses(*i)).count() % 2 == 1
}

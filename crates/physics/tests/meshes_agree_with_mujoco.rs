//! A compiled mesh is MuJoCo's compiled mesh.
//!
//! Random meshes are written to files of every format: globes, prisms, boxes with points on their sides, and clouds. They are
//! turned, scaled and mirrored, with reference frames and with every rule of inertia. Masses, centers, inertias and frames agree to 1e-12, the boxes
//! of geoms to a rounding error. Vertices are the same single precision numbers but for the last bit. Hulls have the same
//! corners and the same polygons.

use crate::common;
use crate::common::compiled::differ;
use crate::common::oracle;
use marathon_physics::Model;
use marathon_physics::mjcf::MjcfErrorKind;
use marathon_physics::model::{Geom, GeomType, Hull};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

const SEED: u32 = 1;
/// Random models; with the variable MARATHON_TEST_LONG, which `tests/long.sh soak` sets, three times as many.
const MODELS: usize = 100;
/// Models of other projects with meshes that load.
const PUBLIC: usize = 25;

fn vectors(v: &Value) -> Vec<[f64; 3]> {
    serde_json::from_value(v.clone()).expect("a list of vectors")
}

/// Largest difference of two vectors' coordinates.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    common::numbers::largest(a.iter().zip(b).map(|(x, y)| (x - y).abs()))
}

/// The corners of a hull in the order of their first coordinates.
struct Corners<'a> {
    hull: &'a Hull,
    order: Vec<u32>,
    within: f64,
}

impl Corners<'_> {
    fn new(hull: &Hull, within: f64) -> Corners<'_> {
        let mut order: Vec<u32> = (0..hull.vertices.len() as u32).collect();
        order.sort_by(|a, b| hull.vertices[*a as usize][0].total_cmp(&hull.vertices[*b as usize][0]));
        Corners { hull, order, within }
    }

    /// Number of the corner at a place.
    fn at(&self, place: &[f64; 3]) -> Option<u32> {
        let vertex = |i: &u32| &self.hull.vertices[*i as usize];
        let first = self.order.partition_point(|i| vertex(i)[0] < place[0] - self.within);
        let near = self.order[first..].iter().take_while(|i| vertex(i)[0] <= place[0] + self.within);
        near.copied().find(|i| apart(vertex(i), place) <= self.within)
    }
}

/// A polygon from its lowest number on.
fn turned(mut polygon: Vec<u32>) -> Vec<u32> {
    let lowest = (0..polygon.len()).min_by_key(|i| polygon[*i]).unwrap_or(0);
    polygon.rotate_left(lowest);
    polygon
}

/// Differences of a hull from MuJoCo's.
fn hull_differs(hull: &Hull, theirs: &Value, size: f64) -> Option<String> {
    let known = Corners::new(hull, 3e-7 * size);
    let corners = vectors(&theirs["corners"]);
    if corners.len() != hull.vertices.len() || corners.iter().any(|c| known.at(c).is_none()) {
        return Some(format!("{} corners, MuJoCo has {}", hull.vertices.len(), corners.len()));
    }
    let places: Vec<Vec<[f64; 3]>> = theirs["polygons"].as_array().expect("a list").iter().map(vectors).collect();
    let numbered = |places: &Vec<[f64; 3]>| {
        let list: Option<Vec<u32>> = places.iter().map(|p| known.at(p)).collect();
        turned(list.expect("a polygon has corners of the hull"))
    };
    let normals = vectors(&theirs["normals"]);
    let theirs: Vec<Vec<u32>> = places.iter().map(numbered).collect();
    // MuJoCo's outlines of mirrored meshes run clockwise
    let reversed = |p: &Vec<u32>| turned(p.iter().rev().copied().collect());
    let own: BTreeMap<Vec<u32>, &[f64; 3]> = hull.polygons.iter().cloned().map(turned).zip(&hull.normals).collect();
    let found: Vec<Option<&&[f64; 3]>> = theirs.iter().map(|p| own.get(p).or_else(|| own.get(&reversed(p)))).collect();
    // on the edge between two cells of the grid of angles rounding decides
    let missing = found.iter().filter(|normal| normal.is_none()).count();
    if missing * 100 > theirs.len() || own.len().abs_diff(theirs.len()) * 100 > theirs.len() {
        return Some(format!("{} polygons, {missing} of MuJoCo's {} are missing", own.len(), theirs.len()));
    }
    let wrong = |(own, theirs): &(&Option<&&[f64; 3]>, &[f64; 3])| own.is_some_and(|own| apart(*own, *theirs) > 1e-6);
    match found.iter().zip(&normals).filter(wrong).count() {
        0 => None,
        n => Some(format!("{n} normals differ")),
    }
}

/// Symmetric matrix of principal moments in a frame, by rows.
fn tensor(moments: &[f64], quat: &[f64]) -> Vec<f64> {
    let [w, x, y, z] = [quat[0], quat[1], quat[2], quat[3]];
    let rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ];
    let entry = |(i, j): (usize, usize)| (0..3).map(|k| rows[i][k] * moments[k] * rows[j][k]).sum();
    (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(entry).collect()
}

/// Differences of a model from MuJoCo's.
fn differences(model: &Model, theirs: &Value) -> Vec<String> {
    let mut out = Vec::new();
    differ("", &serde_json::to_value(model).expect("a model is JSON"), &theirs["model"], &mut out);
    // MuJoCo leaves a ten millionth of the inertia of several geoms off the diagonal
    out.retain(|difference| !difference.contains(".iquat is"));
    // and puts a geom whose frame is very near to its body's frame into that frame
    out.retain(|difference| !difference.contains(".stat.center") && !difference.contains(".stat.extent"));
    let stat = &theirs["model"]["stat"];
    let center: [f64; 3] = vectors(&json!([stat["center"]]))[0];
    let extent = stat["extent"].as_f64().expect("a number");
    if apart(&model.stat.center, &center).max((model.stat.extent - extent).abs()) > 1e-6 * extent {
        out.push(format!(
            "extent {} around {:?}, MuJoCo has {extent} around {center:?}",
            model.stat.extent, model.stat.center
        ));
    }
    for (i, body) in model.bodies.iter().enumerate() {
        let other = &theirs["model"]["bodies"][i];
        let (moments, quat) = (common::numbers::numbers(&other["inertia"]), common::numbers::numbers(&other["iquat"]));
        let (own, their) = (tensor(&body.inertia, &body.iquat), tensor(&moments, &quat));
        let mass = (body.mass - other["mass"].as_f64().expect("a number")).abs() / body.mass.max(1e-300);
        if apart(&own, &their) > 3e-7 * body.inertia[0] || mass > 1e-12 {
            out.push(format!("body {i}: inertia {own:?}, MuJoCo has {their:?}, mass by {mass:e}"));
        }
    }
    for mesh in &model.meshes {
        let other = &theirs["meshes"][&mesh.name];
        if other.is_null() {
            continue;
        }
        let faces: Vec<[u32; 3]> = serde_json::from_value(other["faces"].clone()).expect("faces");
        let places = vectors(&other["vertices"]);
        let size = mesh.vertices.iter().flatten().fold(0.0f32, |m, x| m.max(x.abs()));
        let far = common::numbers::largest(mesh.vertices.iter().zip(&places).map(|(a, b)| apart(&a.map(f64::from), b)));
        if mesh.vertices.len() != places.len() || far > 2e-7 * f64::from(size) {
            out.push(format!("vertices of {} differ by {far:e}", mesh.name));
        }
        // those of the hull of a mesh without faces are in another order, and the triangles of a flat side may be others
        let corners = |f: &[[u32; 3]]| f.iter().flatten().copied().collect::<BTreeSet<u32>>();
        if faces != mesh.faces && (faces.len() != mesh.faces.len() || corners(&faces) != corners(&mesh.faces)) {
            out.push(format!("faces of {} differ", mesh.name));
        }
    }
    for (i, geom) in model.geoms.iter().enumerate() {
        out.extend(geom_differs(model, geom, theirs, i).map(|what| format!("geom {i}: {what}")));
    }
    out
}

fn geom_differs(model: &Model, geom: &Geom, theirs: &Value, i: usize) -> Option<String> {
    let size = geom.size.iter().map(|x| x * x).sum::<f64>().sqrt();
    if geom.mesh.is_some() {
        let bounds = common::numbers::numbers(&theirs["bounds"][i]);
        if (bounds[6] - size).abs() > 1e-11 * size {
            return Some(format!("radius {size}, MuJoCo has {}", bounds[6]));
        }
    }
    if geom.kind != GeomType::Plane {
        let other = &theirs["model"]["geoms"][i];
        let [pos, quat, box_size] = ["pos", "quat", "size"].map(|name| common::numbers::numbers(&other[name]));
        let far = apart(&geom.pos, &pos).max(apart(&geom.quat, &quat)).max(apart(&geom.size, &box_size));
        // rounding adds up over many triangles
        let within = if model.meshes.iter().all(|mesh| mesh.faces.len() < 1000) { 1e-12 } else { 3e-11 };
        if far > within * (1.0 + pos.iter().fold(size, |m, x| m.max(x.abs()))) {
            return Some(format!("frame or size by {far:e}"));
        }
    }
    match (geom.hull, &theirs["hulls"][i]) {
        (None, Value::Null) => None,
        (Some(hull), theirs) if !theirs.is_null() => hull_differs(&model.hulls[hull], theirs, size),
        (hull, theirs) => Some(format!("hull {hull:?}, MuJoCo has {}", !theirs.is_null())),
    }
}

/// Compares models; returns the number of those that both sides load.
fn compare(answer: &Value) -> usize {
    let (mut report, mut loaded) = (Vec::new(), 0);
    for theirs in answer["models"].as_array().expect("a list of models") {
        let path = theirs["path"].as_str().expect("a path");
        match (Model::from_xml_file(path), theirs.get("error")) {
            (Ok(_), Some(error)) => report.push(format!("{path}: MuJoCo refuses it: {error}")),
            (Err(error), None) if matches!(error.kind, MjcfErrorKind::Unsupported { .. }) => {}
            (Err(error), None) => report.push(format!("{path}: MuJoCo loads it, but: {error}")),
            (Err(_), Some(_)) => {}
            (Ok(model), None) => {
                loaded += 1;
                report.extend(differences(&model, theirs).iter().take(4).map(|d| format!("{path}: {d}")));
            }
        }
    }
    assert!(report.is_empty(), "{loaded} models agree but for\n{}", report.join("\n"));
    loaded
}

#[test]
fn random_meshes() {
    let folder = common::scratch("meshes");
    let count = if std::env::var_os("MARATHON_TEST_LONG").is_some() { 3 * MODELS } else { MODELS };
    let answer = oracle("meshes.py", &json!({"folder": folder, "seed": SEED, "count": count}));
    let loaded = compare(&answer);
    assert!(loaded > count / 2, "only {loaded} of {count} models are sound");
    std::fs::remove_dir_all(&folder).expect("the folder is there");
}

/// Writes models with one mesh each, and compares them with MuJoCo's.
fn written(name: &str, meshes: &[&str]) -> (PathBuf, Value) {
    let folder = common::scratch(name);
    let write = |(i, mesh): (usize, &&str)| {
        let path = folder.join(format!("{i}.xml"));
        let geom = "<body><freejoint/><geom type='mesh' mesh='m'/></body>";
        let text = format!("<mujoco><asset><mesh name='m' {mesh}/></asset><worldbody>{geom}</worldbody></mujoco>");
        std::fs::write(&path, text).expect("a file");
        path
    };
    let paths: Vec<PathBuf> = meshes.iter().enumerate().map(write).collect();
    let answer = oracle("meshes.py", &json!({ "paths": paths }));
    (folder, answer)
}

#[test]
fn meshes_from_parameters() {
    let meshes = [
        "builtin='sphere' params='2'",
        "builtin='hemisphere' params='3'",
        "builtin='cone' params='7 0'",
        "builtin='cone' params='6 0.4'",
        "builtin='supersphere' params='8 0.6 1.3'",
        "builtin='supertorus' params='9 0.4 1 0.8' inertia='exact'",
        "builtin='sphere' params='1' scale='.1 .2 -.3' inertia='convex'",
    ];
    let (folder, answer) = written("builtin", &meshes);
    assert_eq!(compare(&answer), meshes.len());
    std::fs::remove_dir_all(folder).expect("the folder is there");
}

/// With a limit of corners both sides keep far ones, but not the same.
#[test]
fn limited_hulls_are_as_large_as_mujocos() {
    let mesh =
        |most: usize| format!("builtin='sphere' params='3' scale='1 1.5 2' inertia='convex' maxhullvert='{most}'");
    let limits = [6, 10, 20, 50, 100];
    let meshes = limits.map(mesh);
    let (folder, answer) = written("limited", &meshes.each_ref().map(String::as_str));
    for (most, theirs) in limits.iter().zip(answer["models"].as_array().expect("models")) {
        let model = Model::from_xml_file(theirs["path"].as_str().expect("a path")).expect("a model");
        let corners = vectors(&theirs["hulls"][0]["corners"]).len();
        assert!(model.hulls[0].vertices.len() <= *most && corners <= *most);
        let (own, other) = (model.bodies[1].mass, theirs["model"]["bodies"][1]["mass"].as_f64().expect("a mass"));
        assert!(own > 0.9 * other, "with {most} corners {own} kg, MuJoCo has {other} kg");
    }
    std::fs::remove_dir_all(folder).expect("the folder is there");
}

/// Models of other projects that have meshes, as far as they are supported.
#[test]
fn public_meshes() {
    let files = oracle("foreign_models.py", &Value::Null);
    let has_mesh = |file: &&Value| {
        let features = file["features"].as_array();
        features.is_some_and(|list| list.iter().any(|feature| feature == "geom mesh"))
    };
    let paths: Vec<&Value> = files.as_array().expect("a list").iter().filter(has_mesh).map(|f| &f["path"]).collect();
    let some = |paths: &[&Value]| compare(&oracle("meshes.py", &json!({ "paths": paths })));
    let loaded: usize = paths.chunks(10).map(some).sum();
    println!("{loaded} of {} models with meshes agree", paths.len());
    assert!(loaded >= PUBLIC, "only {loaded} of {} models with meshes load", paths.len());
}

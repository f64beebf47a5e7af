//! A broken mesh is reported with the file, the place in it, what was found and what was expected.

use crate::refusal;

#[test]
fn mistakes_in_meshes_are_named() {
    let files = |name: &str| match name {
        "shapes/short.stl" => Ok(vec![0; 100]),
        "shapes/huge.stl" => Ok([vec![0; 80], 10_000_000i32.to_le_bytes().to_vec()].concat()),
        "shapes/bad.obj" => Ok(b"v 0 0 0\nv 1 0 zero\n".to_vec()),
        "shapes/flat.obj" => Ok(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\n".to_vec()),
        "shapes/thing.ply" => Ok(b"ply".to_vec()),
        _ => Err("no such file".to_owned()),
    };
    let mistake = |mesh: &str, geom: &str, parts: &[&str]| {
        let xml = format!(
            "<mujoco><compiler meshdir='shapes'/>\n<asset>{mesh}</asset>\n<worldbody>{geom}</worldbody></mujoco>"
        );
        refusal::names(&xml, &files, parts);
    };
    let shown = "<geom type='mesh' mesh='m'/>";
    let file = |name: &str| format!("<mesh name='m' file='{name}'/>");
    mistake(&file("none.stl"), shown, &["bad.xml:2:", "cannot read the file", "'shapes/none.stl': no such file"]);
    mistake(&file("short.stl"), shown, &["'shapes/short.stl'", "byte 80: found 0 triangles, expected 1 to 200000"]);
    mistake(&file("huge.stl"), shown, &["found 10000000 triangles"]);
    mistake(&file("bad.obj"), shown, &["'shapes/bad.obj': line 2: found 'zero', expected a coordinate"]);
    mistake(&file("thing.ply"), shown, &["ends with .stl, .obj or .msh"]);
    mistake(&file("flat.obj"), shown, &["<mesh name=\"m\">: its volume is 0e0", "inertia=\"shell\""]);
    mistake(&file("flat.obj").replace("/>", " inertia='shell'/>"), shown, &["all vertices are in one plane"]);
    mistake("<mesh name='m' content_type='a/b' file='bad.obj'/>", shown, &["content type 'a/b'"]);
    mistake("<mesh name='m'/>", shown, &["'file', 'builtin' or 'vertex' is missing"]);
    mistake("<mesh name='m' file='bad.obj' vertex='0 0 0'/>", shown, &["only one of 'file', 'builtin' and 'vertex'"]);
    mistake("<mesh name='m' vertex='0 0 0 1'/>", shown, &["'vertex' is '0 0 0 1'", "groups of three", "4 numbers"]);
    mistake("<mesh name='m' vertex='0 nan 0'/>", shown, &["finite numbers, not 'nan'"]);
    mistake("<mesh name='m' vertex='0 0 0'/>", shown, &["found 1 vertices, expected at least 4"]);
    let tetrahedron = "<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/>";
    let with = |attributes: &str| tetrahedron.replace("/>", &format!(" {attributes}/>"));
    mistake(&with("face='0 1 4'"), shown, &["face 0 is [0, 1, 4], but there are only 4 vertices"]);
    mistake(&with("face='0 1 -1'"), shown, &["vertices, counted from 0, not '-1'"]);
    let inward = "face='0 1 2 0 3 1 1 3 2 2 3 0'";
    mistake(&with(&format!("{inward} inertia='exact'")), shown, &["volume is -", "triangles face inward"]);
    mistake(
        &with("face='0 2 1 0 1 3 1 2 3 2 3 0' inertia='exact'"),
        shown,
        &["two faces run from vertex 0 to vertex 2"],
    );
    mistake(&with("maxhullvert='3'"), shown, &["maxhullvert is 3, expected -1 or at least 4"]);
    mistake(&with("inertia='solid'"), shown, &["one of convex, exact, legacy, shell"]);
    mistake(&with("scale='1e300 1e300 1e300'"), shown, &["<mesh name=\"m\">"]);
    mistake(&with("vertx='1'"), shown, &["has no attribute 'vertx'", "did you mean 'vertex'?"]);
    mistake("<mesh name='m' builtin='plate' params='1 1'/>", shown, &["only sphere, hemisphere, cone"]);
    mistake("<mesh name='m' builtin='sphere' params='9'/>", shown, &["'params' is [9.0]", "0 to 4"]);
    mistake("<mesh name='m' builtin='sphere'/>", shown, &["'params' is missing"]);
    mistake(tetrahedron, "<geom type='mesh'/>", &["bad.xml:3:", "a mesh needs the attribute 'mesh'"]);
    mistake(tetrahedron, "<geom type='mesh' mesh='n'/>", &["there is no mesh 'n'", "did you mean 'm'?"]);
    mistake(tetrahedron, "<geom type='plane' mesh='m'/>", &["can be fitted by a sphere"]);
    mistake(tetrahedron, "<geom type='capsule' mesh='m' fromto='0 0 0 1 0 0'/>", &["'fromto' does not go with a mesh"]);
}

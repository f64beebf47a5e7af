//! A model file cannot make the reader work or allocate without end.
//!
//! Everything whose size a file decides is checked against the budget (`MARATHON_LIMITS`) before work starts. No step of the
//! reader takes quadratic time.

#[cfg(unix)]
use crate::common;
use marathon_physics::{Model, Sim, SimOptions};
use std::time::{Duration, Instant};

/// Time limit for a hostile file of one megabyte on a busy machine.
const LONGEST: Duration = Duration::from_secs(10);

fn repeat(n: usize, one: impl Fn(usize) -> String) -> String {
    (0..n).map(one).collect()
}

/// Loads a model within the time limit. Returns the error if it is refused.
#[track_caller]
fn load(name: &str, text: &str) -> Result<Model, String> {
    let start = Instant::now();
    let result = Model::from_xml_str(text, name).map_err(|e| e.to_string());
    let time = start.elapsed();
    assert!(time < LONGEST, "{name}: {time:?}");
    result
}

#[track_caller]
fn refused(name: &str, text: &str, expected: &str) {
    let error = load(name, text).expect_err(name);
    assert!(error.contains(expected), "{name}: {error}");
}

/// The text of the memory limit.
const MEMORY: &str = "the limit 'memory' is 2 GB; set MARATHON_LIMITS=memory=";

#[test]
fn what_numbers_decide_the_size_of_is_refused_before_it_is_made() {
    let numbers = repeat(20_000, |i| format!("<numeric name='n{i}' size='100000'/>"));
    refused("numbers", &format!("<mujoco><custom>{numbers}</custom></mujoco>"), MEMORY);
    let bodies = repeat(3000, |_| "<body><joint/><geom size='1'/></body>".to_owned());
    let keys = format!("<mujoco><size nkey='100000'/><worldbody>{bodies}</worldbody></mujoco>");
    refused("keys", &keys, MEMORY);
    let sensors = "<user dim='100000'/>".repeat(20_000);
    refused("sensors", &format!("<mujoco><sensor>{sensors}</sensor></mujoco>"), MEMORY);
    let fields = repeat(300, |i| format!("<hfield name='h{i}' nrow='4096' ncol='4096' size='1 1 1 1'/>"));
    refused("fields", &format!("<mujoco><asset>{fields}</asset></mujoco>"), MEMORY);
    let elements = "<geom size='1'/>".repeat(1_100_000);
    refused("elements", &format!("<mujoco><worldbody>{elements}</worldbody></mujoco>"), MEMORY);
}

#[test]
fn classes_are_bounded_in_depth_and_number() {
    let nested = |depth: usize, kinds: &str, leaves: usize| {
        let open = repeat(depth, |i| format!("<default class='c{i}'>{kinds}"));
        let leaves = repeat(leaves, |i| format!("<default class='d{i}'/>"));
        format!("<mujoco><default>{open}{leaves}{}</default></mujoco>", "</default>".repeat(depth))
    };
    assert!(load("some classes", &nested(40, "<geom/><joint/>", 1000)).is_ok());
    refused("deep classes", &nested(60, "", 0), "nested more than 50 deep");
    let kinds = "<geom/><joint/><site/><camera/><light/><pair/><tendon/><motor/>";
    refused("many classes", &nested(48, kinds, 300_000), MEMORY);
    let sections = "<default><geom size='1'/></default>".repeat(20_000);
    refused("sections", &format!("<mujoco>{sections}</mujoco>"), "more than 200 of these set the defaults");
}

#[test]
fn reading_takes_time_in_proportion() {
    let attributes = repeat(40_000, |i| format!(" a{i}='1'"));
    refused("attributes", &format!("<mujoco{attributes}/>"), "an element has more than 500 attributes");
    // comments and texts are not attributes
    let comment = "<!-- a='1' -- -->".repeat(1000);
    assert!(load("comments", &format!("<mujoco>{comment}</mujoco>")).is_ok());

    let one = |i: usize| format!("<body><joint name='j{i}'/><geom size='1'/></body>");
    let world = |bodies: &str, rest: &str| format!("<mujoco><worldbody>{bodies}</worldbody>{rest}</mujoco>");
    let bodies = repeat(20_000, one);
    assert!(load("bodies", &world(&bodies, "")).is_ok());
    let tendons = repeat(20_000, |i| format!("<fixed armature='1'><joint joint='j{i}' coef='1'/></fixed>"));
    assert!(load("tendons", &world(&bodies, &format!("<tendon>{tendons}</tendon>"))).is_ok());
    let path = repeat(20_000, |i| format!("<joint joint='j{i}' coef='1'/>"));
    assert!(load("a tendon", &world(&bodies, &format!("<tendon><fixed>{path}</fixed></tendon>"))).is_ok());
    let servos = repeat(20_000, |i| format!("<position joint='j{i}' dampratio='1'/>"));
    assert!(load("servos", &world(&bodies, &format!("<actuator>{servos}</actuator>"))).is_ok());

    // strings that many joints move
    let joints = "<joint armature='1'/>".repeat(6);
    let link = format!("<body>{joints}<geom size='1'/>");
    let chain = format!("<site name='w'/>{}<site name='e'/>{}", link.repeat(190), "</body>".repeat(190));
    let strings = |spans: usize| {
        let path = "<site site='w'/><site site='e'/>".repeat(spans);
        world(&chain, &format!("<tendon><spatial>{path}</spatial></tendon>"))
    };
    load("a string", &strings(1000)).expect("it is not too long");
    refused("a long string", &strings(20_000), MEMORY);
    let motors = |count: usize| {
        let motors = "<motor site='e'/>".repeat(count);
        world(&chain, &format!("<actuator>{motors}</actuator>"))
    };
    load("motors", &motors(1000)).expect("they are not too many");
    refused("many motors", &motors(20_000), MEMORY);

    // one tree with a large mass matrix
    let tree = format!("<body><freejoint/><geom size='1'/>{}</body>", repeat(4000, one));
    let model = load("tree", &world(&tree, "")).expect("it is not too large");
    assert!(model.dofs.iter().all(|d| d.invweight0.is_finite() && d.invweight0 > 0.0));
}

/// A file that is included under ever new names of the same folder.
#[cfg(unix)]
#[test]
fn includes_share_one_budget() {
    let folder = common::scratch("includes");
    std::os::unix::fs::symlink(".", folder.join("d")).unwrap();
    let paths = repeat(30, |i| format!("<include file='{}a.xml'/>", "d/".repeat(1 + i)));
    std::fs::write(folder.join("main.xml"), format!("<mujoco>{paths}</mujoco>")).unwrap();
    let geoms = "<geom size='1'/>".repeat(100_000);
    std::fs::write(folder.join("a.xml"), format!("<mujoco><worldbody>{geoms}</worldbody></mujoco>")).unwrap();
    let error = Model::from_xml_file(folder.join("main.xml")).expect_err("too many").to_string();
    assert!(error.contains(MEMORY), "{error}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Mesh files whose numbers ask for much, or whose hull would take long.
#[test]
fn meshes_are_bounded() {
    let load = |file: &str, bytes: &[u8]| {
        let begun = Instant::now();
        let text = format!(
            "<mujoco><asset><mesh name='m' file='{file}' inertia='convex'/></asset><worldbody><geom type='mesh' \
             mesh='m'/></worldbody></mujoco>"
        );
        let result = Model::from_xml_str_with(&text, "mesh", &|_| Ok(bytes.to_vec())).map_err(|e| e.to_string());
        assert!(begun.elapsed() < LONGEST, "{file}: {:?}", begun.elapsed());
        result
    };
    let refused = |file: &str, bytes: &[u8], expected: &str| {
        let error = load(file, bytes).expect_err(file);
        assert!(error.contains(file) || error.contains("<mesh"), "{error}");
        assert!(error.contains(expected), "{error}");
    };
    let triangles = 10_000_000i32;
    let stl = [vec![0; 80], triangles.to_le_bytes().to_vec()].concat();
    refused("huge.stl", &stl, "found 10000000 triangles, expected 1 to 200000");
    let msh = [4, 0, 0, triangles].map(i32::to_le_bytes).concat();
    refused("huge.msh", &msh, "found 10000000 faces, expected at most 1048576");
    let nan = [vec![0; 80], 1i32.to_le_bytes().to_vec(), f32::NAN.to_le_bytes().repeat(12), vec![0; 2]].concat();
    refused("nan.stl", &nan, "expected finite numbers");
    let faces = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n{}", "f 1 2 3\n".repeat(4_000_000));
    refused("faces.obj", faces.as_bytes(), "faces, expected at most 1048576");
    let polygon = format!("v 0 0 0\nf{}\n", " 1".repeat(2_000_000));
    refused("polygon.obj", polygon.as_bytes(), "corners of a face, expected at most 1000");
    let vertices = "v 1 2 3\n".repeat(2_000_000);
    refused("vertices.obj", vertices.as_bytes(), "vertices, expected at most 1048576");
    let empty = "v 1 2 3\n".repeat(1_000_000);
    refused("same.obj", empty.as_bytes(), "the same point");
    // every point is a corner of the hull
    let spiral = |i: usize| {
        let z = 1.0 - 2.0 * (i as f64 + 0.5) / 400_000.0;
        let (r, angle) = ((1.0 - z * z).sqrt(), 2.399963 * i as f64);
        format!("v {:.7} {:.7} {z:.7}\n", r * angle.cos(), r * angle.sin())
    };
    refused("ball.obj", repeat(400_000, spiral).as_bytes(), "more than 65536 corners; limit them with maxhullvert");
    assert!(
        load("grid.obj", repeat(500_000, |i| format!("v {} {} {}\n", i % 80, i / 80 % 80, i / 6400)).as_bytes())
            .is_ok()
    );
}

/// The pairs of geoms that may touch grow with the square of a file's size, and so does the time to find them.
#[test]
fn a_simulation_keeps_to_the_budget_of_its_model() {
    let model = |moving: usize, fixed: usize, mask: usize| {
        let spheres = |n: usize| "<geom size='.1'/>".repeat(n);
        let text = format!(
            "<mujoco model='crowd'><default><geom contype='{mask}' conaffinity='{mask}'/></default><worldbody>{}<body>\
             <freejoint/>{}</body></worldbody></mujoco>",
            spheres(fixed),
            spheres(moving)
        );
        load("crowd", &text).expect("it is read")
    };
    let sim = |model: &Model| {
        let begun = Instant::now();
        let error = Sim::<f64>::new(model, SimOptions::default()).err().map(|e| e.to_string());
        assert!(begun.elapsed() < LONGEST, "{:?}", begun.elapsed());
        error
    };
    let error = sim(&model(10_000, 10_000, 1)).expect("its list of pairs is too long");
    assert!(error.contains("model 'crowd': the list of its contacts asks for ") && error.contains(MEMORY), "{error}");
    let error = sim(&model(60_000, 0, 1)).expect("too many geoms may collide");
    assert!(error.contains("contact of 60000 geoms") && error.contains("at most 50000"), "{error}");
    assert_eq!(sim(&model(60_000, 60_000, 0)), None, "geoms for the eye alone collide with nothing");
}

//! Meshes are drawn as they are, and no body is invisible because its shapes are hidden.

use marathon_physics::Model;
use marathon_render::{Antialias, Camera, Renderer, Scene};

const CUBE: &str = "-1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1 -1 -1 1 1 -1 1 1 1 1 -1 1 1";
const PYRAMID: &str = "-1 -1 0 1 -1 0 1 1 0 -1 1 0 0 0 1";

fn scene(vertices: &str, geoms: &str) -> Scene {
    let xml = format!(
        "<mujoco><asset><mesh name='it' vertex='{vertices}' scale='0.25 0.25 0.25'/></asset>
         <worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>"
    );
    Scene::new(&Model::from_xml_str(&xml, "mesh.xml").expect("a model"))
}

#[test]
fn bodies_of_meshes_are_shown() {
    let height = |geoms: &str| scene(CUBE, geoms).height();
    let mesh = height("<geom type='mesh' mesh='it'/>");
    assert!((mesh - 0.5).abs() < 0.1, "a mesh: {mesh}");
    let visual = height("<geom type='mesh' mesh='it' contype='0' conaffinity='0'/><geom size='0.1' group='3'/>");
    assert!((visual - mesh).abs() < 1e-9, "a mesh for the eye only, and a hidden shape: {visual}");
    let hidden = height("<geom type='mesh' mesh='it' rgba='0 0 0 0'/><geom size='0.1' group='3'/>");
    assert!((hidden - 0.2).abs() < 1e-9, "a hidden shape, as there is nothing else: {hidden}");
    let dressed = height("<geom type='mesh' mesh='it' contype='0' conaffinity='0'/><geom size='0.4'/>");
    assert!((dressed - mesh).abs() < 1e-9, "what is there to touch is under the mesh: {dressed}");
    let both = height("<geom type='mesh' mesh='it'/><geom size='0.4'/>");
    assert!((both - 0.8).abs() < 1e-9, "both: {both}");
}

#[test]
fn a_pyramid_is_no_box() {
    let mut scene = scene(
        PYRAMID,
        "<geom type='mesh' mesh='it' rgba='1 0 0 1'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>",
    );
    scene = scene.with_marks(false);
    let qpos = scene.model().qpos0.clone();
    let frame = scene.frame(&[qpos]).expect("a pose");
    let mut renderer = Renderer::new(80, 80).expect("a size");
    renderer.antialias = Antialias::Off;
    let image = renderer.render(&frame, &Camera { eye: [0.0, -3.0, 0.125], target: [0.0, 0.0, 0.125], fovy: 20.0 });
    let red = |x: usize, y: usize| {
        let [r, g, b] = image.pixel(x, y);
        r > g.max(b)
    };
    let width = |y: usize| (0..80).filter(|x| red(*x, y)).count();
    let rows: Vec<usize> = (0..80).map(width).filter(|w| *w > 0).collect();
    let (top, bottom) = (rows[0], rows[rows.len() - 1]);
    assert!(rows.windows(2).all(|pair| pair[0] <= pair[1] + 1), "wider toward the ground: {rows:?}");
    assert!(top <= 3 && bottom > 8, "{rows:?}");
}

//! A body without simple shapes to show is not invisible.

use marathon_physics::Model;
use marathon_render::Scene;

#[test]
fn bodies_of_meshes_are_shown() {
    let height = |geoms: &str| {
        let cube = "-1 -1 -1 1 -1 -1 1 1 -1 -1 1 -1 -1 -1 1 1 -1 1 1 1 1 -1 1 1";
        let xml = format!(
            "<mujoco><asset><mesh name='cube' vertex='{cube}' scale='0.25 0.25 0.25'/></asset>
             <worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>"
        );
        Scene::new(&Model::from_xml_str(&xml, "cube.xml").expect("a model")).height()
    };
    let mesh = height("<geom type='mesh' mesh='cube'/>");
    assert!((mesh - 0.5).abs() < 0.1, "a mesh is a box: {mesh}");
    let hidden = "<geom type='mesh' mesh='cube' contype='0' conaffinity='0'/><geom size='0.2' group='3'/>";
    assert!((height(hidden) - 0.4).abs() < 1e-9, "a hidden shape stands for it");
    let both = height("<geom type='mesh' mesh='cube'/><geom size='0.1'/><geom size='0.2' group='3'/>");
    assert!((both - 0.2).abs() < 1e-9, "a shape that is shown is enough");
}

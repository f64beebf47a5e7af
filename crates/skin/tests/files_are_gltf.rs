//! The files are glTF 2.0 as a strict reader accepts it, with one skinned mesh and a joint for each body.

use crate::common::models;
use marathon_skin::{Options, skin};

#[test]
fn a_strict_reader_accepts_every_file() {
    for (name, model) in models() {
        let skin = skin(&model, &Options::default()).expect("a skin");
        let bytes = skin.to_glb();
        let file = gltf::Gltf::from_slice(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        let blob = file.blob.as_deref().expect("a buffer");
        let (mesh, bound) = (file.meshes().next().expect("a mesh"), file.skins().next().expect("a skin"));
        assert_eq!((file.meshes().len(), file.skins().len(), mesh.primitives().len()), (1, 1, 1));

        let joints: Vec<gltf::Node> = bound.joints().collect();
        let names: Vec<&str> = joints.iter().map(|joint| joint.name().expect("a name")).collect();
        let bodies: Vec<&str> = skin.skeleton.iter().map(|joint| joint.name.as_str()).collect();
        assert_eq!(names, bodies, "{name}");

        let reader = mesh.primitives().next().expect("triangles");
        let reader = reader.reader(|_| Some(blob));
        let positions: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
        assert_eq!(positions, skin.positions);
        assert_eq!(reader.read_normals().expect("normals").collect::<Vec<_>>(), skin.normals);
        let read: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
        assert_eq!(read, skin.triangles.iter().flatten().map(|i| u32::from(*i)).collect::<Vec<_>>());
        let highest = reader.read_joints(0).expect("joints").into_u16().flatten().max().expect("vertices");
        assert!(usize::from(highest) < joints.len());
        for weights in reader.read_weights(0).expect("weights").into_f32() {
            assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
        }
        assert_eq!(reader.read_colors(0).expect("colors").into_rgba_u8().count(), positions.len());

        // at rest, the matrices undo the joints' places
        let matrices = bound.reader(|_| Some(blob)).read_inverse_bind_matrices().expect("matrices");
        for (matrix, joint) in matrices.zip(&skin.skeleton) {
            assert_eq!([0, 1, 2].map(|i| -matrix[3][i]), joint.position);
        }
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    let (_, model) = models().swap_remove(0);
    for triangles in [0, 499, 20_001] {
        let error = skin(&model, &Options { triangles }).expect_err("an error").to_string();
        assert_eq!(error, format!("triangles is {triangles}, expected 500 to 20000"));
    }
}

//! Binary glTF 2.0 (Khronos Group, "glTF 2.0 Specification").
//!
//! The file has y up and faces +z, as glTF does: `(x, y, z)` of the model is `(y, z, x)` there, in meters.

use crate::Skin;
use serde::Serialize;

/// Component types.
const FLOAT: u32 = 5126;
const BYTE: u32 = 5121;
const SHORT: u32 = 5123;
/// Targets of buffer views.
const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Document<'a> {
    asset: Asset,
    scene: u32,
    scenes: [Scene<'a>; 1],
    nodes: Vec<Node<'a>>,
    meshes: [Mesh<'a>; 1],
    skins: [Binding; 1],
    materials: [Material; 1],
    accessors: Vec<Accessor>,
    buffer_views: Vec<View>,
    buffers: [Buffer; 1],
}

#[derive(Serialize)]
struct Asset {
    version: &'static str,
    generator: &'static str,
}

#[derive(Serialize)]
struct Scene<'a> {
    name: &'a str,
    nodes: [usize; 2],
}

#[derive(Serialize)]
struct Node<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    translation: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    children: Vec<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    mesh: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skin: Option<u32>,
}

#[derive(Serialize)]
struct Mesh<'a> {
    name: &'a str,
    primitives: [Primitive; 1],
}

#[derive(Serialize)]
struct Primitive {
    attributes: Attributes,
    indices: usize,
    material: u32,
}

#[derive(Serialize)]
#[serde(rename_all = "SCREAMING_SNAKE_CASE")]
struct Attributes {
    position: usize,
    normal: usize,
    #[serde(rename = "COLOR_0")]
    color: usize,
    #[serde(rename = "JOINTS_0")]
    joints: usize,
    #[serde(rename = "WEIGHTS_0")]
    weights: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Binding {
    joints: Vec<usize>,
    skeleton: usize,
    inverse_bind_matrices: usize,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Material {
    name: &'static str,
    pbr_metallic_roughness: Roughness,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Roughness {
    metallic_factor: f32,
    roughness_factor: f32,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: usize,
    component_type: u32,
    count: usize,
    #[serde(rename = "type")]
    kind: &'static str,
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    normalized: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<[f32; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<[f32; 3]>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct View {
    buffer: u32,
    byte_offset: usize,
    byte_length: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    target: Option<u32>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Buffer {
    byte_length: usize,
}

/// The buffer, its views, and accessors to them.
#[derive(Default)]
struct Data {
    bytes: Vec<u8>,
    views: Vec<View>,
    accessors: Vec<Accessor>,
}

impl Data {
    /// Adds an array. Returns the number of its accessor.
    fn add(
        &mut self,
        bytes: &[u8],
        count: usize,
        kind: &'static str,
        component_type: u32,
        target: Option<u32>,
    ) -> usize {
        let (byte_offset, byte_length) = (self.bytes.len(), bytes.len());
        self.bytes.extend_from_slice(bytes);
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let buffer_view = self.views.len();
        self.views.push(View { buffer: 0, byte_offset, byte_length, target });
        self.accessors.push(Accessor {
            buffer_view,
            component_type,
            count,
            kind,
            normalized: false,
            min: None,
            max: None,
        });
        self.accessors.len() - 1
    }

    fn floats(&mut self, rows: &[[f32; 3]]) -> usize {
        let bytes: Vec<u8> = rows.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        self.add(&bytes, rows.len(), "VEC3", FLOAT, Some(VERTICES))
    }

    fn bytes(&mut self, rows: &[[u8; 4]], normalized: bool) -> usize {
        let accessor = self.add(rows.as_flattened(), rows.len(), "VEC4", BYTE, Some(VERTICES));
        self.accessors[accessor].normalized = normalized;
        accessor
    }
}

/// The bytes of a .glb file.
pub(crate) fn write(skin: &Skin) -> Vec<u8> {
    let mut data = Data::default();
    let position = data.floats(&skin.positions);
    let bound =
        |pick: fn(f32, f32) -> f32| skin.positions.iter().copied().reduce(|a, b| [0, 1, 2].map(|i| pick(a[i], b[i])));
    (data.accessors[position].min, data.accessors[position].max) = (bound(f32::min), bound(f32::max));
    let attributes = Attributes {
        position,
        normal: data.floats(&skin.normals),
        color: data.bytes(&skin.colors, true),
        joints: data.bytes(&skin.joints, false),
        weights: data.bytes(&skin.weights, true),
    };
    let indices: Vec<u8> = skin.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()).collect();
    let indices = data.add(&indices, 3 * skin.triangles.len(), "SCALAR", SHORT, Some(INDICES));
    // joints are not turned at rest, so a matrix only moves its joint to the origin; columns come one after another
    let bind = skin.skeleton.iter().flat_map(|joint| {
        let [x, y, z] = joint.position.map(|x| -x);
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]
    });
    let bind: Vec<u8> = bind.flat_map(f32::to_le_bytes).collect();
    let inverse_bind_matrices = data.add(&bind, skin.skeleton.len(), "MAT4", FLOAT, None);

    let count = skin.skeleton.len();
    let node = |i: usize| {
        let joint = &skin.skeleton[i];
        let above = joint.parent.map_or([0.0; 3], |parent| skin.skeleton[parent].position);
        let translation = Some([0, 1, 2].map(|k| joint.position[k] - above[k]));
        let children = (0..count).filter(|k| skin.skeleton[*k].parent == Some(i)).collect();
        Node { name: &joint.name, translation, children, mesh: None, skin: None }
    };
    let mut nodes: Vec<Node> = (0..count).map(node).collect();
    nodes.push(Node { name: &skin.name, translation: None, children: Vec::new(), mesh: Some(0), skin: Some(0) });
    let document = Document {
        asset: Asset { version: "2.0", generator: "marathon skin" },
        scene: 0,
        scenes: [Scene { name: &skin.name, nodes: [0, count] }],
        nodes,
        meshes: [Mesh { name: &skin.name, primitives: [Primitive { attributes, indices, material: 0 }] }],
        skins: [Binding { joints: (0..count).collect(), skeleton: 0, inverse_bind_matrices }],
        materials: [Material {
            name: "skin",
            pbr_metallic_roughness: Roughness { metallic_factor: 0.0, roughness_factor: 0.75 },
        }],
        accessors: data.accessors,
        buffer_views: data.views,
        buffers: [Buffer { byte_length: data.bytes.len() }],
    };
    let mut text = serde_json::to_vec(&document).expect("texts and numbers can be written");
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = Vec::with_capacity(28 + text.len() + data.bytes.len());
    file.extend_from_slice(b"glTF");
    let length = 28 + text.len() + data.bytes.len();
    for word in [2, length as u32, text.len() as u32] {
        file.extend_from_slice(&word.to_le_bytes());
    }
    file.extend_from_slice(b"JSON");
    file.extend_from_slice(&text);
    file.extend_from_slice(&(data.bytes.len() as u32).to_le_bytes());
    file.extend_from_slice(b"BIN\0");
    file.extend_from_slice(&data.bytes);
    file
}

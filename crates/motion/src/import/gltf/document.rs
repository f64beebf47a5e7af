//! The parts of a glTF file that move a skeleton, and the `.glb` container.
//!
//! The reader ignores meshes, materials and scenes, so nothing in them can be refused. Examples are a scene without
//! nodes, or meshes with quantized or compressed vertices.

use crate::error::MotionError;
use crate::limits;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase", default)]
#[derive(Default)]
pub(super) struct Document {
    pub asset: Asset,
    pub nodes: Vec<Node>,
    pub skins: Vec<Skin>,
    pub animations: Vec<Animation>,
    pub accessors: Vec<Accessor>,
    pub buffer_views: Vec<View>,
    pub buffers: Vec<Buffer>,
    pub extensions: Extensions,
    pub extensions_required: Vec<String>,
}

/// Starts of the names of extensions that leave the skeleton's motion as it is: geometry, materials, textures, lights,
/// metadata and figures. Compressed animations are refused where they are read.
const HARMLESS: &[&str] = &[
    "KHR_materials_",
    "KHR_texture_",
    "EXT_texture_",
    "MSFT_texture_",
    "KHR_lights_",
    "EXT_lights_",
    "KHR_mesh_",
    "EXT_mesh_",
    "KHR_draco_",
    "EXT_meshopt_",
    "KHR_meshopt_",
    "KHR_xmp",
    "KHR_animation_pointer",
    "VRM",
];

impl Document {
    /// Required extensions that this reader does not know: they may change what nodes and animations mean.
    pub fn unknown_extensions(&self) -> impl Iterator<Item = &str> {
        let required = self.extensions_required.iter().map(String::as_str);
        required.filter(|name| !HARMLESS.iter().any(|start| name.starts_with(start)))
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    pub version: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub name: Option<String>,
    pub children: Vec<usize>,
    pub translation: Option<[f64; 3]>,
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
    pub matrix: Option<[f64; 16]>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Skin {
    pub joints: Vec<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Animation {
    pub name: Option<String>,
    pub channels: Vec<Channel>,
    pub samplers: Vec<Sampler>,
}

#[derive(Deserialize)]
pub(super) struct Channel {
    pub sampler: usize,
    #[serde(default)]
    pub target: Target,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Target {
    pub node: Option<usize>,
    pub path: String,
}

#[derive(Deserialize)]
pub(super) struct Sampler {
    pub input: usize,
    pub output: usize,
    #[serde(default)]
    pub interpolation: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    #[serde(default)]
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    pub count: usize,
    #[serde(rename = "type")]
    pub kind: String,
    #[serde(default)]
    pub normalized: bool,
    #[serde(default)]
    pub sparse: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct View {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    #[serde(default)]
    pub byte_stride: Option<usize>,
    #[serde(default)]
    pub extensions: BTreeMap<String, IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Buffer {
    #[serde(default)]
    pub uri: Option<String>,
}

/// VRM's description of its bones.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Extensions {
    #[serde(rename = "VRM")]
    vrm0: Option<Vrm0>,
    #[serde(rename = "VRMC_vrm")]
    vrm1: Option<Vrm1>,
    #[serde(rename = "VRMC_vrm_animation")]
    vrma: Option<Vrm1>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Vrm0 {
    humanoid: Humanoid0,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Humanoid0 {
    human_bones: Vec<Bone0>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Bone0 {
    bone: String,
    node: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Vrm1 {
    humanoid: Humanoid1,
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Humanoid1 {
    human_bones: BTreeMap<String, Bone1>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Bone1 {
    node: Option<usize>,
}

impl Extensions {
    /// The VRM names of nodes.
    pub fn bones(&self) -> BTreeMap<usize, String> {
        let old = self.vrm0.iter().flat_map(|vrm| &vrm.humanoid.human_bones);
        let old = old.filter_map(|bone| Some((bone.node?, bone.bone.clone())));
        let new = self.vrm1.iter().chain(&self.vrma).flat_map(|vrm| &vrm.humanoid.human_bones);
        old.chain(new.filter_map(|(name, bone)| Some((bone.node?, name.clone())))).collect()
    }
}

/// Size of the header of a `.glb` file, and of the header of a chunk, bytes.
const HEADER: usize = 12;
const CHUNK: usize = 8;

/// The document of a `.glb` or `.gltf` file, and the binary chunk of a `.glb`.
pub(super) fn read<'a>(path: &Path, bytes: &'a [u8]) -> Result<(Document, Option<&'a [u8]>), MotionError> {
    let (json, blob) = if bytes.starts_with(b"glTF") { chunks(path, bytes)? } else { (bytes, None) };
    let json = json.strip_prefix("\u{feff}".as_bytes()).unwrap_or(json);
    let (objects, entries) = json.iter().fold((0usize, 0usize), |(objects, entries), byte| match byte {
        b'{' => (objects + 1, entries),
        b',' => (objects, entries + 1),
        _ => (objects, entries),
    });
    limits::check_memory(path, 256.0 * objects as f64 + 16.0 * entries as f64)?;
    let document: Document = serde_json::from_slice(json)
        .map_err(|error| MotionError::value(path, "glTF", error, "a .glb, .gltf, .vrm or .vrma file of glTF 2.0"))?;
    if !document.asset.version.starts_with("2.") {
        let found = format!("version {:?}", document.asset.version);
        return Err(MotionError::value(path, "asset", found, "version 2.0 of glTF"));
    }
    Ok((document, blob))
}

/// The JSON and the binary chunk of a `.glb` file.
fn chunks<'a>(path: &Path, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), MotionError> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let wrong = |found: String, expected: &str| Err(MotionError::value(path, "glTF", found, expected));
    let length = word(8).unwrap_or(0);
    if length < HEADER || length > bytes.len() {
        return wrong(
            format!("a length of {length} bytes"),
            &format!("the file's, {}, in its third word", bytes.len()),
        );
    }
    if word(4) != Some(2) {
        return wrong(format!("version {}", word(4).unwrap_or(0)), "version 2 in the second word");
    }
    let (mut json, mut blob, mut at) = (None, None, HEADER);
    while let (Some(size), Some(kind)) = (word(at), word(at + 4)) {
        let Some(chunk) = (at + CHUNK).checked_add(size).and_then(|end| bytes.get(at + CHUNK..end)) else {
            return wrong(format!("a chunk of {size} bytes at {at}"), "one within the file");
        };
        match kind {
            0x4E4F_534A if json.is_none() => json = Some(chunk),
            0x004E_4942 if blob.is_none() => blob = Some(chunk),
            _ => {}
        }
        at += CHUNK + size;
    }
    match json {
        Some(json) => Ok((json, blob)),
        None => wrong("no JSON chunk".into(), "one behind the header"),
    }
}

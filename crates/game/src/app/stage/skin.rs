//! The skin that the command line asks for.

use crate::app::error::GameError;
use crate::app::files::exists;
use crate::app::mode::AppSet;
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use bevy::asset::io::embedded::EmbeddedAssetRegistry;
use bevy::gltf::GltfAssetLabel;
use bevy::prelude::*;
use bevy_marathon::Anatomy;
use bevy_marathon::look::{Dressed, Skin, SkinError, UnfitSkin};
use marathon_physics::budget;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The skin that comes with Marathon, and its name.
const SHIPPED: (&str, &[u8]) = ("marathon_man", marathon_assets::bytes("skins/marathon_man.glb"));
/// Path of its bytes among the program's own assets.
const PLACE: &str = "skin.glb";
/// The first bytes of a .glb file.
const MAGIC: &[u8] = b"glTF";

/// The file of the skin that all characters wear.
#[derive(Resource, Clone)]
pub struct SkinFile {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Text of the mapping file, if the command line sets one.
    mapping: Option<Mapping>,
    /// Characters that cannot wear it keep their shapes without an error.
    optional: bool,
}

/// A mapping file.
#[derive(Clone)]
struct Mapping {
    path: PathBuf,
    text: String,
}

/// The skin that all characters wear.
#[derive(Resource)]
pub struct WornSkin {
    /// Its file.
    pub path: PathBuf,
    /// Whether the characters wear it.
    pub state: SkinState,
    scene: Handle<WorldAsset>,
    mapping: Option<Mapping>,
    optional: bool,
}

/// The progress of a [`WornSkin`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SkinState {
    /// The file is being read.
    Waiting,
    /// The characters wear it.
    Worn,
    /// The characters cannot wear it; the text says why.
    Refused(String),
}

impl SkinFile {
    /// Reads a skin, and optionally a mapping from its bones to bodies.
    ///
    /// # Errors
    /// If the file does not exist, is no .glb file, or needs an unsupported glTF extension.
    pub fn read(path: &Path, mapping: Option<&Path>) -> Result<Self, GameError> {
        let wrong = |path: &Path, problem: String| GameError::System(format!("{}: {problem}", path.display()));
        let read = |file: &Path| -> Result<Mapping, GameError> {
            exists(file)?;
            let text = budget::read_to_string(file, &budget::CONFIG_FILE).map_err(|e| wrong(file, e.to_string()))?;
            Ok(Mapping { path: file.into(), text })
        };
        let mapping = mapping.map(read).transpose()?;
        let (name, bytes) = SHIPPED;
        if path == Path::new(name) && !path.exists() {
            return Ok(SkinFile { path: path.into(), bytes: bytes.into(), mapping, optional: false });
        }
        exists(path)?;
        let bytes = budget::read(path, &budget::SKIN_FILE)
            .map_err(|e| GameError::System(format!("{}: {e}", path.display())))?;
        if !bytes.starts_with(MAGIC) {
            let expected = format!("expected a .glb file of glTF 2.0, or {name}, which comes with Marathon");
            return Err(wrong(path, format!("it is no .glb file, {expected}")));
        }
        if let Some(problem) = needs(&bytes) {
            return Err(wrong(path, problem));
        }
        Ok(SkinFile { path: path.into(), bytes, mapping, optional: false })
    }

    /// The skin that comes with Marathon.
    pub fn shipped() -> Self {
        let (name, bytes) = SHIPPED;
        SkinFile { path: name.into(), bytes: bytes.into(), mapping: None, optional: false }
    }

    /// The same for those characters alone that can wear it.
    pub fn optional(self) -> Self {
        SkinFile { optional: true, ..self }
    }
}

/// Names an unsupported extension that a .glb file needs, with a remedy.
fn needs(bytes: &[u8]) -> Option<String> {
    // a header of 12 bytes, then the length and the kind of the first chunk, which is JSON
    let length = bytes.get(12..16).and_then(|four| Some(u32::from_le_bytes(four.try_into().ok()?) as usize))?;
    let about: Value = serde_json::from_slice(bytes.get(20..20_usize.checked_add(length)?)?).ok()?;
    let mut needed = about["extensionsRequired"].as_array()?.iter().filter_map(Value::as_str);
    let (name, remedy) = needed.find_map(|name| Some((name, remedy(name)?)))?;
    Some(format!("it needs the extension {name}, which is not supported; {remedy}"))
}

/// Returns a remedy for a file that needs this glTF extension; `None` if the game supports the extension.
fn remedy(extension: &str) -> Option<&'static str> {
    match extension {
        "KHR_lights_punctual"
        | "KHR_materials_unlit"
        | "KHR_texture_transform"
        | "KHR_materials_transmission"
        | "KHR_materials_ior"
        | "KHR_materials_emissive_strength" => None,
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => Some(
            "export it without compression; Blender opens such files and writes others if Compression is cleared in its glTF \
             export",
        ),
        "KHR_mesh_quantization" => {
            Some("export it without quantization, or run `gltf-transform dequantize in.glb out.glb`")
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" => {
            Some("export it with PNG or JPEG textures, or run `gltf-transform png in.glb out.glb`")
        }
        _ => Some("export it without this extension"),
    }
}

pub(super) fn plugin(app: &mut App) {
    app.add_systems(Startup, load.run_if(resource_exists::<SkinFile>))
        .add_systems(Update, (dress, report).chain().run_if(resource_exists::<WornSkin>).in_set(AppSet::Present));
}

/// Starts to load the skin.
fn load(mut commands: Commands, file: Res<SkinFile>, registry: Res<EmbeddedAssetRegistry>, server: Res<AssetServer>) {
    registry.insert_asset(PLACE.into(), Path::new(PLACE), file.bytes.clone());
    let scene = server.load(GltfAssetLabel::Scene(0).from_asset(format!("embedded://{PLACE}")));
    let (path, mapping) = (file.path.clone(), file.mapping.clone());
    let optional = file.optional;
    commands.insert_resource(WornSkin { path, state: SkinState::Waiting, scene, mapping, optional });
}

/// Gives the skin to characters that have none.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn dress(
    mut commands: Commands,
    skin: Res<WornSkin>,
    actors: Query<Entity, (With<Actor>, With<Anatomy>, Without<Skin>)>,
) {
    for actor in &actors {
        let mapping = skin.mapping.as_ref().map(|mapping| mapping.text.clone().into());
        commands.entity(actor).insert(Skin { scene: skin.scene.clone(), mapping });
    }
}

/// Reports whether the characters wear it.
fn report(
    mut skin: ResMut<WornSkin>,
    mut notes: ResMut<Notifications>,
    dressed: Query<(), Added<Dressed>>,
    unfit: Query<&UnfitSkin, Added<UnfitSkin>>,
) {
    let path = skin.path.display().to_string();
    if let Some(UnfitSkin(problem)) = unfit.iter().next() {
        let mapping = skin.mapping.as_ref().map(|m| format!(" by the mapping {}", m.path.display()));
        let option = match problem {
            SkinError::UnknownBones(_) => ": --mapping FILE.json, as `marathon motion import` takes it",
            _ => "",
        };
        let text = format!("{path} cannot be worn{}: {problem}{option}", mapping.unwrap_or_default());
        if skin.state != SkinState::Refused(text.clone()) {
            if !skin.optional {
                notes.error(text.clone());
            }
            skin.state = SkinState::Refused(text);
        }
    } else if !dressed.is_empty() {
        skin.state = SkinState::Worn;
    }
}

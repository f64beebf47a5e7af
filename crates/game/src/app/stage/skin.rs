//! Skins of the characters: the one that the command line asks for, or else one that fits each character.

use crate::app::error::GameError;
use crate::app::files::exists;
use crate::app::mode::{AppSet, Mode};
use crate::app::notifications::Notifications;
use crate::app::stage::actors::Actor;
use bevy::asset::io::embedded::EmbeddedAssetRegistry;
use bevy::gltf::GltfAssetLabel;
use bevy::prelude::*;
use bevy_marathon::Anatomy;
use bevy_marathon::look::{Dressed, GeneratedSkin, Skin, SkinError, SkinGeneration, UnfitSkin};
use marathon_physics::budget;
use serde_json::Value;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The skin that comes with Marathon, its name, and the model that it is made for.
const SHIPPED: (&str, &[u8]) = ("marathon_man", marathon_assets::bytes("skins/marathon_man.glb"));
const SHIPPED_FOR: &str = "marathon_man";
/// Names of choices that are no file.
const BARE: &str = "none";
const GENERATED: &str = "generated";
/// The first bytes of a .glb file.
const MAGIC: &[u8] = b"glTF";

/// The choice of the characters' skins. It may change at any time.
#[derive(Resource, Clone, Default)]
pub enum SkinChoice {
    /// Marathon Man wears his own skin, other characters a generated one. Bare shapes are what the test bed shows, and what
    /// another program simulates.
    #[default]
    Fitting,
    /// Nothing: the shapes that the physics has.
    Bare,
    /// Every character wears a skin generated for its model.
    Generated,
    /// Every character wears the skin of a file.
    File(SkinFile),
}

impl SkinChoice {
    /// The choice of the command line: `none`, `generated`, or a file; without one, the fitting skins.
    ///
    /// # Errors
    /// If the file cannot be worn, see [`SkinFile::read`], or if a mapping is given without a file.
    pub fn read(skin: Option<&Path>, mapping: Option<&Path>) -> Result<Self, GameError> {
        let Some(path) = skin else { return Ok(SkinChoice::Fitting) };
        let choice = match path.to_str() {
            Some(BARE) => SkinChoice::Bare,
            Some(GENERATED) => SkinChoice::Generated,
            _ => return SkinFile::read(path, mapping).map(SkinChoice::File),
        };
        if mapping.is_some() {
            let problem =
                format!("--mapping goes with a file, found --skin {}; expected --skin FILE.glb", path.display());
            return Err(GameError::System(problem));
        }
        Ok(choice)
    }

    /// The words of a command line that make this choice.
    pub fn words(&self) -> Vec<OsString> {
        match self {
            SkinChoice::Fitting => Vec::new(),
            SkinChoice::Bare => vec!["--skin".into(), BARE.into()],
            SkinChoice::Generated => vec!["--skin".into(), GENERATED.into()],
            SkinChoice::File(SkinFile { path, mapping, .. }) => {
                let mapping = mapping.iter().flat_map(|mapping| ["--mapping".into(), mapping.path.clone().into()]);
                ["--skin".into(), path.clone().into()].into_iter().chain(mapping).collect()
            }
        }
    }

    /// The skin of a character in a mode.
    fn of(&self, mode: Mode, anatomy: &Anatomy) -> Wear<'_> {
        match self {
            SkinChoice::Bare => Wear::Nothing,
            SkinChoice::Generated => Wear::Generated,
            SkinChoice::File(file) => Wear::File(Some(file)),
            SkinChoice::Fitting if matches!(mode, Mode::Testbed | Mode::Outside) => Wear::Nothing,
            SkinChoice::Fitting if anatomy.model.name == SHIPPED_FOR => Wear::File(None),
            SkinChoice::Fitting => Wear::Generated,
        }
    }
}

/// The skin of a character. A file is that of the user, or the shipped one.
enum Wear<'a> {
    Nothing,
    Generated,
    File(Option<&'a SkinFile>),
}

/// The file of a skin.
#[derive(Clone)]
pub struct SkinFile {
    path: PathBuf,
    bytes: Vec<u8>,
    /// Text of the mapping file, if the command line sets one.
    mapping: Option<Mapping>,
}

/// A mapping file.
#[derive(Clone)]
struct Mapping {
    path: PathBuf,
    text: String,
}

/// Whether the characters wear their skins.
#[derive(Resource, Clone, Debug, Default, PartialEq, Eq)]
pub enum SkinState {
    /// A skin is being read or generated.
    Waiting,
    /// The characters wear all skins that they can wear.
    #[default]
    Worn,
    /// The characters cannot wear the skin that the user has chosen; the text says why.
    Refused(String),
}

/// Scenes of files that are worn already: of the shipped one and that of the user.
#[derive(Resource, Default)]
struct SkinScenes {
    shipped: Option<Handle<WorldAsset>>,
    chosen: Option<Handle<WorldAsset>>,
    /// Files read so far: each has a name of its own.
    count: usize,
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
            return Ok(SkinFile { path: path.into(), bytes: bytes.into(), mapping });
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
        Ok(SkinFile { path: path.into(), bytes, mapping })
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
    app.init_resource::<SkinChoice>().init_resource::<SkinState>().init_resource::<SkinScenes>().add_systems(
        Update,
        (undress.run_if(resource_changed::<SkinChoice>), dress, report).chain().in_set(AppSet::Present),
    );
}

/// Generates skins at once, so that a video does not depend on the speed of the machine.
pub fn generate_at_once(app: &mut App) {
    app.insert_resource(SkinGeneration::Blocking);
}

/// Removes the skins of another choice.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn undress(
    mut commands: Commands,
    mut scenes: ResMut<SkinScenes>,
    actors: Query<Entity, (With<Actor>, Or<(With<Skin>, With<GeneratedSkin>)>)>,
) {
    scenes.chosen = None;
    for actor in &actors {
        commands.entity(actor).remove::<(GeneratedSkin, Skin, UnfitSkin)>();
    }
}

/// Gives skins to characters that have none.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn dress(
    mut commands: Commands,
    (choice, mode): (Res<SkinChoice>, Res<State<Mode>>),
    mut scenes: ResMut<SkinScenes>,
    registry: Res<EmbeddedAssetRegistry>,
    server: Res<AssetServer>,
    actors: Query<(Entity, &Anatomy), (With<Actor>, Without<Skin>, Without<GeneratedSkin>)>,
) {
    for (actor, anatomy) in &actors {
        let file = match choice.of(*mode.get(), anatomy) {
            Wear::Nothing => continue,
            Wear::Generated => {
                commands.entity(actor).insert(GeneratedSkin);
                continue;
            }
            Wear::File(file) => file,
        };
        let SkinScenes { shipped, chosen, count } = &mut *scenes;
        let place = if file.is_some() { chosen } else { shipped };
        let scene = place.get_or_insert_with(|| {
            *count += 1;
            let path = format!("skin-{count}.glb");
            let bytes = file.map_or_else(|| SHIPPED.1.to_vec(), |file| file.bytes.clone());
            registry.insert_asset(path.clone().into(), Path::new(&path), bytes);
            server.load(GltfAssetLabel::Scene(0).from_asset(format!("embedded://{path}")))
        });
        let mapping = file.and_then(|file| file.mapping.as_ref()).map(|mapping| mapping.text.clone().into());
        commands.entity(actor).insert(Skin { scene: scene.clone(), mapping });
    }
}

/// Reports whether the characters wear their skins. A skin that the user has not chosen may fail: the shapes stay.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn report(
    choice: Res<SkinChoice>,
    mut state: ResMut<SkinState>,
    mut notes: ResMut<Notifications>,
    waiting: Query<(), (With<Actor>, Or<(With<Skin>, With<GeneratedSkin>)>, Without<Dressed>, Without<UnfitSkin>)>,
    unfit: Query<Ref<UnfitSkin>, With<Actor>>,
) {
    let refused = unfit.iter().next();
    let now = match (&*choice, refused) {
        (SkinChoice::File(file), Some(problem)) => SkinState::Refused(refusal(file, &problem.0)),
        (_, problem) => {
            if let Some(problem) = problem.filter(Ref::is_added) {
                notes.say(format!("bare shapes: {}", problem.0));
            }
            if waiting.is_empty() { SkinState::Worn } else { SkinState::Waiting }
        }
    };
    if *state != now {
        if let SkinState::Refused(text) = &now {
            notes.error(text.clone());
        }
        *state = now;
    }
}

/// Why a file cannot be worn.
fn refusal(file: &SkinFile, problem: &SkinError) -> String {
    let mapping = file.mapping.as_ref().map(|m| format!(" by the mapping {}", m.path.display()));
    let option = match problem {
        SkinError::UnknownBones(_) => {
            ": pass --mapping FILE.json, a file as `marathon motion import` takes it, or generate a skin for this character \
             with `marathon skin`"
        }
        _ => "",
    };
    format!("{} cannot be worn{}: {problem}{option}", file.path.display(), mapping.unwrap_or_default())
}

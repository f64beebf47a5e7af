//! The skin that the command line asks for.

use crate::app::error::GameError;
use crate::app::notes::Notes;
use crate::app::show::{Actor, exists};
use crate::look::{Dressed, Skin, UnfitSkin};
use crate::ragdoll::Anatomy;
use bevy::asset::io::embedded::EmbeddedAssetRegistry;
use bevy::gltf::GltfAssetLabel;
use bevy::prelude::*;
use std::path::{Path, PathBuf};

/// The skin that comes with Marathon, and its name.
const SHIPPED: (&str, &[u8]) = ("marathon_man", include_bytes!("../../../../assets/skins/marathon_man.glb"));
/// Where its bytes are among the program's own assets.
const PLACE: &str = "skin.glb";
/// How a .glb file begins.
const MAGIC: &[u8] = b"glTF";

/// A skin's file.
#[derive(Clone)]
pub struct File {
    path: PathBuf,
    bytes: Vec<u8>,
}

/// What all characters wear.
#[derive(Resource)]
pub struct Costume {
    /// Its file.
    pub path: PathBuf,
    /// Whether it is worn.
    pub fitting: Fitting,
    scene: Handle<WorldAsset>,
}

/// How far one is with a [`Costume`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fitting {
    /// It is being read.
    Waiting,
    /// Characters wear it.
    Worn,
    /// They cannot; the text says why.
    Refused(String),
}

impl File {
    /// Reads a skin.
    ///
    /// # Errors
    /// If there is no such file, or it is no .glb.
    pub fn read(path: &Path) -> Result<Self, GameError> {
        let (name, bytes) = SHIPPED;
        if path == Path::new(name) && !path.exists() {
            return Ok(File { path: path.into(), bytes: bytes.into() });
        }
        exists(path)?;
        let bytes =
            std::fs::read(path).map_err(|e| GameError::System(format!("cannot read {}: {e}", path.display())))?;
        if !bytes.starts_with(MAGIC) {
            let expected = format!("expected a .glb file of glTF 2.0, or {name}, which comes with Marathon");
            return Err(GameError::System(format!("{}: it is no .glb file, {expected}", path.display())));
        }
        Ok(File { path: path.into(), bytes })
    }
}

/// Lets all characters of an app wear a skin.
pub fn lay_out(app: &mut App, file: &File) {
    let registry = app.world().resource::<EmbeddedAssetRegistry>();
    registry.insert_asset(PLACE.into(), Path::new(PLACE), file.bytes.clone());
    let (server, place) = (app.world().resource::<AssetServer>(), format!("embedded://{PLACE}"));
    let scene = server.load(GltfAssetLabel::Scene(0).from_asset(place));
    let costume = Costume { path: file.path.clone(), fitting: Fitting::Waiting, scene };
    app.insert_resource(costume).add_systems(Update, (dress, tell).chain());
}

/// Gives the skin to characters that have none.
#[expect(clippy::type_complexity, reason = "a query names what it reads")]
fn dress(
    mut commands: Commands,
    costume: Res<Costume>,
    actors: Query<Entity, (With<Actor>, With<Anatomy>, Without<Skin>)>,
) {
    for actor in &actors {
        commands.entity(actor).insert(Skin::new(costume.scene.clone()));
    }
}

/// Tells whether it is worn.
fn tell(
    mut costume: ResMut<Costume>,
    mut notes: ResMut<Notes>,
    dressed: Query<(), Added<Dressed>>,
    unfit: Query<&UnfitSkin, Added<UnfitSkin>>,
) {
    let path = costume.path.display().to_string();
    if let Some(UnfitSkin(problem)) = unfit.iter().next() {
        let text = format!("{path} cannot be worn: {problem}");
        if costume.fitting != Fitting::Refused(text.clone()) {
            notes.error(text.clone());
            costume.fitting = Fitting::Refused(text);
        }
    } else if !dressed.is_empty() {
        costume.fitting = Fitting::Worn;
    }
}

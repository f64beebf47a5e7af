//! A character that wears a skin: a figure with a skeleton, modeled anywhere, in place of the shapes that the physics knows:
//! `cargo run --release -p bevy_marathon --features window --example wear_a_skin -- hero.glb`
//!
//! Without a file it is the figure that comes with Marathon. Each bone follows a body by its name. The names of Mixamo, Unreal, Unity,
//! Blender and others are known.

use bevy::asset::UnapprovedPathMode;
use bevy::prelude::*;
use bevy_marathon::look::UnfitSkin;
use bevy_marathon::prelude::*;

fn main() {
    let assets = AssetPlugin {
        file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(),
        // a skin may be anywhere
        unapproved_path_mode: UnapprovedPathMode::Allow,
        ..default()
    };
    let file = std::env::args().nth(1).unwrap_or_else(|| "skins/marathon_man.glb".into());
    App::new().add_plugins((DefaultPlugins.set(assets), Dressing(file))).run();
}

/// A character in the figure of this file.
pub struct Dressing(pub String);

impl Plugin for Dressing {
    fn build(&self, app: &mut App) {
        app.add_plugins((MarathonPlugin, LookPlugin, SkinPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
            .insert_resource(SkinFile(self.0.clone()))
            .add_systems(Startup, spawn)
            .add_systems(Update, tell);
    }
}

#[derive(Resource)]
struct SkinFile(String);

fn spawn(mut commands: Commands, assets: Res<AssetServer>, file: Res<SkinFile>) {
    let file = file.0.clone();
    let skin = Skin::new(assets.load(GltfAssetLabel::Scene(0).from_asset(file)));
    let policy = CharacterPolicy(assets.load("policies/MarathonManWalk.safetensors"));
    let walker = commands.spawn((Ragdoll::agent("MarathonManWalk"), policy, skin)).id();
    commands.spawn(FollowCamera::following(walker));
}

fn tell(unfit: Query<&UnfitSkin, Added<UnfitSkin>>) {
    for UnfitSkin(problem) in &unfit {
        println!("{problem}");
    }
}

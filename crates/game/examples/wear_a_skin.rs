//! A character that wears a skin: a figure with a skeleton, modeled anywhere, in place of the shapes that the physics knows:
//! `cargo run --release -p marathon-game --example wear_a_skin -- hero.glb`
//!
//! Without a file it is the figure that comes with Marathon. The names of the bones tell which body each follows; those of
//! Mixamo, Unreal, Unity, Blender and others are known.

use bevy::asset::UnapprovedPathMode;
use bevy::prelude::*;
use marathon_game::look::UnfitSkin;
use marathon_game::prelude::*;

fn main() {
    let assets = AssetPlugin {
        file_path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets").into(),
        // a skin may be anywhere
        unapproved_path_mode: UnapprovedPathMode::Allow,
        ..default()
    };
    App::new()
        .add_plugins(DefaultPlugins.set(assets))
        .add_plugins((MarathonPlugin, LookPlugin, SkinPlugin, SceneryPlugin(Quality::Medium), FollowCameraPlugin))
        .add_systems(Startup, spawn)
        .add_systems(Update, tell)
        .run();
}

fn spawn(mut commands: Commands, assets: Res<AssetServer>) {
    let file = std::env::args().nth(1).unwrap_or_else(|| "skins/marathon_man.glb".into());
    let skin = Skin::new(assets.load(GltfAssetLabel::Scene(0).from_asset(file)));
    let policy = Policy(assets.load("policies/MarathonManWalk.safetensors"));
    let walker = commands.spawn((Ragdoll::agent("MarathonManWalk"), policy, skin)).id();
    commands.spawn(FollowCamera::following(walker));
}

fn tell(unfit: Query<&UnfitSkin, Added<UnfitSkin>>) {
    for UnfitSkin(problem) in &unfit {
        println!("{problem}");
    }
}

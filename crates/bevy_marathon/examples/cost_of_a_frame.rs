//! Cost of the simulation: processor time per frame at 60 frames per second, for any agent and number.
//!
//! `cargo run --release -p bevy_marathon --no-default-features --example cost_of_a_frame -- humanoid 64`

use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_marathon::prelude::*;
use cpu_time::ProcessTime;
use std::time::Duration;

const FRAMES: u32 = 600;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let agent = words.next().unwrap_or_else(|| "humanoid".into());
    let number: u64 = words.next().unwrap_or_else(|| "64".into()).parse()?;
    let file = format!("{}/../../assets/policies/{agent}.safetensors", env!("CARGO_MANIFEST_DIR"));
    let policy = marathon_learn::Policy::load(file.as_ref())?;

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin))
        .insert_resource(Time::<Fixed>::from_hz(100.0))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60));
    let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    for i in 0..number {
        app.world_mut().spawn((Ragdoll::agent(&agent).with_seed(1, i), policy.clone()));
    }
    // the first frames make the batches
    (0..10).for_each(|_| app.update());
    let before = app.world().resource::<Marathon>().decisions();
    let clock = ProcessTime::now();
    (0..FRAMES).for_each(|_| app.update());
    let frame = clock.elapsed() / FRAMES;
    let decisions = app.world().resource::<Marathon>().decisions() - before;
    println!(
        "{number} x {agent}: {:.2} ms of processor time per frame, {:.1} decisions per frame",
        frame.as_secs_f64() * 1e3,
        decisions as f64 / f64::from(FRAMES)
    );
    Ok(())
}

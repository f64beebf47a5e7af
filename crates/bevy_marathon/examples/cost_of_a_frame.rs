//! Cost of the simulation: processor time per frame at 60 frames per second, for any agent and number. It prints the time of
//! physics and policies and the time of all other systems: the median of several rounds.
//!
//! `cargo run --release -p bevy_marathon --example cost_of_a_frame -- humanoid 64`
//!
//! With `crowd` at the end, the characters start 2 m apart and feel each other.

use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_marathon::prelude::*;
use cpu_time::ProcessTime;
use std::time::Duration;

const FRAMES: u32 = 240;
const ROUNDS: usize = 7;
/// Distance between characters that feel each other, m.
const APART: f32 = 2.0;

/// Processor time of the simulation, which nothing else runs beside.
#[derive(Resource)]
struct Simulated {
    began: ProcessTime,
    spent: Duration,
}

fn begin(mut simulated: ResMut<Simulated>) {
    simulated.began = ProcessTime::now();
}

fn end(mut simulated: ResMut<Simulated>) {
    simulated.spent = simulated.spent + simulated.began.elapsed();
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let agent = words.next().unwrap_or_else(|| "humanoid".into());
    let number: u64 = words.next().unwrap_or_else(|| "64".into()).parse()?;
    let crowd = match words.next().as_deref() {
        None => false,
        Some("crowd") => true,
        Some(word) => return Err(format!("unknown word '{word}', expected crowd or nothing").into()),
    };
    let file = format!("{}/../../assets/policies/{agent}.safetensors", env!("CARGO_MANIFEST_DIR"));
    let policy = marathon_learn::Policy::load(file.as_ref())?;

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(1) / 60))
        .insert_resource(Simulated { began: ProcessTime::now(), spent: Duration::ZERO })
        .add_systems(
            FixedUpdate,
            (
                begin.after(MarathonSystems::Admit).before(MarathonSystems::Simulate),
                end.after(MarathonSystems::Simulate).before(MarathonSystems::Report),
            ),
        );
    let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
    let side = (number as f32).sqrt().ceil() as u64;
    for i in 0..number {
        let mut character = app.world_mut().spawn((Ragdoll::agent(&agent).with_seed(1, i), policy.clone()));
        if crowd {
            let place = Transform::from_xyz((i % side) as f32 * APART, 0.0, (i / side) as f32 * APART);
            character.insert((place, Collides::ALL));
        }
    }
    // the first frames make the batches
    (0..10).for_each(|_| app.update());
    let (mut simulation, mut rest) = (Vec::new(), Vec::new());
    let before = app.world().resource::<Marathon>().decisions();
    for _ in 0..ROUNDS {
        app.world_mut().resource_mut::<Simulated>().spent = Duration::ZERO;
        let clock = ProcessTime::now();
        (0..FRAMES).for_each(|_| app.update());
        let (all, spent) = (clock.elapsed(), app.world().resource::<Simulated>().spent);
        simulation.push(spent / FRAMES);
        rest.push(all.saturating_sub(spent) / FRAMES);
    }
    let decisions = app.world().resource::<Marathon>().decisions() - before;
    let median = |times: &mut Vec<Duration>| {
        times.sort();
        times[times.len() / 2].as_secs_f64() * 1e3
    };
    println!(
        "{number} x {agent}: {:.2} ms of processor time per frame for physics and policies, {:.2} ms for other systems; {:.1} decisions per frame",
        median(&mut simulation),
        median(&mut rest),
        decisions as f64 / (f64::from(FRAMES) * ROUNDS as f64)
    );
    Ok(())
}

//! A character of your own: a body in MJCF, a task in Rust, and a policy for it, learned and played in one program without a
//! window: `cargo run --release -p bevy_marathon --example own_character`
//!
//! The task is registered under a name; from then on it is an agent like any other: `marathon_learn` trains it,
//! [`Ragdoll::agent`] spawns it.

use bevy::prelude::*;
use bevy::time::TimeUpdateStrategy;
use bevy_marathon::prelude::*;
use marathon_envs::{Agent, Body, Facts, Motors, Obs, Senses, Terms, names, register};
use marathon_learn::{Control, IterationStats, Snapshot, TrainConfig, train};
use marathon_physics::lanes::{Isa, Real};
use std::sync::Arc;
use std::time::Duration;

/// A snail: a body on a slide with one motor, which has to go forward.
const SNAIL: &str = r#"
<mujoco model="snail">
  <option timestep="0.01"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1"/>
    <body name="snail" pos="0 0 0.2">
      <joint name="way" type="slide" axis="1 0 0" damping="2"/>
      <geom name="shell" type="ellipsoid" size="0.2 0.12 0.12" mass="1"/>
    </body>
  </worldbody>
  <actuator><motor name="foot" joint="way" gear="4" ctrlrange="-1 1" ctrllimited="true"/></actuator>
</mujoco>"#;

const BODIES: [&str; 1] = ["snail"];
const SHELL: Body = Body::named(&BODIES, "snail");

struct Snail;

impl Agent for Snail {
    fn facts(&self) -> Facts {
        Facts {
            id: "Snail-v0".into(),
            summary: "go forward".into(),
            model: SNAIL.into(),
            frame_skip: 5,
            max_episode_steps: 100,
            actions: names(["foot"]),
            bodies: names(BODIES),
            reward_terms: names(["speed", "effort"]),
            ..Default::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qvel(0));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("speed", 1.0, s.readings().body_velocity(s.body(SHELL))[0]);
        terms.add("effort", -0.1, s.effort(Motors::NONE));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}

/// Trains the snail, then plays it for four seconds.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    register(Arc::new(Snail))?;
    let factory = marathon_envs::factory("snail", Isa::best())?;
    let config = TrainConfig::default().with(|config| {
        (config.run.agents, config.run.horizon, config.run.total_steps) = (32, 32, 30_000);
        (config.network.hidden, config.network.critic_hidden) = (vec![8], Some(vec![64, 64]));
    });
    let mut quiet = |_: &IterationStats, _: &Snapshot<'_>| Control::Continue;
    let policy = train(&*factory, Isa::best(), &config, None, &mut quiet)?.policy;

    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let policy = app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy);
    let snail = app.world_mut().spawn((Ragdoll::agent("snail"), CharacterPolicy(policy))).id();
    for second in 1..=4 {
        (0..50).for_each(|_| app.update());
        let way = app.world().get::<Episode>(snail).map_or(0.0, |e| e.distance);
        println!("{second} s: {way:.2} m");
    }
    Ok(())
}

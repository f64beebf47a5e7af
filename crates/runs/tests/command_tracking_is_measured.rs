//! Command tracking is measured. A cart that follows commands by a known law has that law's times, errors and drift. A
//! cart that falls over has its falls counted. The numbers do not depend on threads.

use marathon_envs::{
    Agent, CommandRange, Ctrl, EpisodeRng, Facts, Obs, Senses, Start, Terms, factory, names, register,
};
use marathon_learn::{Activation, EvalOptions, Policy, PolicyMeta};
use marathon_physics::lanes::{Isa, Real};
use marathon_runs::{CommandTracking, RunError, controller};
use std::sync::Arc;

/// A cart of 2 kg on a rail.
const MODEL: &str = r#"
<mujoco model="cart">
  <option timestep="0.01" gravity="0 0 -10"/>
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1" contype="0" conaffinity="1" friction="0 0 0" condim="1"/>
    <body name="cart" pos="0 0 0.1">
      <joint name="rail" type="slide" axis="1 0 0"/>
      <joint name="lift" type="slide" axis="0 0 1"/>
      <geom name="cart" size="0.1" mass="2" contype="1" conaffinity="0" friction="0 0 0" condim="1"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="rail" joint="rail"/>
    <motor name="lift" joint="lift"/>
  </actuator>
</mujoco>"#;

/// Time in which the cart makes 63 % of a change, s.
const LAG: f64 = 0.4;
/// Upward acceleration while it thrusts, m/s^2.
const THRUST: f64 = 4.0;
/// Difference by which it stays below the commanded speed, m/s.
const SLACK: f64 = 0.25;

/// A cart whose motor corrects the difference from the commanded speed, whatever the policy does.
#[derive(Clone, Copy)]
struct Cart {
    /// Speed above which it counts as fallen, m/s.
    breaks_at: f64,
}

impl Agent for Cart {
    fn facts(&self) -> Facts {
        Facts {
            id: if self.breaks_at < 10.0 { "WeakCart-v0" } else { "StrongCart-v0" }.into(),
            model: MODEL.into(),
            frame_skip: 1,
            reward_terms: names(["nothing"]),
            command: vec![CommandRange::new("velocity", -2.0..=2.0, "m/s"), CommandRange::new("jump", 0.0..=1.0, "")],
            feet: names(["cart"]),
            memory: 1,
            ..Facts::default()
        }
    }

    fn reset(&self, _: &mut Start) {}

    fn command(&self, random: &mut EpisodeRng, _: usize, out: &mut [f64]) -> usize {
        out[0] = random.around_zero(1.0);
        out[1] = 0.0;
        500
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        let slack = c.command[0].min(T::lit(SLACK)).max(T::lit(-SLACK));
        c.ctrl[0] = (c.command[0] - slack - c.qvel[0]) * T::lit(2.0 / LAG);
        // thrusts for as long as commanded, from 0.2 s on
        c.memory[0] = (c.memory[0] + T::lit(0.01)) * c.command[1];
        c.ctrl[1] = T::select(T::lit(0.2).lt(c.memory[0]), T::lit(2.0 * (10.0 + THRUST)), T::zero());
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.command(0));
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, _: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("nothing", 1.0, T::zero());
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        T::lit(self.breaks_at).lt(s.readings().qvel(0).abs())
    }
}

fn policy(id: &str) -> Policy {
    let spec = factory(id, Isa::best()).expect("it is registered").spec().clone();
    let meta = PolicyMeta::of(&spec, vec![1], Activation::Tanh);
    let (obs, act) = (spec.obs, spec.act);
    let params = vec![0.0; (obs + 1) + 2 * act];
    Policy::from_parts(meta, params, (vec![0.0; obs], vec![1.0; obs]), vec![0.0; act]).expect("lengths fit")
}

fn measured(id: &str, threads: usize) -> CommandTracking {
    let options = EvalOptions { episodes: 20, seed: 3, threads };
    controller::measure(&policy(id), &options).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn a_cart_with_a_lag_has_the_times_of_the_lag() {
    register(Arc::new(Cart { breaks_at: 100.0 })).expect("the name is free");
    let got = measured("StrongCart-v0", 1);
    assert_eq!(got, measured("StrongCart-v0", 3));
    assert_eq!((got.agents, got.minutes.without_fall, got.minutes.falls_per_minute), (20, 20, 0.0));
    assert_eq!(got.minutes.early_falls, 0);
    // half of the commands are below the difference, where it stands still
    let settled = got.minutes.settled_error;
    assert!((0.15..SLACK).contains(&settled) && got.minutes.velocity_error > settled, "{:?}", got.minutes);
    assert_eq!(got.responses.len(), 6);
    for r in &got.responses {
        assert_eq!((r.agents, r.falls), (20, 0));
        // start and end speeds are off by the difference, unless they are zero
        let [from, to] = [r.from, r.to].map(|v| v - v.signum() * if v == 0.0 { 0.0 } else { SLACK });
        let time = |share: f64| {
            let wanted = r.from + share * (r.to - r.from);
            let made = (wanted - from) / (to - from);
            (made < 1.0).then(|| -LAG * (1.0 - made).ln())
        };
        for (got, expected) in [(r.to_63, time(0.63)), (r.to_90, time(0.9))] {
            match (got, expected) {
                // the command is observed one decision later, and the speed is that of a decision
                (Some(got), Some(expected)) => assert!((got - expected).abs() < 0.03, "{r:?}: {expected}"),
                (got, expected) => assert_eq!(got, expected, "{r:?}"),
            }
        }
        assert!(r.overshoot < 1e-6 || r.to == 0.0, "{r:?}");
        let off = if r.to == 0.0 { 0.0 } else { SLACK };
        assert!((r.error.unwrap() - off).abs() < 0.01 && r.speeds.len() == 400, "{r:?}");
    }
    assert_eq!((got.stand.still, got.stand.falls), (20, 0));
    assert!(got.stand.drift.unwrap() < 1e-3 && got.stand.speed.unwrap() < 1e-3 && got.turns.is_empty());
    // it thrusts from 0.2 s to 1 s, and stays in the air
    assert_eq!(got.jumps.iter().map(|jump| jump.speed).collect::<Vec<_>>(), [0.0, 1.0, 2.0]);
    for jump in &got.jumps {
        assert_eq!((jump.agents, jump.prompt, jump.thrown, jump.falls), (20, 20, 20, 0));
        let (latency, height) = (jump.latency.unwrap(), jump.height.unwrap());
        assert!((0.2..0.3).contains(&latency), "{latency}");
        // it must first rise fast enough
        let thrown = jump.thrown_latency.unwrap();
        assert!((latency..latency + 0.1).contains(&thrown), "{thrown}");
        let (way, speed) = (0.5 * THRUST * 0.8 * 0.8, THRUST * 0.8);
        assert!((height - (way + speed * speed / 20.0)).abs() < 0.05, "{height}");
    }
    let times: Vec<f64> = got.pushes.iter().map(|push| push.recovery.expect("it recovers")).collect();
    for (push, time) in got.pushes.iter().zip(&times) {
        // it also recovers while it is pushed
        let jump = push.velocity * LAG / 0.1 * (1.0 - (-0.1f64 / LAG).exp());
        let expected = if jump > 0.3 { 0.1 + LAG * (jump / 0.3).ln() } else { 0.0 };
        assert!((time - expected).abs() < 0.15, "{push:?}: {expected}");
    }
    let players: Vec<(&str, u64, f64)> =
        got.players.iter().map(|player| (player.name.as_str(), player.falls, player.falls_per_minute)).collect();
    let names = ["keyboard", "speed at 5 Hz", "full speed 0.2 s after a jump of 0.4 s"];
    assert_eq!(players, names.map(|name| (name, 0, 0.0)));
    let text = got.table();
    assert!(text.contains("20 of 20 without a fall") && text.contains("-2.00 to  2.00"), "{text}");
}

#[test]
fn falls_are_counted_where_they_happen() {
    register(Arc::new(Cart { breaks_at: 1.5 })).expect("the name is free");
    let got = measured("WeakCart-v0", 1);
    // random commands are below 1 m/s, those of the speed steps are 2 m/s: too fast before, or too fast after
    assert_eq!(got.minutes.without_fall, 20);
    for r in &got.responses {
        let expected = if r.from == 0.0 { (20, 20) } else { (0, 0) };
        assert_eq!((r.agents, r.falls), expected, "{r:?}");
        assert_eq!(r.error.is_none(), r.agents == 0, "{r:?}");
    }
    assert_eq!(got.stand.still, 20);
    // full speed is too fast, unless the command changes before it is reached
    assert_eq!(
        got.players.iter().map(|player| (player.agents, player.falls)).collect::<Vec<_>>(),
        [(20, 20), (20, 0), (20, 20)]
    );
    // every agent falls once, and within the first seconds
    assert!((10.0..60.0).contains(&got.players[0].falls_per_minute), "{:?}", got.players);
    // all agents have fallen before a jump at 2 m/s
    assert_eq!(got.jumps.iter().map(|jump| (jump.agents, jump.falls)).collect::<Vec<_>>(), [(20, 0), (20, 0), (0, 0)]);
    // at 0.75 m/s, a push forward by 1 m/s is too much, one backward is not
    let falls: Vec<u64> = got.pushes.iter().map(|push| push.falls).collect();
    assert_eq!(falls, [0, 0, 10]);
}

#[test]
fn a_task_without_a_speed_is_refused() {
    let error = controller::measure(&policy("Hopper-v0"), &EvalOptions::default()).expect_err("it cannot be told");
    assert!(matches!(&error, RunError::NoSpeed { task, others } if task == "Hopper-v0" && !others.is_empty()));
    let text = error.to_string();
    assert!(text.contains("has no speed command") && text.contains("MarathonManSteer-v0"), "{text}");
}

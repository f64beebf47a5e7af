//! A task of two roles: a runner that stays at home, and an opponent that pushes it and skips decisions.

use marathon_envs::options::OptionSet;
use marathon_envs::{Agent, Facts, Obs, OptionInfo, Options, Part, RoleFacts, Senses, Start, Terms, names, register};
use marathon_physics::lanes::Real;
use std::sync::{Arc, Once};

const PARTS: [&str; 2] = ["runner", "opponent"];
const RUNNER: Part = Part::named(&PARTS, "runner");
const OPPONENT: Part = Part::named(&PARTS, "opponent");

marathon_envs::options! {
    /// Options of the task.
    pub struct Arguments {
        /// Decisions of the runner per decision of the opponent.
        period: f64 = 4.0,
        /// Whether the opponent has a role of its own.
        roles: f64 = 1.0,
        /// Whether there is an opponent.
        opponent: f64 = 1.0,
    }
}

/// The task.
#[derive(Clone, Default)]
pub struct Tag(Arguments);

/// Registers the task.
pub fn register_tag() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| register(Arc::new(Tag::default())).expect("a task that makes sense"));
}

impl Tag {
    fn opposed(&self) -> bool {
        self.0.opponent > 0.0
    }

    fn model(&self) -> String {
        let motors = |who: &str, gear: f64| {
            format!(
                "<motor name=\"{who}_x\" joint=\"{who}_x\" gear=\"{gear}\"/><motor name=\"{who}_y\" joint=\"{who}_y\" gear=\"{gear}\"/>"
            )
        };
        let ball = |who: &str, at: &str| {
            format!(
                "<body name=\"{who}\" pos=\"{at} 0.2\"><joint name=\"{who}_x\" axis=\"1 0 0\"/><joint name=\"{who}_y\" axis=\"0 1 0\"/>\
                 <geom name=\"{who}\"/></body>"
            )
        };
        let pushes = if self.opposed() { motors("opponent", 6.0) } else { String::new() };
        format!(
            "<mujoco model=\"tag\"><option timestep=\"0.01\"/>\
             <default><joint type=\"slide\" damping=\"1\"/><geom type=\"sphere\" size=\"0.15\" mass=\"1\"/></default>\
             <worldbody>{}{}</worldbody><actuator>{}{pushes}</actuator></mujoco>",
            ball("runner", "0 0"),
            ball("opponent", "0.4 0.1"),
            motors("runner", 1.5),
        )
    }
}

impl Agent for Tag {
    fn facts(&self) -> Facts {
        let role = |name: &str, seen: &[&str], earns: &[&str], intermittent| RoleFacts {
            name: name.into(),
            observations: names(seen),
            actions: names([format!("{name}_x"), format!("{name}_y")]),
            reward_terms: names(earns),
            intermittent,
        };
        let mut facts = Facts {
            id: "Tag-v0".into(),
            summary: "a runner that stays at home, and an opponent that pushes it away".into(),
            model: self.model().into(),
            frame_skip: 4,
            max_episode_steps: 30,
            actions: names(["runner_x", "runner_y"]),
            reward_terms: names(["home"]),
            parts: names(PARTS),
            memory: 1,
            termination_reward: None,
            ..Facts::default()
        };
        if self.opposed() {
            facts.actions.extend(names(["opponent_x", "opponent_y"]));
            facts.reward_terms.extend(names(["far", "close"]));
            if self.0.roles > 0.0 {
                facts.roles = vec![
                    role("runner", &["home", "balls"], &["home"], false),
                    role("opponent", &["balls"], &["far", "close"], true),
                ];
            }
        }
        facts
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.0.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Tag(self.0.with(options)))
    }

    fn reset(&self, start: &mut Start) {
        for x in &mut *start.qpos {
            *x += start.random.around_zero(0.2);
        }
        // the opponents of different agents decide at different times
        start.memory[0] = start.random.whole(0, 3) as f64;
    }

    #[inline(always)]
    fn remember<T: Real>(&self, _: &Senses<T>, memory: &mut [T]) {
        let next = memory[0] + T::lit(1.0);
        memory[0] = T::masked(next.lt(T::lit(self.0.period - 0.5)), next);
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.group("home");
        out.scalar(distance(s.position(RUNNER), [T::zero(); 3]));
        out.group("balls");
        for part in [RUNNER, OPPONENT] {
            let ([x, y, _], [vx, vy, _]) = (s.position(part), s.linear_velocity(part));
            [x, y, vx, vy].into_iter().for_each(|x| out.scalar(x));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let away = distance(s.position(RUNNER), [T::zero(); 3]);
        terms.add("home", -1.0, away);
        if self.opposed() {
            terms.add("far", 1.0, away);
            terms.add("close", -0.2, distance(s.position(RUNNER), s.position(OPPONENT)));
        }
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        T::lit(0.9).lt(distance(s.position(RUNNER), [T::zero(); 3]))
    }

    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        if role == 0 { T::not(T::none()) } else { s.memory(0).lt(T::lit(0.5)) }
    }
}

/// Distance of two positions in the plane, m.
#[inline(always)]
fn distance<T: Real>(a: [T; 3], b: [T; 3]) -> T {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x.mul_add(x, y * y).sqrt()
}

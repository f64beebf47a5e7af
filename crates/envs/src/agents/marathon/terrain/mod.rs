// one file: the observation, reward and roles of one task
//! Figures that run over uneven ground: the paper's assault courses.
//!
//! Each agent has its own ground, drawn for every episode: a [course] of some kind and difficulty.
//!
//! | observation | content |
//! |---|---|
//! | what the figure's own task observes | but for the heights of its feet |
//! | `foot_heights` | height of each foot's center above the ground below it, m |
//! | `ground_ahead` | with `heights`: how far the ground is above the Hopper's foot or the Walker's torso, at 25 points every 0.2 m from 2 m behind it on, m; in space above the torso, at 45 points around and ahead of it |
//! | `ground_close` | with `heights`, for Marathon Man: the same at 51 points where the next two steps lead, every 0.1 m |
//! | `phase` | with `heights`, in a plane: share of the present 0.2 m that lies behind, 0 to 1 |
//!
//! `full`: r = v/4 + forward bonus - effort - 4 (joints at limit) - pain, of the torso; experiment 004 of the original.
//! `velocity`: r = clamp(v / 8 m/s, 0, 1), that of the Marathon Environments 2.
//! `sparse`: r = way / 20 m at the end of the episode, 0 before.
//! Marathon Man's `full` is the reward of the task in which he is [steered](super::marathon_man::steer); his task is
//! [there](super::marathon_man::TerrainMarathonMan), too.
//!
//! With the course `adversary` the task has two roles: the figure, and a builder who earns -r; with `builder=regret` three.

mod arguments;
mod bank;
mod builder;
pub mod course;
mod distance;
mod pieces;
mod plan;
mod profile;
mod regret;
mod runners;
pub mod sight;

pub use arguments::TerrainArguments;
pub use runners::Runner;

use marathon_physics::lanes::Real;
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{HField, Kind as Element, ModelSpec};

use super::FASTEST;
use super::ant::AntV0;
use super::hopper::HopperV0;
use super::idle;
use super::walker2d::Walker2dV0;
use crate::agent::{
    Agent, Ctrl, Facts, Motors, Obs, OptionInfo, OptionSet, Options, Senses, Share, Site, Start, Terms, names,
};
use crate::episode_rng::EpisodeRng;
use arguments::{Earns, Falls, Levels, Reward};
use course::{Kind, ROW};
use plan::Teacher;
use profile::{FROM, POINTS, TO};

/// Points at which the ground is seen, and how far one is from the next and the first behind the figure, m.
const SEEN: usize = 25;
const SPACING: f64 = 0.2;
const BEHIND: f64 = 2.0;
/// Farthest below or above the figure that ground is seen, m.
const SIGHT: f64 = 3.0;

/// Slots of the memory: the level of a course, 0 to 1, and its difficulty.
const LEVEL: usize = 0;
const DIFFICULTY: usize = 1;
/// Where the torso is, was farthest, and the last full meter that was new, along x, m.
const AT: usize = 2;
const FARTHEST: usize = 3;
const MARK: usize = 4;
/// Decisions since that meter.
const SINCE: usize = 5;
/// Whether anything but the feet touches the ground, whether it did not before, and whether it has in this episode.
const LIES: usize = 6;
const HIT: usize = 7;
const HURT: usize = 8;
/// Whether the adversary is to build, how many meters it has built, and its last step, m.
const DUE: usize = 9;
const BUILT: usize = 10;
const STEP: usize = 11;
const MEMORY: usize = 12;

/// Time without a new meter that ends an episode, s.
const PATIENCE: f64 = 5.0;
/// Falls before here end the episode even of a figure that may fall, m.
const TOO_EARLY: f64 = 4.0;
/// Price of a fall that ends nothing.
const PAIN: f64 = -5.0;
/// Way that earns 1 with the sparse reward, m.
const WAY: f64 = 20.0;
/// Most motors that all roles of a figure have together, and most variables of its own.
const MOST_MOTORS: usize = 64;
const MOST_MEMORY: usize = 64;
/// How near to the edge of a course an episode ends, m.
const EDGE: f64 = 0.2;
/// Thickness of the ground below the start's height, m.
const BASE: f64 = 8.0;

/// The Hopper on courses.
pub type TerrainHopper = Terrain<HopperV0>;
/// The Walker on courses.
pub type TerrainWalker2d = Terrain<Walker2dV0>;
/// The Ant on courses.
pub type TerrainAnt = Terrain<AntV0>;

/// A figure that runs over uneven ground.
#[derive(Clone, Debug)]
pub struct Terrain<F> {
    figure: F,
    arguments: TerrainArguments,
}

impl<F: Runner> Default for Terrain<F> {
    fn default() -> Self {
        Terrain { figure: F::default(), arguments: TerrainArguments::default() }
    }
}

impl<F: Runner> Terrain<F> {
    /// Rows of its height field.
    const ROWS: usize = if F::IN_SPACE { (2.0 * F::HALF_WIDTH / ROW) as usize + 1 } else { 2 };

    /// The variables of the course, behind those of the figure.
    #[inline(always)]
    fn course<'s, T: Real>(s: &Senses<'s, T>) -> &'s [T] {
        &s.memory[F::MEMORY..]
    }

    /// The figure's model with a height field in place of the floor.
    fn model(&self) -> Result<ModelSpec, MjcfError> {
        let mut spec = self.figure.facts().model.spec(F::ID)?;
        if self.built() {
            idle::add_actuators(&mut spec, F::JOINT, &self.others())?;
        }
        let (half, middle) = (0.5 * (TO - FROM), 0.5 * (TO + FROM));
        spec.add(HField::new("course", Self::ROWS, POINTS, [half, F::HALF_WIDTH, 1.0, BASE]))?;
        let mut floor = spec.get_mut(Element::Geom, "floor")?;
        floor.unset("size")?.set("type", "hfield")?.set("hfield", "course")?.set("pos", [middle, 0.0, 0.0])?;
        Ok(spec)
    }

    /// Whether an adversary builds the ground.
    fn built(&self) -> bool {
        self.arguments.course() == Kind::Adversary
    }

    /// Whether it earns what a reference earns more than the runner.
    fn regrets(&self) -> bool {
        self.built() && self.arguments.builder() == Earns::Regret
    }

    /// How the agent chooses the pieces of its courses. `None` for levels without a bank, and for courses without pieces.
    fn teacher(&self) -> Option<Teacher> {
        let TerrainArguments { difficulty: Share(difficulty), levels, .. } = self.arguments;
        let (rule, kinds) = (levels.rule()?, self.arguments.course().pieces());
        (!kinds.is_empty()).then_some(Teacher { rule, kinds, difficulty })
    }

    /// Number of the course's variables.
    fn course_memory(&self) -> usize {
        match self.teacher() {
            Some(_) => plan::MEMORY,
            None if self.regrets() => regret::MEMORY,
            None => MEMORY,
        }
    }

    /// Actuators of roles without a body, behind the figure's own: the reference's, and the adversary's.
    fn others(&self) -> Vec<String> {
        let own = if self.regrets() { self.figure.facts().actions } else { Vec::new() };
        let theirs = own.into_iter().map(|name| format!("{}_{name}", regret::REFERENCE));
        theirs.chain(self.built().then(|| builder::ACTION.into())).collect()
    }

    /// Effort of who has the motors, and the penalty for those at their limits.
    #[inline(always)]
    fn hard<T: Real>(&self, s: &Senses<T>) -> [T; 2] {
        let of = |ignored| [s.effort(ignored), s.joints_at_limit_penalty(ignored)];
        let own = of(Motors::from(F::MOTORS));
        if !self.regrets() {
            return own;
        }
        let (theirs, second) = (of(Motors::except(F::MOTORS, 2 * F::MOTORS)), regret::runs(Self::course(s)));
        [T::select(second, theirs[0], own[0]), T::select(second, theirs[1], own[1])]
    }

    /// Lanes in which the runner's run is over, and the reference is to begin.
    #[inline(always)]
    fn handed_over<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        if self.regrets() { regret::is_due(Self::course(s)) } else { T::none() }
    }

    /// Lanes in which the figure has failed. `memory`: the course's variables.
    #[inline(always)]
    fn failed<T: Real>(&self, memory: &[T]) -> T::Mask {
        let lies = T::lit(0.5).lt(memory[LIES]);
        match self.arguments.falls {
            Falls::End => lies,
            Falls::Hurt => T::and(lies, memory[AT].lt(T::lit(TOO_EARLY))),
        }
    }

    /// Sets the figure's own variables as at the start of an episode in some lanes.
    #[inline(always)]
    fn begin_again<T: Real>(&self, s: &Senses<T>, own: &mut [T], lanes: T::Mask) {
        let mut begun = [T::zero(); MOST_MEMORY];
        self.figure.begin(s, &mut begun[..F::MEMORY]);
        F::aim(&mut begun[..F::MEMORY]);
        for (own, begun) in own.iter_mut().zip(begun) {
            *own = T::select(lanes, begun, *own);
        }
    }

    /// Writes what the figure sees of the ground.
    #[inline(always)]
    fn observe_ahead<T: Real>(s: &Senses<T>, out: &mut Obs<T>) {
        let [x, y, z] = s.position(F::EYES);
        let clipped = |ground: T| (ground - z).max(T::lit(-SIGHT)).min(T::lit(SIGHT));
        for (group, places) in F::SIGHTS {
            out.group(group);
            for place in *places {
                out.scalar(clipped(s.ground_near(F::EYES, *place)));
            }
        }
        if F::IN_SPACE {
            return;
        }
        out.group("ground_ahead");
        for i in 0..SEEN {
            out.scalar(clipped(s.ground_height(x + T::lit(i as f64 * SPACING - BEHIND), y)));
        }
        out.group("phase");
        let cells = x * T::lit(1.0 / SPACING);
        out.scalar(cells - cells.floor());
    }

    /// Lanes that have made no new meter for too long.
    #[inline(always)]
    fn stuck<T: Real>(s: &Senses<T>, memory: &[T]) -> T::Mask {
        T::lit(PATIENCE / s.dt()).lt(memory[SINCE])
    }

    /// Lanes that have made no new meter for too long, or have come to the end of the course or to within 0.2 m of its edge.
    #[inline(always)]
    fn stopped<T: Real>(s: &Senses<T>, memory: &[T]) -> T::Mask {
        let stuck = Self::stuck(s, memory);
        let aside = s.position(F::TORSO)[1].abs();
        let through = T::or(T::lit(TO - 1.0).lt(memory[AT]), T::lit(F::HALF_WIDTH - EDGE).lt(aside));
        T::or(stuck, through)
    }
}

impl<F: Runner> Agent for Terrain<F> {
    fn facts(&self) -> Facts {
        let own = self.figure.facts();
        let reward = self.arguments.reward;
        let mut terms = match reward {
            Reward::Full => names(F::TERMS.iter().chain(&["pain"])),
            Reward::Velocity => names(["velocity"]),
            Reward::Sparse => names(["distance"]),
        };
        let (mut actions, mut roles, mut fall_penalty) = (own.actions.clone(), Vec::new(), None);
        let mut max_episode_steps = own.max_episode_steps;
        if reward == Reward::Full {
            fall_penalty = Some(F::FALL);
        }
        if self.built() {
            if fall_penalty.take().is_some() {
                terms.push("fall".into());
            }
            let ahead = match (self.arguments.heights, F::IN_SPACE) {
                (true, false) => vec!["ground_ahead", "phase"],
                (true, true) => F::SIGHTS.iter().map(|(group, _)| *group).collect(),
                (false, _) => Vec::new(),
            };
            let seen = [F::BODY, &["foot_heights"], &ahead].concat();
            let others = self.others();
            roles = builder::roles([&actions, &others], &seen, &terms, self.regrets());
            actions.extend(others);
            terms.extend(roles.iter().skip(1).flat_map(|role| role.reward_terms.clone()));
            if self.regrets() {
                max_episode_steps *= 2;
            }
        }
        Facts {
            id: F::ID.into(),
            summary: F::SUMMARY.into(),
            model: self.model().into(),
            observation: None,
            actions,
            reward_terms: terms,
            roles,
            info: names(["distance", "difficulty"]),
            metrics: names(["forward", "difficulty"]),
            memory: F::MEMORY + self.course_memory(),
            max_episode_steps,
            termination_reward: fall_penalty,
            ..own
        }
    }

    fn options(&self) -> Vec<OptionInfo> {
        self.arguments.infos()
    }

    fn with_options(&self, options: &Options) -> Option<Self> {
        Some(Terrain { figure: self.figure.clone(), arguments: self.arguments.with(options) })
    }

    fn reset(&self, start: &mut Start) {
        let TerrainArguments { difficulty: Share(most), levels, .. } = self.arguments;
        if let Some(teacher) = self.teacher() {
            let (previous, memory) = (&start.previous[F::MEMORY..], &mut start.memory[F::MEMORY..]);
            let (course, difficulty) = teacher.draw(previous, memory, start.random);
            (memory[LEVEL], memory[DIFFICULTY]) = (1.0, difficulty);
            let field = course::extend(&course, Some(difficulty), Self::ROWS, start.random);
            start.set_ground(0, field);
            return self.figure.place(start);
        }
        let course = self.arguments.course();
        let level = match levels {
            Levels::Random => start.random.uniform(0.0, 1.0),
            Levels::Distance => distance::next_level(&start.previous[F::MEMORY..]),
            _ => 1.0,
        };
        let difficulty = level * most;
        let field = course.field(difficulty, Self::ROWS, start.random);
        start.set_ground(0, field);
        self.figure.place(start);
        start.memory[F::MEMORY + LEVEL] = level;
        start.memory[F::MEMORY + DIFFICULTY] = difficulty;
    }

    fn command(&self, random: &mut EpisodeRng, step: usize, out: &mut [f64]) -> usize {
        self.figure.tell(random, step, out)
    }

    #[inline(always)]
    fn ctrl<T: Real>(&self, c: &mut Ctrl<T>) {
        if !self.regrets() {
            return self.figure.ctrl(c);
        }
        // the figure does what the reference wants, once that has the motors
        let second = regret::runs(&c.memory[F::MEMORY..]);
        let mut action = [T::zero(); MOST_MOTORS];
        let action = &mut action[..c.action.len()];
        action.copy_from_slice(c.action);
        for (own, theirs) in action.iter_mut().zip(&c.action[F::MOTORS..]).take(F::MOTORS) {
            *own = T::select(second, *theirs, *own);
        }
        let Ctrl { ctrl, memory, command, qpos, qvel, dt, reference, .. } = c;
        self.figure.ctrl(&mut Ctrl { action, ctrl, memory, command, qpos, qvel, dt: *dt, reference: *reference });
    }

    #[inline(always)]
    fn begin<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let (own, memory) = memory.split_at_mut(F::MEMORY);
        self.figure.begin(s, own);
        F::aim(own);
        let [x, ..] = s.position(F::TORSO);
        for slot in [AT, FARTHEST, MARK] {
            memory[slot] = x;
        }
        memory[DUE] = T::lit(1.0);
        if self.teacher().is_some() {
            plan::begin(memory);
        }
    }

    #[inline(always)]
    fn remember<T: Real>(&self, s: &Senses<T>, memory: &mut [T]) {
        let (own, memory) = memory.split_at_mut(F::MEMORY);
        self.figure.remember(s, own);
        let (zero, one) = (T::zero(), T::lit(1.0));
        let [x, ..] = s.position(F::TORSO);
        let from = std::mem::replace(&mut memory[AT], x);
        memory[FARTHEST] = memory[FARTHEST].max(x);
        let new = (memory[MARK] + one).lt(x);
        memory[MARK] = T::select(new, memory[MARK] + one, memory[MARK]);
        memory[DUE] = T::masked(new, one);
        memory[SINCE] = T::select(new, zero, memory[SINCE] + one);
        let lies = T::masked(self.figure.terminated(s), one);
        memory[HIT] = (lies - memory[LIES]).max(zero);
        memory[LIES] = lies;
        memory[HURT] = memory[HURT].max(lies);
        if self.regrets() {
            let ended = [self.failed(memory), Self::stopped(s, memory)];
            let begins = regret::remember(memory, ended, s.dt());
            self.begin_again(s, own, begins);
        }
        if self.teacher().is_some() {
            plan::remember(memory, from, Self::stuck(s, memory), s.dt());
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        self.figure.observe_body(s, out);
        out.group("foot_heights");
        for foot in F::SOLES {
            let [x, y, z] = s.position(*foot);
            out.scalar(z - s.ground_height(x, y));
        }
        if self.arguments.heights {
            Self::observe_ahead(s, out);
        }
        if self.built() {
            builder::observe::<F, T>(s, self.regrets(), out);
        }
    }
    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        let memory = Self::course(s);
        match self.arguments.reward {
            Reward::Full => {
                self.figure.add_terms(s, T::lit(1.0) - memory[HURT], self.hard(s), terms);
                terms.add("pain", PAIN, memory[HIT]);
                if self.built() {
                    terms.add("fall", F::FALL, T::masked(self.failed(memory), T::lit(1.0)));
                }
            }
            Reward::Velocity => terms.add("velocity", 1.0, s.normalized_velocity(F::TORSO, FASTEST)),
            Reward::Sparse => {
                let over = T::or(self.terminated(s), T::or(self.truncated(s), s.time_is_up()));
                let over = T::or(over, self.handed_over(s));
                terms.add("distance", 1.0, T::masked(over, memory[FARTHEST] * T::lit(1.0 / WAY)));
            }
        }
        if self.regrets() {
            let theirs = terms.keep(T::not(regret::runs(memory)));
            let earned = terms.sum();
            terms.add(regret::REGRET, 1.0, theirs - earned);
            terms.add(regret::REFERENCE, 1.0, theirs);
        } else if self.built() {
            let earned = terms.sum();
            terms.add(builder::EARNED, -1.0, earned);
        }
    }

    fn build(&self, site: &mut Site) {
        if !(self.regrets() && regret::restart(site, F::MEMORY)) {
            builder::build(site, F::MEMORY);
        }
    }

    #[inline(always)]
    fn builds<T: Real>(&self, memory: &[T]) -> T::Mask {
        if !self.built() {
            return T::none();
        }
        let memory = &memory[F::MEMORY..];
        let due = T::lit(0.5).lt(memory[DUE]);
        match self.regrets() {
            // what the adversary decides about the second run comes to nothing
            true => T::or(T::and(due, T::not(regret::runs(memory))), regret::is_due(memory)),
            false => due,
        }
    }

    #[inline(always)]
    fn decides<T: Real>(&self, s: &Senses<T>, role: usize) -> T::Mask {
        let memory = Self::course(s);
        match role {
            0 if self.regrets() => T::not(T::or(regret::runs(memory), regret::is_due(memory))),
            0 => T::not(T::none()),
            1 => T::lit(0.5).lt(memory[DUE]),
            _ => regret::runs(memory),
        }
    }

    #[inline(always)]
    fn leaves<T: Real>(&self, s: &Senses<T>, role: usize) -> [T::Mask; 2] {
        let over = if role == 0 { self.handed_over(s) } else { T::none() };
        let failed = self.failed(Self::course(s));
        [T::and(over, failed), T::and(over, T::not(failed))]
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let memory = Self::course(s);
        let failed = self.failed(memory);
        if self.regrets() { T::and(failed, regret::runs(memory)) } else { failed }
    }

    #[inline(always)]
    fn truncated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        let memory = Self::course(s);
        let stopped = Self::stopped(s, memory);
        match self.regrets() {
            true => T::and(regret::is_over(memory, stopped, s.dt()), regret::runs(memory)),
            false => stopped,
        }
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        let memory = Self::course(s);
        out.scalar(if self.regrets() { regret::way(memory) } else { memory[FARTHEST] });
        out.scalar(memory[DIFFICULTY]);
    }
}

//! Agents under given commands, and their motion.

use crate::error::RunError;
use crate::play::Play;
use crate::task_config::TaskConfig;
use glam::DVec3;
use marathon_envs::{Autoreset, VecEnvOptions, registry};
use marathon_learn::{EvalOptions, Policy};
use marathon_motion::kinematics::Pose;
use marathon_physics::Model;
use marathon_physics::model::JointType;
use std::f64::consts::{PI, TAU};

/// Metric of a task with the error of the velocity.
const ERROR: &str = "velocity_error";

/// Motion of an agent in a decision.
pub struct Moment {
    /// Position of the center of mass along the ground, m.
    pub at: [f64; 2],
    /// Height of its center of mass, m.
    pub height: f64,
    /// Whether a foot touched the ground.
    pub grounded: bool,
    /// Direction of the root's x axis along the ground, rad, without jumps by 2 pi. 0 for planar characters.
    pub heading: f64,
    /// Forward speed of the center of mass, m/s.
    pub speed: f64,
    /// Mean speed of the bodies' centers of mass, m/s.
    pub parts: f64,
    /// Distance between actual and commanded velocity, m/s.
    pub error: f64,
    /// The observed command.
    pub command: Vec<f64>,
    pub qpos: Vec<f64>,
}

/// Motion of an agent that had not fallen before.
pub struct Track {
    /// Index of the agent.
    pub agent: usize,
    pub moments: Vec<Moment>,
    /// Whether it fell, including falls from which it gets up.
    pub fallen: bool,
}

/// Last pose of an agent.
struct Place {
    centers: Vec<DVec3>,
    com: DVec3,
    heading: f64,
}

/// Agents in simulation.
pub struct Trial<'a> {
    play: Play<'a>,
    model: Model,
    /// The free body. `None` for planar characters.
    root: Option<usize>,
    /// Index of the speed in the command.
    speed: usize,
    /// Index of the task's error metric.
    error: Option<usize>,
    /// Index of the task's metric for getting up. `None` if a fall ends the episode.
    rising: Option<usize>,
    /// Last pose of each agent. `None` for agents that fell.
    places: Vec<Option<Place>>,
}

impl<'a> Trial<'a> {
    /// Creates agents at the start of an episode that only a fall ends. `speed` is the index of the speed in the
    /// command.
    pub fn new(
        task_config: &TaskConfig,
        policy: &'a Policy,
        options: &EvalOptions,
        speed: usize,
    ) -> Result<Self, RunError> {
        let vec_options = VecEnvOptions {
            agents: options.episodes,
            seed: options.seed,
            threads: options.threads,
            autoreset: Autoreset::Disabled,
            max_episode_steps: Some(usize::MAX),
            ..VecEnvOptions::default()
        };
        let play = Play::of(task_config, &[policy], &vec_options)?;
        let error = play.spec().info.iter().position(|name| name == ERROR);
        let rising = play.spec().rising();
        let model = registry::agent(&task_config.agent)?.model()?;
        let root = free(&model);
        let place = |agent| Ok(Some(Place::of(&model, root, &play.qpos(agent)?, 0.0)));
        let places = (0..options.episodes).map(place).collect::<Result<_, RunError>>()?;
        Ok(Trial { play, model, root, speed, error, rising, places })
    }

    /// Seconds between decisions.
    pub fn dt(&self) -> f64 {
        self.play.spec().dt
    }

    /// The character's model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Number of agents.
    pub fn agents(&self) -> usize {
        self.places.len()
    }

    /// Sets the command of each agent.
    pub fn command(&mut self, command: impl Fn(usize) -> Vec<f64>) -> Result<(), RunError> {
        (0..self.agents()).try_for_each(|agent| self.play.set_command(agent, Some(&command(agent))))
    }

    /// Simulates some seconds.
    pub fn play(&mut self, seconds: f64) -> Result<Vec<Track>, RunError> {
        let standing = (0..self.agents()).filter(|agent| self.places[*agent].is_some());
        let mut tracks: Vec<Track> =
            standing.map(|agent| Track { agent, moments: Vec::new(), fallen: false }).collect();
        for _ in 0..(seconds / self.dt()).round() as usize {
            self.play.decide();
            self.play.step()?;
            for track in tracks.iter_mut().filter(|track| !track.fallen) {
                let (step, agent) = (self.play.last(), track.agent);
                track.fallen = step.terminated[agent] || step.diverged[agent] || self.rises(agent);
                if track.fallen {
                    self.places[agent] = None;
                } else {
                    track.moments.push(self.look(agent)?);
                }
            }
        }
        Ok(tracks)
    }

    /// Simulates some seconds in which each agent's root is pushed. The impulse gives the character's mass a velocity,
    /// m/s, in a direction along the ground, rad. Planar characters are pushed forward and backward.
    pub fn pushed(
        &mut self,
        seconds: f64,
        velocity: f64,
        direction: impl Fn(usize) -> f64,
    ) -> Result<Vec<Track>, RunError> {
        let mass: f64 = self.model.bodies.iter().map(|body| body.mass).sum();
        let (planar, body) = (self.root.is_none(), self.root.unwrap_or(1));
        for agent in 0..self.agents() {
            let angle = if planar { (agent % 2) as f64 * PI } else { direction(agent) };
            let force = mass * velocity / seconds;
            let force = [force * libm::cos(angle), if planar { 0.0 } else { force * libm::sin(angle) }, 0.0];
            self.play.push(agent, body, force)?;
        }
        let tracks = self.play(seconds)?;
        (0..self.agents()).try_for_each(|agent| self.play.push(agent, body, [0.0; 3]))?;
        Ok(tracks)
    }

    /// Whether characters get up after a fall.
    pub fn can_rise(&self) -> bool {
        self.rising.is_some()
    }

    /// Whether an agent is getting up.
    fn rises(&self, agent: usize) -> bool {
        let step = self.play.last();
        let infos = self.play.spec().info.len();
        self.rising.is_some_and(|i| step.info[agent * infos + i] > 0.5)
    }

    /// Simulates some seconds. Returns the time until standing for each agent that falls or lies, s; infinite if it
    /// does not get up.
    pub fn rise(&mut self, seconds: f64) -> Result<Vec<f64>, RunError> {
        let (n, dt) = (self.agents(), self.dt());
        let (mut since, mut times) = (vec![None; n], vec![None; n]);
        for decision in 0..(seconds / dt).round() as usize {
            self.play.decide();
            self.play.step()?;
            for agent in 0..n {
                let given_up = self.play.last().terminated[agent] || self.play.last().diverged[agent];
                let rises = self.rises(agent) && !given_up;
                if given_up && since[agent].is_some() {
                    times[agent].get_or_insert(f64::INFINITY);
                }
                match (since[agent], rises) {
                    (None, true) => since[agent] = Some(decision),
                    (Some(from), false) => {
                        times[agent].get_or_insert((decision - from) as f64 * dt);
                    }
                    _ => {}
                }
            }
        }
        let fell = since.iter().zip(&times).filter(|(since, _)| since.is_some());
        Ok(fell.map(|(_, time)| time.unwrap_or(f64::INFINITY)).collect())
    }

    /// Gives all agents a number of commands for some seconds each. Returns the number of agents that stand in the end.
    pub fn up(
        &mut self,
        commands: usize,
        seconds: f64,
        command: impl Fn(usize) -> Vec<f64>,
    ) -> Result<usize, RunError> {
        let mut gone = vec![false; self.agents()];
        for turn in 0..commands {
            self.command(|_| command(turn))?;
            for _ in 0..(seconds / self.dt()).round() as usize {
                self.play.decide();
                self.play.step()?;
                let last = self.play.last();
                for (gone, ended) in gone.iter_mut().zip(last.terminated.iter().zip(&last.diverged)) {
                    *gone |= *ended.0 || *ended.1;
                }
            }
        }
        Ok((0..gone.len()).filter(|agent| !gone[*agent] && !self.rises(*agent)).count())
    }

    /// Motion of an agent since the last call.
    fn look(&mut self, agent: usize) -> Result<Moment, RunError> {
        let (qpos, dt) = (self.play.qpos(agent)?, self.dt());
        let before = self.places[agent].as_ref();
        let now = Place::of(&self.model, self.root, &qpos, before.map_or(0.0, |place| place.heading));
        let old = before.unwrap_or(&now);
        let velocity = (now.com - old.com) / dt;
        let speed = velocity.x * libm::cos(now.heading) + velocity.y * libm::sin(now.heading);
        let ways = now.centers.iter().zip(&old.centers).map(|(a, b)| a.distance(*b));
        let parts = ways.sum::<f64>() / (now.centers.len() as f64 * dt);
        let command = self.play.command(agent)?;
        let asked = command[self.speed];
        let infos = self.play.spec().info.len();
        let told = self.error.map(|i| f64::from(self.play.last().info[agent * infos + i]));
        let moment = Moment {
            at: [now.com.x, now.com.y],
            height: now.com.z,
            grounded: self.play.feet(agent)? != 0,
            heading: now.heading,
            speed,
            parts,
            error: told.unwrap_or((speed - asked).abs()),
            command,
            qpos,
        };
        self.places[agent] = Some(now);
        Ok(moment)
    }
}

/// The free body.
fn free(model: &Model) -> Option<usize> {
    let has = |body: &marathon_physics::model::Body| {
        model.joints[body.joint_start..body.joint_start + body.joint_count].iter().any(|j| j.kind == JointType::Free)
    };
    model.bodies.iter().position(has)
}

impl Place {
    /// The pose of a configuration of a model with this root. The heading is the equivalent angle nearest to `near`.
    fn of(model: &Model, root: Option<usize>, qpos: &[f64], near: f64) -> Place {
        let pose = Pose::of(model, qpos);
        let (mut com, mut mass, mut centers) = (DVec3::ZERO, 0.0, Vec::new());
        for (i, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass > 0.0 && body.weld_id != 0) {
            let center = pose.point(i, DVec3::from_array(body.ipos));
            com += body.mass * center;
            mass += body.mass;
            centers.push(center);
        }
        let heading = root.map_or(0.0, |root| {
            let forward = pose.quat[root] * DVec3::X;
            let angle = libm::atan2(forward.y, forward.x);
            angle + TAU * ((near - angle) / TAU).round()
        });
        Place { centers, com: com / mass.max(f64::MIN_POSITIVE), heading }
    }
}

//! Time of the stages of a step. `cargo bench -p marathon-physics --bench stages`, with a part of a name to choose.
//!
//! A group of agents runs the workload of `marathon bench physics`; its states at a few moments, with everything computed
//! for them, are kept. An iteration runs one stage on all of them, so the processor cannot learn one state by heart.
//! Times are those of the best instruction set that the processor has; `item/s` counts agents.

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use marathon_physics::lanes::{Isa, Real};
use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{HField, Kind, ModelSpec};
use marathon_physics::workload::HOLD;
use marathon_physics::{Group, Model, Sim, SimOptions, Stage, Work, with_lanes};

/// States that an iteration runs over.
const STATES: usize = 8;
/// Steps before the first state, and between two.
const WARMUP: usize = 200;
const BETWEEN: usize = 20;

const HOPPER: &str = include_str!("../../../assets/agents/hopper.xml");
const HUMANOID: &str = include_str!("../../../assets/agents/humanoid.xml");
const MARATHON_MAN: &str = include_str!("../../../assets/agents/marathon_man.xml");
const SCENES: [Scene; 5] =
    [Scene::Hopper, Scene::Humanoid, Scene::SelfCollision, Scene::HeightField, Scene::MarathonMan];

fn main() {
    divan::main();
}

/// A model and what it stands on.
#[derive(Clone, Copy)]
enum Scene {
    Hopper,
    Humanoid,
    SelfCollision,
    HeightField,
    MarathonMan,
}

impl std::fmt::Display for Scene {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Scene::Hopper => "hopper",
            Scene::Humanoid => "humanoid",
            Scene::SelfCollision => "humanoid, self-collision",
            Scene::HeightField => "humanoid, height field",
            Scene::MarathonMan => "marathon man",
        })
    }
}

impl Scene {
    fn model(self) -> Model {
        self.edited().and_then(|spec| spec.compile()).expect("the model is valid")
    }

    fn edited(self) -> Result<ModelSpec, MjcfError> {
        let text = match self {
            Scene::Hopper => HOPPER,
            Scene::MarathonMan => MARATHON_MAN,
            Scene::Humanoid | Scene::SelfCollision | Scene::HeightField => HUMANOID,
        };
        let mut spec = ModelSpec::from_xml_str(text, &self.to_string())?;
        match self {
            Scene::SelfCollision => {
                spec.default_mut("main", "geom")?.set("conaffinity", 1)?;
            }
            Scene::HeightField => {
                spec.get_mut(Kind::Geom, "floor")?.unset("size")?.set("type", "hfield")?.set("hfield", "hills")?;
                spec.add(hills())?;
            }
            Scene::Hopper | Scene::Humanoid | Scene::MarathonMan => {}
        }
        Ok(spec)
    }
}

/// Hills of 10 cm on a grid of 25 cm, 24 m wide.
fn hills() -> HField {
    let n = 97;
    let bump = |i: usize, period: usize| (i % period).min(period - i % period) as f64 / (period / 2) as f64;
    let heights: Vec<f64> = (0..n * n).map(|i| (500.0 * (bump(i / n, 6) + bump(i % n, 8))).round() / 1000.0).collect();
    HField::new("hills", n, n, [12.0, 12.0, 0.1, 0.2]).elevation(&heights)
}

/// States of a group on their way, each with what the step computed for it.
struct Moments<T: Real> {
    sim: Sim<T>,
    states: Vec<(Group<T>, Work<T>)>,
}

impl<T: Real> Moments<T> {
    fn new(scene: Scene) -> Self {
        let model = scene.model();
        let sim = Sim::<T>::new(&model, SimOptions::default()).expect("the model can be simulated");
        let (mut group, mut work) = (Group::new(&sim), Work::new(&sim));
        let mut seed = 1u64;
        let mut advance = |steps: usize, group: &mut Group<T>, work: &mut Work<T>| {
            for _ in 0..steps / HOLD {
                for u in &mut group.ctrl {
                    for lane in 0..T::LANES {
                        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                        u.set(lane, T::scalar((seed >> 40) as f64 / f64::from(1 << 23) - 1.0));
                    }
                }
                sim.step(work, group, HOLD);
            }
        };
        advance(WARMUP, &mut group, &mut work);
        let mut states = Vec::new();
        for _ in 0..STATES {
            advance(BETWEEN, &mut group, &mut work);
            sim.forward(&mut work, &group);
            states.push((group.clone(), work.clone()));
        }
        Self { sim, states }
    }

    fn agents() -> ItemsCount {
        ItemsCount::new(STATES * T::LANES)
    }

    fn time(mut self, bencher: Bencher<'_, '_>, stage: Stage) {
        bencher.counter(Self::agents()).bench_local(|| {
            for (group, work) in &mut self.states {
                self.sim.run_stage(stage, black_box(work), black_box(group));
            }
        });
    }
}

/// Kinematics, velocities and applied forces.
#[divan::bench(args = SCENES)]
fn a_smooth(bencher: Bencher<'_, '_>, scene: Scene) {
    with_lanes!(Isa::best(), T => Moments::<T>::new(scene).time(bencher, Stage::Smooth));
}

/// Collision detection and the rows of all constraints.
#[divan::bench(args = SCENES)]
fn b_constraints(bencher: Bencher<'_, '_>, scene: Scene) {
    with_lanes!(Isa::best(), T => Moments::<T>::new(scene).time(bencher, Stage::MakeConstraint));
}

/// Constrained acceleration.
#[divan::bench(args = SCENES)]
fn c_solver(bencher: Bencher<'_, '_>, scene: Scene) {
    with_lanes!(Isa::best(), T => Moments::<T>::new(scene).time(bencher, Stage::FwdConstraint));
}

/// Damping at the end of the step, and integration.
#[divan::bench(args = SCENES)]
fn d_finish(bencher: Bencher<'_, '_>, scene: Scene) {
    with_lanes!(Isa::best(), T => finish::<T>(bencher, scene));
}

fn finish<T: Real>(bencher: Bencher<'_, '_>, scene: Scene) {
    let Moments { sim, states } = Moments::<T>::new(scene);
    let (groups, mut works): (Vec<_>, Vec<_>) = states.into_iter().unzip();
    // it moves the state, so every iteration has states of its own
    bencher.counter(Moments::<T>::agents()).with_inputs(|| groups.clone()).bench_local_refs(|groups| {
        for (group, work) in groups.iter_mut().zip(&mut works) {
            sim.finish_step(black_box(work), group);
        }
    });
}

/// All of it: what the four cost together.
#[divan::bench(args = SCENES)]
fn whole_step(bencher: Bencher<'_, '_>, scene: Scene) {
    with_lanes!(Isa::best(), T => whole::<T>(bencher, scene));
}

fn whole<T: Real>(bencher: Bencher<'_, '_>, scene: Scene) {
    let Moments { sim, states } = Moments::<T>::new(scene);
    let (groups, mut works): (Vec<_>, Vec<_>) = states.into_iter().unzip();
    bencher.counter(Moments::<T>::agents()).with_inputs(|| groups.clone()).bench_local_refs(|groups| {
        for (group, work) in groups.iter_mut().zip(&mut works) {
            sim.forward(black_box(work), group);
            sim.finish_step(work, group);
        }
    });
}

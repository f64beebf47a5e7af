//! Every number of an observation belongs to a named group, and the metrics of a task are found by name.

use std::sync::Arc;

use marathon_envs::{
    Agent, BLOCK, BlockStep, Facts, MetricSource, Obs, Part, Registry, Senses, Spec, Terms, factory, ids, names,
};
use marathon_physics::lanes::{Isa, Real};

/// Names and lengths of the groups.
fn parts(spec: &Spec) -> Vec<(&str, usize)> {
    spec.observations.iter().map(|group| (group.name.as_str(), group.range.len())).collect()
}

fn spec(id: &str) -> Spec {
    factory(id, Isa::F32).unwrap_or_else(|e| panic!("{e}")).spec().clone()
}

#[test]
fn the_parts_of_every_observation_are_all_of_it() {
    for id in ids() {
        let spec = spec(&id);
        let mut end = 0;
        for (i, group) in spec.observations.iter().enumerate() {
            assert_eq!(group.range.start, end, "{id}: {group:?}");
            assert!(!group.range.is_empty() && group.name != "observation", "{id}: {group:?}");
            assert!(spec.observations[..i].iter().all(|other| other.name != group.name), "{id}: {group:?}");
            end = group.range.end;
        }
        assert_eq!(end, spec.obs, "{id}");
    }
}

#[test]
fn parts_are_called_as_everybody_calls_them() {
    assert_eq!(
        parts(&spec("Hopper-v0")),
        [
            ("velocity", 3),
            ("forward", 3),
            ("up", 3),
            ("touch", 1),
            ("joint_rotations", 16),
            ("joint_velocities", 4),
            ("foot_height", 1)
        ]
    );
    assert_eq!(parts(&spec("Ant-v5")), [("qpos", 13), ("qvel", 14), ("cfrc_ext", 78)]);
    assert_eq!(parts(&spec("hopper-stand-v0")), [("position", 6), ("velocity", 7), ("touch", 2)]);
    let humanoid = [
        ("joint_angles", 21),
        ("head_height", 1),
        ("extremities", 12),
        ("torso_vertical", 3),
        ("com_velocity", 3),
        ("velocity", 27),
    ];
    assert_eq!(parts(&spec("humanoid-run-v0")), humanoid);
}

/// A ball with a motor that reports the groups and metrics of its fields.
#[derive(Clone)]
struct Talker {
    groups: [Option<&'static str>; 3],
    metrics: Vec<String>,
}

const MODEL: &str = r#"
<mujoco>
  <worldbody>
    <body name="ball"><joint name="x" type="slide" axis="1 0 0"/><geom name="ball" size="0.1"/>
      <body name="arm"><joint name="turn" axis="0 1 0"/><geom name="arm" size="0.05" pos="0.3 0 0"/></body>
    </body>
  </worldbody>
  <actuator><motor name="turn" joint="turn"/></actuator>
</mujoco>"#;

impl Agent for Talker {
    fn facts(&self) -> Facts {
        Facts {
            id: "Talker-v0".into(),
            model: MODEL.into(),
            reward_terms: names(["speed"]),
            info: names(["spin", "place"]),
            metrics: self.metrics.clone(),
            parts: names(["ball"]),
            ..Facts::default()
        }
    }

    #[inline(always)]
    fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        for (i, group) in self.groups.iter().enumerate() {
            if let Some(name) = group {
                out.group(name);
            }
            for _ in 0..i {
                out.scalar(s.readings().qpos(0));
            }
            out.scalar(s.readings().qvel(1));
        }
    }

    #[inline(always)]
    fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
        terms.add("speed", 1.0, s.velocity(Part::named(&["ball"], "ball")));
    }

    #[inline(always)]
    fn info<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
        out.scalar(s.readings().qvel(1));
        out.scalar(s.readings().qpos(0));
    }

    #[inline(always)]
    fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
        s.terminate_never()
    }
}

fn talker(groups: [Option<&'static str>; 3], metrics: &[&str]) -> Result<Registry, String> {
    let mut registry = Registry::empty();
    let talker = Talker { groups, metrics: names(metrics) };
    registry.register(Arc::new(talker)).map_err(|e| e.to_string())?;
    Ok(registry)
}

fn spoken(groups: [Option<&'static str>; 3]) -> Result<Spec, String> {
    let shards = talker(groups, &["forward"])?.shards("talker", Isa::F32).map_err(|e| e.to_string())?;
    Ok(shards.spec().clone())
}

#[test]
fn numbers_without_a_name_are_called_observation() {
    let spec = spoken([None, None, None]).expect("names are not needed");
    assert_eq!(parts(&spec), [("observation", 6)]);
    let spec = spoken([None, Some("middle"), Some("end")]).expect("some have names");
    assert_eq!(parts(&spec), [("observation", 1), ("middle", 2), ("end", 3)]);
    let spec = spoken([Some("start"), None, Some("end")]).expect("some have names");
    assert_eq!(parts(&spec), [("start", 3), ("end", 3)]);
    let error = spoken([Some("same"), None, Some("same")]).expect_err("which is meant?");
    assert!(error.contains("two parts of its observation are called 'same'"), "{error}");
}

#[test]
fn a_metric_is_found_by_its_name() {
    let error = talker([None; 3], &["forward", "spni"]).err().expect("there is no such number");
    assert!(
        error.contains(r#"its metric 'spni' is neither 'forward' nor one of its infos ["spin", "place"]"#),
        "{error}"
    );

    let registry = talker([None; 3], &["place", "forward"]).unwrap_or_else(|e| panic!("{e}"));
    let shards = registry.shards("talker", Isa::F32).unwrap_or_else(|e| panic!("{e}"));
    let mut shard = shards.shard(0, 1, 1);
    let spec = shard.spec().clone();
    let named: Vec<_> = spec.metrics.iter().map(|metric| (metric.name.as_str(), metric.source)).collect();
    assert_eq!(named, [("place", MetricSource::Info(1)), ("forward", MetricSource::Forward)]);
    let mut obs = vec![0.0; spec.obs * BLOCK];
    shard.reset(0, !0, &mut obs);
    let mut out = BlockStep::default();
    let mut before = [0.0; BLOCK];
    for decision in 0..5 {
        shard.step(0, &[1.0; BLOCK], &mut obs, &mut out);
        let [place, forward] = [&spec.metrics[0], &spec.metrics[1]].map(|metric| out.metric(metric));
        assert_eq!(place, &obs[BLOCK..2 * BLOCK]);
        assert!(forward.iter().all(|x| *x != 0.0), "it moves");
        for lane in 0..BLOCK {
            let moved = place[lane] - before[lane];
            assert!(decision == 0 || (forward[lane] - moved).abs() < 1e-6, "{} {moved}", forward[lane]);
        }
        before.copy_from_slice(place);
    }
    // a task that cannot move along x has no distance metric
    assert!(spec_metrics("InvertedPendulum-v5").is_empty());
    assert_eq!(spec_metrics("Hopper-v0"), ["forward"]);
    assert_eq!(spec_metrics("cheetah-run-v0"), ["forward", "speed"]);
}

fn spec_metrics(id: &str) -> Vec<String> {
    spec(id).metrics.into_iter().map(|metric| metric.name).collect()
}

//! Agents are found by id, alias and base name. The error for a wrong name contains the closest right one.

use std::sync::Arc;

use marathon_envs::{Registry, Spec, agents, registry};
use marathon_physics::lanes::Isa;

fn id(name: &str) -> String {
    Registry::default().agent(name).map_or_else(|e| e.to_string(), |a| a.facts().id.to_string())
}

#[test]
fn names_are_found_by_id_alias_and_base() {
    assert_eq!(id("Hopper-v0"), "Hopper-v0");
    assert_eq!(id("hopper-V1"), "Hopper-v1");
    assert_eq!(id("hopper"), "Hopper-v0");
    assert_eq!(id("walker"), "Walker2d-v0");
    assert_eq!(id("ANT"), "Ant-v0");
    assert_eq!(id("ant-v5"), "Ant-v5");
    assert_eq!(id("swimmer"), "Swimmer-v5");
    assert_eq!(id("Walker-Run"), "walker-run-v0");
    assert_eq!(id("dm_control/hopper-hop-v0"), "hopper-hop-v0");
}

#[test]
fn an_unknown_name_gets_the_nearest_ones() {
    let count = registry::ids().len();
    let similar = |name: &str, near: &str, five: &str| {
        let expected = format!("agent '{name}' does not exist{near}; the most similar of {count}: {five}");
        assert_eq!(id(name), expected);
    };
    let five = "Hopper-v0, Hopper-v1, Hopper-v5, hopper-hop-v0, hopper-stand-v0";
    similar("hoper", "; did you mean 'Hopper-v0'?", five);
    let five = "Humanoid-v0, Humanoid-v1, Humanoid-v5, humanoid-run-v0, humanoid-walk-v0";
    similar("Humanoid-v3", "; did you mean 'Humanoid-v0'?", five);
    assert!(!id("walking").contains("did you mean"), "{}", id("walking"));
    assert_eq!(id("walking").rsplit(", ").count(), 5);
    // nothing is like it
    assert_eq!(id("elephant"), format!("agent 'elephant' does not exist; `marathon list` lists all {count}"));
}

#[test]
fn a_path_that_is_no_model_says_so() {
    let expected = "expected the name of an agent, or a model in MJCF with the ending .xml";
    let (folder, file) = (env!("CARGO_MANIFEST_DIR"), concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"));
    assert_eq!(id(folder), format!("'{folder}' is a folder, {expected}"));
    assert_eq!(id(file), format!("'{file}' is a file, {expected}"));
    assert_eq!(id("dog.urdf"), format!("'dog.urdf' is a file that does not exist, {expected}; MuJoCo converts URDF"));
}

#[test]
fn every_alias_leads_to_an_agent() {
    for (alias, name) in agents::aliases() {
        assert_eq!(id(alias), name);
    }
}

#[test]
fn a_name_is_registered_once() {
    let mut registry = Registry::default();
    let error = registry.register(Arc::new(agents::marathon::ant::AntV0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "agent 'Ant-v0' is registered already; give the new one another id, such as 'Ant-v2'"
    );
}

mod with_arguments {
    use std::sync::Arc;

    use marathon_envs::options::OptionSet;
    use marathon_envs::{
        Agent, EnvError, Facts, Obs, OptionInfo, Options, Registry, Senses, Terms, Value, VecEnv, VecEnvOptions, names,
    };
    use marathon_physics::lanes::{Isa, Real};

    marathon_envs::options! {
        /// A cart with commands.
        struct Cart {
            /// Price of the effort.
            effort_weight: f64 = 0.5,
            /// Whether the observation includes its position.
            see_position: bool = true,
            /// Allowed positions.
            range: [f64; 2] = [-1.0, f64::INFINITY],
            /// Physics steps per decision.
            frame_skip: usize = 2,
        }
    }

    impl Agent for Cart {
        fn facts(&self) -> Facts {
            let model = r#"<mujoco><worldbody><body><joint name="x" type="slide" axis="1 0 0" damping="1"/>
                <geom size="0.1"/></body></worldbody><actuator><motor joint="x"/></actuator></mujoco>"#;
            Facts {
                id: "Cart-v3".into(),
                model: model.into(),
                frame_skip: self.frame_skip,
                reward_terms: names(["effort"]),
                ..Facts::default()
            }
        }
        #[inline(always)]
        fn observe<T: Real>(&self, s: &Senses<T>, out: &mut Obs<T>) {
            if self.see_position {
                out.scalar(s.readings().qpos(0));
            }
            out.scalar(s.readings().qvel(0));
        }
        #[inline(always)]
        fn step_reward<T: Real>(&self, s: &Senses<T>, terms: &mut Terms<T>) {
            terms.add("effort", -self.effort_weight, s.action(0) * s.action(0));
        }
        #[inline(always)]
        fn terminated<T: Real>(&self, s: &Senses<T>) -> T::Mask {
            let x = s.readings().qpos(0);
            T::or(x.lt(T::lit(self.range[0])), T::lit(self.range[1]).lt(x))
        }
        fn options(&self) -> Vec<OptionInfo> {
            self.infos()
        }
        fn with_options(&self, options: &Options) -> Option<Self> {
            Some(self.with(options))
        }
    }

    fn registry() -> Registry {
        let mut registry = Registry::default();
        registry.register(Arc::new(Cart::default())).unwrap();
        registry
    }

    fn refusal(name: &str, options: &Options) -> String {
        registry().agent_with(name, options).map(|_| ()).unwrap_err().to_string()
    }

    #[test]
    fn arguments_change_the_agent() {
        let options = Options::new().with("effort_weight", 2.0).with("see_position", false).with("frame_skip", 5.0);
        let options = VecEnvOptions { options, isa: Some(Isa::F64), ..Default::default() };
        let mut env = VecEnv::from_registry(&registry(), "cart", &options).unwrap();
        assert_eq!((env.spec().obs, env.spec().frame_skip), (1, 5));
        assert_eq!(env.spec().options.get("effort_weight"), Some(&2.0.into()));
        assert_eq!(env.spec().options.get("range"), Some(&[-1.0, f64::INFINITY].into()));
        let mut step = env.buffers();
        env.reset(None, &mut step.obs).unwrap();
        env.step(&[0.5], &mut step).unwrap();
        assert_eq!(step.reward, [-0.5]);
    }

    #[test]
    fn an_unknown_argument_gets_the_nearest_and_the_list() {
        assert_eq!(
            refusal("cart", &Options::new().with("efort_weight", 1.0)),
            "agent 'Cart-v3' takes no option 'efort_weight'; did you mean 'effort_weight'? \
             known: effort_weight, see_position, range, frame_skip"
        );
        assert_eq!(
            refusal("hopper", &Options::new().with("effort_weight", 1.0)),
            "agent 'Hopper-v0' takes no option 'effort_weight'; it has no options"
        );
    }

    #[test]
    fn a_value_of_the_wrong_type_is_refused() {
        let cases: [(&str, Value, &str); 5] = [
            ("effort_weight", true.into(), "option effort_weight is true, expected a number"),
            ("range", 1.0.into(), "option range is 1, expected two numbers, the lower one first"),
            ("range", [2.0, 1.0].into(), "option range is (2, 1), expected two numbers, the lower one first"),
            ("frame_skip", 2.5.into(), "option frame_skip is 2.5, expected a whole number, 0 or more"),
            ("see_position", "yes".into(), "option see_position is 'yes', expected true or false"),
        ];
        for (name, value, complaint) in cases {
            let mut options = Options::new();
            options.set(name, value);
            assert_eq!(refusal("cart", &options), format!("agent 'Cart-v3': {complaint}"));
        }
        // valid by itself, invalid for the agent
        let error = registry().shards_with("cart", &Options::new().with("frame_skip", 0.0), Isa::F32).map(|_| ());
        assert!(matches!(error, Err(EnvError::Agent { .. })));
    }
}

#[test]
fn an_agent_at_another_pace_has_episodes_of_as_many_seconds() {
    let own = registry::factory("hopper", Isa::F32).unwrap();
    let (spec, every) = (own.spec(), registry::factory_every("hopper", 1, Isa::F32).unwrap());
    let seconds = |spec: &Spec| spec.dt * spec.max_episode_steps as f64;
    assert_eq!((every.spec().frame_skip, every.spec().max_episode_steps), (1, 4000));
    assert!((every.spec().dt * 4.0 - spec.dt).abs() < 1e-15 && (seconds(every.spec()) - seconds(spec)).abs() < 1e-9);
    let refused = registry::factory_every("hopper", 0, Isa::F32).err().unwrap().to_string();
    assert!(refused.contains("frame_skip is 0, expected at least 1"), "{refused}");
}

//! Agents are found by id, alias and base name; a wrong name is answered with the nearest right one.

use std::sync::Arc;

use marathon_envs::{Registry, agents};

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
}

#[test]
fn an_unknown_name_gets_the_nearest_and_the_list() {
    let known = "known: Hopper-v0, Hopper-v1, Walker2d-v0, Walker2d-v1, Humanoid-v0, Humanoid-v1, Ant-v0, Ant-v1";
    assert_eq!(id("hoper"), format!("agent 'hoper' does not exist; did you mean 'Hopper-v0'? {known}"));
    assert_eq!(id("Humanoid-v3"), format!("agent 'Humanoid-v3' does not exist; did you mean 'Humanoid-v0'? {known}"));
    assert_eq!(id("elephant"), format!("agent 'elephant' does not exist; {known}"));
}

#[test]
fn a_name_is_registered_once() {
    let mut registry = Registry::default();
    let error = registry.register(Arc::new(agents::ant::AntV0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "agent 'Ant-v0' is registered already; give the new one another id, such as 'Ant-v2'"
    );
}

//! Inspectors and scenes read and write components through reflection. Each component that an app spawns is registered. Plain data
//! becomes a component.

use crate::common;
use bevy::ecs::reflect::ReflectComponent;
use bevy::prelude::*;
use bevy::reflect::structs::DynamicStruct;
use bevy::reflect::{TypePath, TypeRegistry};
use bevy_marathon::prelude::*;
use std::time::Duration;

fn registry(app: &App) -> impl std::ops::Deref<Target = TypeRegistry> + '_ {
    app.world().resource::<AppTypeRegistry>().read()
}

#[test]
fn every_component_that_an_app_spawns_is_registered() {
    let app = common::app(Duration::from_millis(10));
    let registry = registry(&app);
    for path in [
        Ragdoll::type_path(),
        CharacterPolicy::type_path(),
        Opponent::type_path(),
        Controls::type_path(),
        Held::type_path(),
        AgentCommand::type_path(),
        LaidGround::type_path(),
        Target::type_path(),
        Physique::type_path(),
        RagdollMode::type_path(),
        LimbStrength::type_path(),
        HitReactions::type_path(),
        Restart::type_path(),
        Episode::type_path(),
        CharacterPose::type_path(),
        OwnGround::type_path(),
        Part::type_path(),
    ] {
        let registration = registry.get_with_type_path(path);
        assert!(registration.is_some_and(|registration| registration.data::<ReflectComponent>().is_some()), "{path}");
    }
}

#[test]
fn a_field_that_is_edited_by_its_path_changes_the_component() {
    let mut app = common::app(Duration::from_millis(10));
    let ragdoll = app.world_mut().spawn((Ragdoll::agent("hopper"), Restart::default())).id();
    // a character joins the simulation within its first frames
    while app.world().get::<Anatomy>(ragdoll).is_none() {
        app.update();
    }
    let model = app.world().get::<Anatomy>(ragdoll).expect("it is simulated").model.clone();
    app.world_mut().entity_mut(ragdoll).insert(Physique(Variation::none(&model)));
    let mut restart = app.world_mut().get_mut::<Restart>(ragdoll).expect("it was spawned");
    *restart.path_mut::<f64>("after_fall").expect("it has the field") = 2.0;
    assert_eq!(*restart, Restart { after_fall: 2.0, on_time_up: true });
    let mut physique = app.world_mut().get_mut::<Physique>(ragdoll).expect("it was inserted");
    *physique.path_mut::<f64>(".0.gravity[2]").expect("it has the field") = -1.0;
    assert_eq!(physique.0.gravity[2], -1.0);
    let mut ragdoll = app.world_mut().get_mut::<Ragdoll>(ragdoll).expect("it was spawned");
    *ragdoll.path_mut::<String>("character.0").expect("it has the field") = "ant".into();
    assert_eq!(ragdoll.character, Character::Agent("ant".into()));
}

/// This is how a scene file becomes entities.
#[test]
fn plain_data_becomes_a_character_that_runs() {
    let mut app = common::app(Duration::from_millis(10));
    let ragdoll = Ragdoll::agent("hopper").with_seed(3, 1).on(Ground::Hills);
    let mut data: DynamicStruct = ragdoll.to_dynamic_struct();
    data.set_represented_type(None);
    let entity = app.world_mut().spawn_empty().id();
    let types = app.world().resource::<AppTypeRegistry>().clone();
    let registry = types.read();
    let component = registry.get_type_data::<ReflectComponent>(std::any::TypeId::of::<Ragdoll>());
    let component = component.expect("it is registered").clone();
    component.insert(&mut app.world_mut().entity_mut(entity), &data, &registry);
    let made = app.world().get::<Ragdoll>(entity).expect("it was inserted");
    assert_eq!((&made.character, made.seed, made.number, made.ground), (&ragdoll.character, 3, 1, Ground::Hills));
    (0..20).for_each(|_| app.update());
    assert!(app.world().get::<Episode>(entity).is_some_and(|episode| episode.decisions > 0));
}

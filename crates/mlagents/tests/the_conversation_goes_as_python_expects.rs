//! The conversation follows Python's expectations. An initial message without behaviors and a request come first. Each
//! command is answered with one info per agent, and one more for each ended episode. Behaviors are described once. Any
//! mismatch ends the conversation with an error that says what was found and expected.

use crate::common::{FakeTrainer, close, listen, reset, step};
use marathon_mlagents::wire::{AgentInfo, AgentInfoList, UnityMessage};
use marathon_mlagents::{BehaviorOptions, Log, Player, PlayerError, PlayerOptions, Turn};
use prost::Message;
use std::thread;

const NAME: &str = "Hopper-v0?team=0";
const AGENTS: usize = 5;

/// Runs a conversation between a trainer and a player of a few hoppers, whose episodes last four decisions.
fn converse(fresh_ids: bool, trainer: impl FnOnce(FakeTrainer) + Send + 'static) -> Result<Vec<Turn>, PlayerError> {
    let (port, accept) = listen();
    let trainer = thread::spawn(move || trainer(accept()));
    let behavior = BehaviorOptions { agents: AGENTS, max_episode_steps: Some(4), ..Default::default() };
    let options = PlayerOptions { port, behaviors: vec![behavior], fresh_ids, ..Default::default() };
    let mut turns = Vec::new();
    let result = Player::connect(&options, Log::to_stderr()).and_then(|mut player| {
        loop {
            let turn = player.advance()?;
            turns.push(turn);
            if turn == Turn::Closed {
                return Ok(());
            }
        }
    });
    trainer.join().expect("the trainer is content");
    result.map(|()| turns)
}

/// Infos of the hoppers, those of ended episodes last, and whether the behavior was described.
fn infos(message: &UnityMessage) -> (Vec<AgentInfo>, bool) {
    let output = message.output.as_ref().expect("an output");
    let bytes = &output.rl.as_ref().expect("infos").agent_infos[NAME];
    let mut list = AgentInfoList::decode(&bytes[..]).expect("a list").value;
    list.sort_by_key(|info| info.done);
    (list, output.initialization.is_some())
}

#[test]
fn orders_are_obeyed() {
    let turns = converse(false, |mut trainer| {
        let hello = trainer.greet(7, 1).output.and_then(|o| o.initialization).expect("who it is");
        assert_eq!((hello.name.as_str(), hello.communication_version.as_str()), ("AcademySingleton", "1.5.0"));
        assert!(hello.brain_parameters.is_empty() && hello.capabilities.is_some_and(|c| c.base_rl && c.hybrid_actions));

        trainer.answer(&reset(Vec::new()));
        let first = trainer.receive().expect("first observations");
        let brains = &first.output.as_ref().unwrap().initialization.as_ref().unwrap().brain_parameters;
        assert_eq!(brains.len(), 1);
        assert_eq!(brains[0].brain_name, NAME);
        assert_eq!(brains[0].action_spec.as_ref().unwrap().num_continuous, 4);
        let (start, _) = infos(&first);
        assert_eq!(start.iter().map(|info| info.id).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        for info in &start {
            let seen = &info.observations[0];
            assert_eq!((&seen.shape[..], seen.float_data.as_ref().unwrap().data.len()), (&[31][..], 31));
            assert!(!info.done && info.reward == 0.0);
        }

        for decision in 1..=4 {
            trainer.answer(&step(NAME, AGENTS, &[0.1; 4]));
            let (now, introduced) = infos(&trainer.receive().expect("a decision"));
            assert!(!introduced);
            let (living, ended) = now.split_at(AGENTS);
            assert!(living.iter().all(|info| !info.done));
            if decision < 4 {
                assert!(ended.is_empty() && living.iter().all(|info| info.reward != 0.0));
                continue;
            }
            // all episodes end by time, and the next begin in the same message
            assert_eq!(ended.len(), AGENTS);
            for (old, new) in ended.iter().zip(living) {
                assert!(old.done && old.max_step_reached && old.reward != 0.0 && old.id == new.id && new.reward == 0.0);
                assert_ne!(old.observations, new.observations);
            }
        }
        // a reset within episodes: no ends, and other starts than the first
        trainer.answer(&step(NAME, AGENTS, &[0.1; 4]));
        trainer.receive().expect("a decision");
        trainer.answer(&reset(Vec::new()));
        let (anew, _) = infos(&trainer.receive().expect("new observations"));
        assert!(anew.len() == AGENTS && anew.iter().zip(&start).all(|(a, b)| a.observations != b.observations));
        trainer.answer(&close());
        assert_eq!(trainer.receive(), None);
    });
    let step = Turn::Step;
    assert_eq!(turns.unwrap(), [Turn::Reset, step, step, step, step, step, Turn::Reset, Turn::Closed]);
}

#[test]
fn fresh_ids_change_with_every_episode() {
    let turns = converse(true, |mut trainer| {
        trainer.greet(7, 2);
        trainer.answer(&reset(Vec::new()));
        assert_eq!(infos(&trainer.receive().unwrap()).0.len(), 2 * AGENTS);
        for _ in 0..4 {
            trainer.answer(&step(NAME, 2 * AGENTS, &[0.0; 4]));
            let (now, _) = infos(&trainer.receive().unwrap());
            if now.len() > 2 * AGENTS {
                let ids = |part: &[AgentInfo]| part.iter().map(|info| info.id).collect::<Vec<_>>();
                assert_eq!(ids(&now[2 * AGENTS..]), (0..10).collect::<Vec<_>>());
                assert_eq!(ids(&now[..2 * AGENTS]), (10..20).collect::<Vec<_>>());
            }
        }
        trainer.answer(&close());
    });
    assert!(turns.is_ok());
}

#[test]
fn what_does_not_fit_is_an_error() {
    let fails = |order: UnityMessage| {
        let result = converse(false, move |mut trainer| {
            trainer.greet(1, 1);
            trainer.answer(&reset(Vec::new()));
            trainer.receive();
            trainer.answer(&order);
            trainer.receive();
        });
        result.unwrap_err().to_string()
    };
    assert_eq!(fails(step(NAME, 4, &[0.0; 4])), format!("received 4 actions of 4 numbers for {NAME}, expected 5 of 4"));
    assert_eq!(fails(step(NAME, 5, &[0.0; 3])), format!("received 5 actions of 3 numbers for {NAME}, expected 5 of 4"));
    let mut odd = reset(Vec::new());
    odd.input.as_mut().unwrap().rl.as_mut().unwrap().command = 9;
    assert!(fails(odd).contains("a command that is none of"));
    let gone = converse(false, |mut trainer| {
        trainer.greet(1, 1);
    });
    assert!(gone.unwrap_err().to_string().contains("the connection broke"));
}

#[test]
fn nonsense_in_side_channels_does_not_end_a_training() {
    let turns = converse(false, |mut trainer| {
        trainer.greet(1, 1);
        trainer.answer(&reset(vec![1, 2, 3]));
        assert_eq!(infos(&trainer.receive().unwrap()).0.len(), AGENTS);
        // no actions
        let mut idle = step(NAME, 0, &[]);
        idle.input.as_mut().unwrap().rl.as_mut().unwrap().agent_actions.clear();
        trainer.answer(&idle);
        assert_eq!(infos(&trainer.receive().unwrap()).0.len(), AGENTS);
        trainer.answer(&close());
    });
    assert_eq!(turns.unwrap(), [Turn::Reset, Turn::Step, Turn::Closed]);
}

//! Rollback, as in fighting games over a network: a peer does not wait for the other player's input. It predicts the input,
//! and when it arrives and differs, it restores the tick that it belongs to and plays again from there.
//!
//! `cargo run --release -p bevy_marathon --example rollback`
//!
//! Two players steer a man each. The peer has its own input at once, and the other player's [`DELAY`] ticks later. A referee
//! has both at once. In the end, the peer has the bits of the referee.

use bevy::prelude::*;
use bevy_marathon::prelude::*;
use std::collections::VecDeque;

/// Ticks that an input is under way: 94 ms.
const DELAY: u64 = 6;

/// Buttons of a player in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Input {
    speed: f64,
    turn: f64,
    jump: bool,
    flip: bool,
}

impl Input {
    /// The buttons of a player, who presses others about three times a second.
    fn pressed(player: u64, tick: u64) -> Self {
        let choice = (tick / 20).wrapping_mul(0x9e37_79b9).wrapping_add(player * 77) >> 3;
        Input {
            speed: [0.0, 1.0, 2.0, 3.0][choice as usize % 4],
            turn: [-1.0, 0.0, 0.0, 1.0][(choice / 4) as usize % 4],
            jump: choice % 5 == 1 && tick % 20 < 5,
            flip: choice % 7 == 2 && tick % 20 < 5,
        }
    }
}

/// A simulation of the game.
struct Peer {
    app: App,
    players: [Entity; 2],
}

/// A tick that a peer can return to.
struct Saved {
    marathon: MarathonSnapshot,
    clock: Time<Fixed>,
    commands: [AgentCommand; 2],
}

impl Peer {
    fn new(policy: marathon_learn::Policy) -> Result<Self, CommandError> {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default(), MarathonPlugin));
        app.finish();
        app.cleanup();
        let policy = CharacterPolicy(app.world_mut().resource_mut::<Assets<PolicyAsset>>().add(policy));
        let spawn =
            |i| app.world_mut().spawn((Ragdoll::agent("MarathonManController").with_seed(1, i), policy.clone())).id();
        let mut peer = Peer { players: [0, 1].map(spawn), app };
        // the first tick builds the characters
        peer.tick([Input::default(); 2])?;
        Ok(peer)
    }

    /// Runs a tick with these inputs.
    fn tick(&mut self, inputs: [Input; 2]) -> Result<(), CommandError> {
        let world = self.app.world_mut();
        for (player, input) in self.players.iter().zip(inputs) {
            // it has none before its first tick
            let Some(mut command) = world.get_mut::<AgentCommand>(*player).filter(|c| !c.ranges().is_empty()) else {
                continue;
            };
            command.set("speed", input.speed)?;
            command.set("turn", input.turn)?;
            command.set("jump", f64::from(u8::from(input.jump)))?;
            command.set("backflip", f64::from(u8::from(input.flip)))?;
        }
        let mut clock = world.resource_mut::<Time<Fixed>>();
        let timestep = clock.timestep();
        clock.advance_by(timestep);
        let time = clock.as_generic();
        world.insert_resource(time);
        world.run_schedule(FixedUpdate);
        Ok(())
    }

    fn save(&mut self) -> Saved {
        let world = self.app.world_mut();
        Saved {
            marathon: world.resource_mut::<Marathon>().save_all(),
            clock: *world.resource::<Time<Fixed>>(),
            commands: self.players.map(|player| world.get::<AgentCommand>(player).cloned().unwrap_or_default()),
        }
    }

    fn restore(&mut self, saved: &Saved) -> Result<(), SnapshotError> {
        let world = self.app.world_mut();
        world.resource_mut::<Marathon>().restore_all(&saved.marathon)?;
        world.insert_resource(saved.clock);
        for (player, command) in self.players.iter().zip(&saved.commands) {
            world.entity_mut(*player).insert(command.clone());
        }
        Ok(())
    }
}

/// Result of a game.
#[derive(Debug)]
pub struct Outcome {
    /// Ticks whose prediction was wrong.
    pub rollbacks: u64,
    /// Ticks that were played again.
    pub replayed: u64,
    /// Whether the peer ended with the bits of the referee.
    pub same_bits: bool,
}

/// Plays so many ticks of 1/64 s.
pub fn play(ticks: u64) -> Result<Outcome, Box<dyn std::error::Error>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/policies/MarathonManController.safetensors");
    let policy = marathon_learn::Policy::load(file.as_ref())?;
    let (mut referee, mut peer) = (Peer::new(policy.clone())?, Peer::new(policy)?);
    // the ticks that are not confirmed yet: their start, and the inputs that were used
    let mut ahead: VecDeque<(Saved, [Input; 2])> = VecDeque::new();
    let mut known = Input::default();
    let (mut rollbacks, mut replayed) = (0, 0);
    for tick in 0..ticks + DELAY {
        // the last inputs arrive after the last tick
        let playing = tick < ticks;
        if playing {
            referee.tick([0, 1].map(|player| Input::pressed(player, tick)))?;
        }
        // the input of an earlier tick arrives
        if tick >= DELAY {
            known = Input::pressed(1, tick - DELAY);
            let Some((start, [_, predicted])) = ahead.pop_front() else { continue };
            if known != predicted {
                rollbacks += 1;
                peer.restore(&start)?;
                peer.tick([Input::pressed(0, tick - DELAY), known])?;
                for (saved, [own, other]) in &mut ahead {
                    *saved = peer.save();
                    *other = known;
                    peer.tick([*own, known])?;
                    replayed += 1;
                }
            }
        }
        if playing {
            // predicted: as it was last
            let inputs = [Input::pressed(0, tick), known];
            ahead.push_back((peer.save(), inputs));
            peer.tick(inputs)?;
        }
    }
    let same_bits = peer.save().marathon.checksum() == referee.save().marathon.checksum();
    Ok(Outcome { rollbacks, replayed, same_bits })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Outcome { rollbacks, replayed, same_bits } = play(1280)?;
    println!("20 s: {rollbacks} rollbacks, {replayed} ticks played again");
    println!("the peer has {} as the referee", if same_bits { "the same bits" } else { "other bits" });
    Ok(())
}

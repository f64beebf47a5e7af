//! A run whose rollouts are played elsewhere gives the bits of one that plays them itself, for any number of players,
//! even if players are lost and replaced. An abandoned run keeps what it learned. Invalid answers are refused.

use crate::common::{PuckTask, silent, small_config};
use marathon_learn::{
    A2c, Algorithm, Checkpoint, Control, Deliver, IterationStats, LrSchedule, Novelty, Player, Players, RewardConfig,
    RewardKind, TrainConfig, TrainOutput, train_with,
};
use marathon_physics::lanes::Isa;

const LIMIT: usize = 20;

/// Players in this process that answer in reverse order.
struct Team {
    config: TrainConfig,
    slices: usize,
    players: Vec<Option<Player>>,
    /// Rollouts played.
    rollouts: usize,
    /// The player that is lost, and the rollout after which it is lost.
    losses: Vec<(usize, usize)>,
    /// The rollout before which all players fail.
    until: usize,
}

impl Team {
    fn new(config: &TrainConfig, slices: usize) -> Self {
        let players = (0..config.run.blocks()).map(|_| None).collect();
        Team { config: config.clone(), slices, players, rollouts: 0, losses: Vec::new(), until: usize::MAX }
    }
    fn player(&self, i: usize, slices: usize) -> Player {
        Player::new(&PuckTask::with_limit(LIMIT), Isa::best(), &self.config, (i, slices)).unwrap()
    }
}

impl Players for Team {
    fn slices(&self) -> usize {
        self.slices
    }
    fn play(&mut self, orders: &[u8], states: &[Vec<u8>], deliver: Deliver<'_>) -> Control {
        if self.rollouts == self.until {
            return Control::Stop;
        }
        for (i, state) in states.iter().enumerate().rev() {
            let mut player = self.players[i].take().unwrap_or_else(|| self.player(i, states.len()));
            let mut answer = player.play(orders, state).unwrap();
            if self.losses.contains(&(i, self.rollouts)) {
                player = self.player(i, states.len());
                answer = player.play(orders, state).unwrap();
            }
            self.players[i] = Some(player);
            deliver(i, &answer).unwrap();
        }
        self.rollouts += 1;
        Control::Continue
    }
}

fn run(players: Option<&mut dyn Players>, config: &TrainConfig, resume: Option<Checkpoint>) -> TrainOutput {
    train_with(players, &PuckTask::with_limit(LIMIT), Isa::best(), config, resume, &mut silent).unwrap()
}

fn bits(output: &TrainOutput) -> Vec<u32> {
    let policy = &output.policy;
    let numbers = policy.params().iter().chain(policy.log_std()).chain(policy.normalizer().mean());
    numbers.chain(policy.normalizer().std()).map(|x| x.to_bits()).collect()
}

/// The values that do not depend on time.
fn numbers(stats: Option<&IterationStats>) -> IterationStats {
    let stats = stats.unwrap().clone();
    IterationStats { wall_seconds: 0.0, cpu_seconds: 0.0, env_share: 0.0, update_share: 0.0, ..stats }
}

#[test]
fn players_do_not_change_the_policy() {
    let want = run(None, &small_config(), None);
    // five blocks: more players than blocks are too many
    for (slices, threads) in [(1, 1), (2, 1), (3, 2), (5, 3), (9, 1)] {
        let config = small_config().with(|c| c.run.threads = threads);
        let got = run(Some(&mut Team::new(&config, slices)), &config, None);
        assert_eq!(bits(&got), bits(&want), "{slices} players, {threads} threads");
        assert_eq!(numbers(got.last.as_ref()), numbers(want.last.as_ref()));
    }
}

#[test]
fn rewards_for_novelty_are_played_elsewhere_too() {
    let kinds = [RewardKind::Curiosity, RewardKind::Rnd];
    let kinds = kinds.map(|kind| kind(Novelty { hidden: vec![11, 7], ..Default::default() }));
    let rewards = kinds.map(|kind| RewardConfig { strength: 0.1, ..RewardConfig::new(kind) });
    let config = small_config().with(|c| c.rewards.extend(rewards));
    let want = run(None, &config, None);
    let got = run(Some(&mut Team::new(&config, 3)), &config, None);
    assert_eq!(bits(&got), bits(&want));
    assert_eq!(numbers(got.last.as_ref()), numbers(want.last.as_ref()));
}

#[test]
fn iterations_of_several_rollouts_can_be_given_up_halfway() {
    let config = small_config().with(|c| {
        c.algorithm = Algorithm::A2c(A2c { lr_schedule: LrSchedule::Constant, ..Default::default() });
        c.run.rollouts = 2;
    });
    let want = run(None, &config, None);
    let mut team = Team::new(&config, 2);
    team.until = 3;
    let half = run(Some(&mut team), &config, None);
    assert_eq!(half.checkpoint.iteration(), 3);
    assert_eq!(bits(&run(None, &config, Some(half.checkpoint))), bits(&want));
}

#[test]
fn lost_players_change_nothing() {
    let want = run(None, &small_config(), None);
    let config = small_config();
    let mut team = Team::new(&config, 2);
    team.losses = vec![(0, 0), (1, 1), (0, 2), (1, 2), (1, 3)];
    assert_eq!(bits(&run(Some(&mut team), &config, None)), bits(&want));
}

#[test]
fn a_run_that_is_given_up_goes_on_anywhere() {
    let want = run(None, &small_config(), None);
    let config = small_config();
    let mut team = Team::new(&config, 2);
    team.until = 2;
    let half = run(Some(&mut team), &config, None);
    assert_eq!(half.checkpoint.iteration(), 2);
    assert_eq!(bits(&run(None, &config, Some(half.checkpoint.clone()))), bits(&want));
    assert_eq!(bits(&run(Some(&mut Team::new(&config, 3)), &config, Some(half.checkpoint))), bits(&want));
}

/// Players whose answers are corrupted by `spoil`, which gets the answers of all slices.
struct Spoilt<F>(Team, F);

impl<F: FnMut(&mut Vec<Vec<u8>>)> Players for Spoilt<F> {
    fn slices(&self) -> usize {
        2
    }
    fn play(&mut self, orders: &[u8], states: &[Vec<u8>], deliver: Deliver<'_>) -> Control {
        let mut answers: Vec<Vec<u8>> =
            states.iter().enumerate().map(|(i, s)| self.0.player(i, 2).play(orders, s).unwrap()).collect();
        (self.1)(&mut answers);
        for (i, answer) in answers.iter().enumerate() {
            if let Err(error) = deliver(i, answer) {
                assert!(error.to_string().contains("marathon-rollout"), "{error}");
                return Control::Stop;
            }
        }
        Control::Continue
    }
}

#[test]
fn answers_that_do_not_fit_are_refused() {
    let config = small_config();
    let task = PuckTask::with_limit(LIMIT);
    let spoilt = |spoil: &mut dyn FnMut(&mut Vec<Vec<u8>>)| {
        let mut players = Spoilt(Team::new(&config, 2), spoil);
        train_with(Some(&mut players), &task, Isa::best(), &config, None, &mut silent)
    };
    // refused by `deliver`: the run ends without learning
    for spoil in [
        &mut (|a: &mut Vec<Vec<u8>>| a[0].truncate(1000)) as &mut dyn FnMut(&mut Vec<Vec<u8>>),
        &mut |a| a.swap(0, 1),
        &mut |a| a[1].clear(),
    ] {
        assert_eq!(spoilt(spoil).unwrap().checkpoint.iteration(), 0);
    }
    let error = spoilt(&mut |a| a.truncate(1)).err().unwrap().to_string();
    assert!(error.contains("1 slices, expected those of 2"), "{error}");
}

#[test]
fn players_refuse_what_is_not_theirs() {
    let (task, config) = (PuckTask::with_limit(LIMIT), small_config());
    let error = Player::new(&task, Isa::best(), &config, (2, 2)).err().unwrap().to_string();
    assert!(error.contains("slice 2 of 2, expected a slice below their number, and at most 5"), "{error}");
    let sac = TrainConfig::sac();
    let error = Player::new(&task, Isa::best(), &sac, (0, 1)).err().unwrap().to_string();
    assert!(error.contains("the trainer sac, expected ppo, a2c or acktr"), "{error}");
    let mut player = Player::new(&task, Isa::best(), &config, (0, 2)).unwrap();
    let error = player.play(b"", b"").unwrap_err().to_string();
    assert!(error.contains("marathon-orders: header"), "{error}");
}

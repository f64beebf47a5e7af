"""Training on many processes or machines with Ray, and the environments for RLlib.

`train` is `marathon_rl.train` with its rollouts played by Ray's workers:

    >>> import marathon_rl.ray
    >>> result = marathon_rl.ray.train("Humanoid-v5", workers=8)

The policy has the bits of a run on one machine: it depends on the task, the configuration and the seed, not on the
number of workers, nor on whether some of them were lost on the way.

`register` makes every task known to RLlib:

    >>> marathon_rl.ray.register()
    >>> config = PPOConfig().environment("marathon_rl/Hopper-v5")

Needs Ray: `pip install marathon-rl[ray]`, for RLlib `pip install marathon-rl[rllib]`.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
import numpy.typing as npt

from marathon_rl import registration
from marathon_rl._native import Player, TrainResult, ids
from marathon_rl._native import train as native_train
from marathon_rl.env import MarathonEnv
from marathon_rl.vector import MarathonVectorEnv

try:
    import ray
    from ray.exceptions import RayError, RayTaskError
except ImportError as error:
    raise ImportError("marathon_rl.ray needs Ray, which is not here: pip install 'marathon-rl[ray]'") from error

__all__ = ["Workers", "register", "train"]

Bytes = npt.NDArray[np.uint8]

# losses without an answer in between, for each worker, after which there is no hope
_PATIENCE = 3


class Workers:
    """Ray actors that play the rollouts of a training run, each of them one slice of its agents.

    An actor that is lost, with its process or its machine, is replaced, and the new one plays the lost part again: from
    the same state, with the same policy and random numbers. So is one that stops answering. An exception in an actor is
    no loss and ends the run.
    """

    def __init__(self, count: int, *, answer_timeout: float | None = 600.0, **options: Any) -> None:
        """Prepare `count` actors.

        Args:
            count: number of actors; at most one per sixteen agents is used.
            answer_timeout: longest time that an actor may take for a rollout, s; None means any time. One that takes
                longer is replaced. If its replacement does too, the run ends with a `TimeoutError`. The time in which
                an actor waits for free processors counts.
            **options: arguments of `ray.remote` for an actor, such as `num_cpus` (default: 1) or `resources`.
        """
        if count < 1:
            raise ValueError(f"count is {count}, expected at least 1")
        if answer_timeout is not None and not 0 < answer_timeout < float("inf"):
            raise ValueError(f"answer_timeout is {answer_timeout}, expected a number of seconds above 0, or None")
        self._count = count
        self._timeout = answer_timeout
        self._actor = ray.remote(**{"num_cpus": 1, **options})(_Actor)
        self._actors: list[Any] = []
        self._run = ("", "")
        self.replaced = 0
        """Actors that were lost and replaced."""

    def begin(self, task: str, config: str) -> int:
        """Take note of a run; the native trainer calls it."""
        self.close()
        self._run = (task, config)
        return self._count

    def play(self, orders: Bytes, states: list[Bytes]) -> Iterator[tuple[int, Bytes]]:
        """Have one rollout played: for each state, yield the number of its slice and the answer, as they come in.

        The native trainer calls it.
        """
        slices = len(states)
        self._actors += [self._make(i, slices) for i in range(len(self._actors), slices)]
        shared = ray.put(orders)
        asked = time.monotonic()
        # slice and time of each pending request, the oldest first; and slices whose actor was late
        pending = {self._actors[i].play.remote(shared, state): (i, asked) for i, state in enumerate(states)}
        late: set[int] = set()
        losses = 0
        while pending:
            oldest, (i, asked) = next(iter(pending.items()))
            left = None if self._timeout is None else max(asked + self._timeout - time.monotonic(), 0.0)
            done, _ = ray.wait(list(pending), num_returns=1, timeout=left)
            if not done:
                if i in late:
                    raise TimeoutError(
                        f"worker {i} of {slices} has not answered for {self._timeout:g} s, nor had the one before it: "
                        "they hang, wait for free processors, or need more time for a rollout "
                        "(Workers(..., answer_timeout=...))"
                    )
                late.add(i)
                del pending[oldest]
                pending[self._again(i, slices).play.remote(shared, states[i])] = (i, time.monotonic())
                continue
            i, _ = pending.pop(done[0])
            try:
                answer = ray.get(done[0])
            except RayTaskError:
                raise
            except RayError as error:
                losses += 1
                if losses > _PATIENCE * slices:
                    raise RuntimeError(f"{losses} of {slices} workers were lost one after another") from error
                pending[self._again(i, slices).play.remote(shared, states[i])] = (i, time.monotonic())
            else:
                losses = 0
                yield i, answer

    def kill(self, i: int) -> None:
        """Kill an actor, as an accident would: for rehearsals."""
        ray.kill(self._actors[i])

    def close(self) -> None:
        """End the actors."""
        for actor in self._actors:
            ray.kill(actor)
        self._actors.clear()

    def _again(self, i: int, slices: int) -> Any:
        """Replace an actor."""
        self.replaced += 1
        ray.kill(self._actors[i])
        self._actors[i] = self._make(i, slices)
        return self._actors[i]

    def _make(self, i: int, slices: int) -> Any:
        return self._actor.remote(*self._run, i, slices)


class _Actor:
    """Code that runs in a worker's process."""

    def __init__(self, task: str, config: str, slice: int, slices: int) -> None:
        self._player = Player(task, config, slice, slices)

    def play(self, orders: Bytes, state: Bytes) -> Bytes:
        return self._player.play(orders, state)


def train(
    task: str | None = None,
    config: str | PathLike[str] | dict[str, Any] | None = None,
    *,
    workers: int | Workers = 2,
    callback: Callable[[dict[str, float | None]], bool | None] | None = None,
    progress: bool = True,
    seed: int | None = None,
    steps: int | None = None,
    num_envs: int | None = None,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    resume: str | PathLike[str] | None = None,
    initialize_from: str | PathLike[str] | None = None,
    **options: Any,
) -> TrainResult:
    """Train as `marathon_rl.train` does, with rollouts played by Ray's workers; the policy has the same bits.

    Connect to a cluster with `ray.init(address=...)` before; otherwise Ray starts one on this machine. The package must
    be installed on the machines of the cluster, in the same version.

    Args:
        task: its name.
        config: a file, or a dictionary with the same keys, such as `{"ppo": {"lr": 3e-4}}`; the task's preset holds for
            what it leaves out.
        workers: number of workers, or prepared `Workers`, which are left open.
        callback: called after every iteration with its numbers, as in `marathon_rl.train`.
        progress: show how far the run is, as in `marathon_rl.train`.
        seed: seed of everything random.
        steps: steps of all agents together.
        num_envs: number of agents, a multiple of 16. Many of them make up for the time that messages take.
        threads: threads of the learner, which waits while the workers play and plays the final evaluation; 0 means one
            per processor core.
        out: a new folder for everything that the command ``marathon train`` writes; None means that nothing is written.
        resume: the folder of a run to go on with, in place of a task and a configuration. It may have been begun
            without Ray, and may go on without.
        initialize_from: a policy to start from in place of random weights, a file or the folder of a run.
        **options: options of the task, see `marathon_rl.spec(task).options`.
    """
    players = workers if isinstance(workers, Workers) else Workers(workers)
    try:
        return native_train(
            task,
            config,
            callback=callback,
            progress=progress,
            seed=seed,
            steps=steps,
            num_envs=num_envs,
            threads=threads,
            out=out,
            resume=resume,
            initialize_from=initialize_from,
            players=players,
            **options,
        )
    finally:
        if players is not workers:
            players.close()


def register() -> None:
    """Make every task known to RLlib as `marathon_rl/<id>`, as to Gymnasium.

    `env_config` has arguments of the environment, such as `{"ctrl_cost_weight": 0.01}` for `Hopper-v5`. With
    `env_runners(num_envs_per_env_runner=N, gym_env_vectorize_mode="vector_entry_point")`, an env runner steps its N
    agents at once and natively; RLlib's default steps them one after another.
    """
    try:
        from ray.tune.registry import register_env  # noqa: PLC0415
    except ImportError as error:
        raise ImportError("RLlib is not here: pip install 'marathon-rl[rllib]'") from error
    for task in ids():
        register_env(f"{registration.NAMESPACE}/{task}", _creator(task))


def _creator(task: str) -> Callable[[Mapping[str, Any]], Any]:
    """Return a creator of environments of a task for RLlib, with many agents if `num_envs` is among the arguments."""

    def create(arguments: Mapping[str, Any]) -> gymnasium.Env[Any, Any] | MarathonVectorEnv:
        options = dict(arguments)
        num_envs = options.pop("num_envs", None)
        return MarathonEnv(task, **options) if num_envs is None else MarathonVectorEnv(task, num_envs, **options)

    return create

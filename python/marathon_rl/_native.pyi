"""Native part of marathon_rl."""

from collections.abc import Callable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal, Self, final

import numpy as np
import numpy.typing as npt

from marathon_rl.agents import MarathonAgent

__all__ = [
    "Clip",
    "CommandRange",
    "Model",
    "Player",
    "Policy",
    "Renderer",
    "Simulation",
    "Spec",
    "TrainResult",
    "VecEnv",
    "Viewer",
    "__version__",
    "_check_size",
    "_clip",
    "_count",
    "_limits",
    "_mask",
    "_policy",
    "_seeds",
    "_spec",
    "_train_result",
    "evaluate",
    "ids",
    "load_policy",
    "main",
    "spec",
    "train",
]

__version__: str

@final
class Clip:
    """A motion clip as a value of the option ``clip``: ``VecEnv("MarathonMan-v0", clip=clip)``."""

    def __new__(
        cls,
        model: Model,
        qpos: npt.ArrayLike,
        dt: float,
        *,
        name: str = "clip",
        cycle: tuple[float, float, float] | None = None,
    ) -> Clip:
        """Create a clip from the configurations of its frames.

        Args:
            model: the model that moves.
            qpos: configurations, ``(n, nq)``.
            dt: seconds between frames.
            name: name of the clip. Its ending becomes ``.motion``.
            cycle: move of one lap along x and y, m, and its turn to the left, rad. Without it, the clip does not loop.
        """
    @staticmethod
    def load(path: str | PathLike[str], /) -> Clip:
        """Read a ``.motion`` file."""
    @property
    def name(self) -> str:
        """Name in options, run folders and policies, such as ``jump.motion``."""
    @property
    def dt(self) -> float:
        """Seconds between frames."""
    @property
    def duration(self) -> float:
        """Length of the clip, or of one lap if it loops, s."""
    @property
    def cycle(self) -> tuple[float, float, float] | None:
        """Move of one lap along x and y, m, and its turn to the left, rad; None if the clip does not loop."""
    @property
    def qpos(self) -> npt.NDArray[np.float64]:
        """Configurations of the frames, ``(n, nq)``."""
    def save(self, path: str | PathLike[str]) -> None:
        """Write a ``.motion`` file."""
    def __eq__(self, other: object, /) -> bool: ...

def _check_size(width: int, height: int) -> None: ...
def _count(name: str, value: float, *, limited: bool = True) -> int: ...
def _limits() -> list[tuple[str, int]]: ...
def _mask(mask: npt.ArrayLike, num_envs: int, name: str = "mask") -> npt.NDArray[np.bool_]: ...
def _seeds(seed: int | Sequence[int | None] | None) -> int | list[int | None] | None: ...
def _clip(name: str, bytes: bytes) -> Clip: ...

@final
class CommandRange:
    """One number of an agent's command: its name, range and unit."""

    def __new__(cls, name: str, low: float, high: float, unit: str = "") -> Self: ...
    @property
    def name(self) -> str:
        """Name, such as ``velocity``."""
    @property
    def low(self) -> float:
        """Lowest value."""
    @property
    def high(self) -> float:
        """Highest value."""
    @property
    def unit(self) -> str:
        """Unit, such as ``m/s``; empty for a pure number."""
    def __getnewargs__(self) -> tuple[str, float, float, str]: ...
    def __eq__(self, other: object, /) -> bool: ...

@final
class Spec:
    """Constant facts of a task."""

    @property
    def id(self) -> str:
        """Name in the registry, such as ``Hopper-v0``."""
    @property
    def summary(self) -> str:
        """One line about the task."""
    @property
    def obs_size(self) -> int:
        """Length of an observation."""
    @property
    def act_size(self) -> int:
        """Length of an action."""
    @property
    def action_names(self) -> list[str]:
        """Names of the actuators, in the order of the action."""
    @property
    def action_low(self) -> list[float]:
        """Lowest sensible action per actuator, in the actuator's own units; -inf for one without bounds."""
    @property
    def action_high(self) -> list[float]:
        """Highest sensible action per actuator."""
    @property
    def dt(self) -> float:
        """Seconds between two steps."""
    @property
    def frame_skip(self) -> int:
        """Physics steps per step."""
    @property
    def max_episode_steps(self) -> int:
        """Steps after which an episode is truncated."""
    @property
    def reward_terms(self) -> list[str]:
        """Names of the reward's terms, which add up to the reward."""
    @property
    def info(self) -> list[str]:
        """Names of the numbers in `VecEnv.info`."""
    @property
    def metrics(self) -> list[str]:
        """Names of the numbers that tell how well the task is done: some of `VecEnv.info`, and ``forward``."""
    @property
    def dtype(self) -> Literal["float32", "float64"]:
        """Type of the observations: "float64" for Gymnasium's own tasks, as there, and "float32" for all others."""
    @property
    def observations(self) -> dict[str, slice]:
        """Parts of the observation by name, in their order: ``obs[:, spec.observations["touch"]]``."""
    @property
    def command(self) -> list[CommandRange]:
        """Commands of the agents, a number each, see `VecEnv.set_command`."""
    @property
    def options(self) -> dict[str, bool | float | tuple[float, float] | str | Clip | list[str | Clip]]:
        """Arguments that the task takes, with the values that it has."""
    @property
    def nq(self) -> int:
        """Length of ``qpos``."""
    @property
    def nv(self) -> int:
        """Length of ``qvel``."""

@final
class VecEnv:
    """Agents of one kind that are stepped together on the threads of a pool, without the GIL.

    Arrays are row-major with one row per agent. Without `copy`, the environment owns the arrays that it returns and
    overwrites them at the next step; with `copy`, every step returns new ones.

    One thread at a time may use an environment: another one gets a `RuntimeError`.

    `copy.deepcopy` and `pickle` make an environment that goes on as this one does. A process that was forked gets
    threads of its own.
    """

    def __new__(
        cls,
        id: str | PathLike[str],
        num_envs: int = 1,
        *,
        seed: int = 0,
        threads: int = 0,
        isa: Literal["f64", "f32", "baseline", "avx2", "avx512"] | None = None,
        autoreset: Literal["next_step", "same_step", "disabled"] | str = "next_step",
        max_episode_steps: int | None = None,
        copy: bool = False,
        dtype: npt.DTypeLike | None = None,
        **options: Any,
    ) -> VecEnv:
        """Make an environment. The results depend on none of `threads`, `isa` (but for f64) and `copy`.

        Args:
            id: name of the task, as in `marathon_rl.ids()`; case does not matter, and without a version it means v0.
                The path of a model is a name of the task ``Robot``.
            num_envs: number of agents. More than fit into 16 GB are a `MemoryError`, whose text says how to allow them.
            seed: seed until `reset` gives another. It is a number, not chance: without one given, every environment
                begins with the same episodes.
            threads: number of threads, at most 1024; 0 means one per processor core. There are never more than blocks
                of 16 agents.
            isa: instruction set; None means the widest that the processor has.
            autoreset: handling of agents whose episode ended. "next_step": the next step ignores its action and
                returns the first observation of the next episode with reward 0. "same_step": `obs` is that observation
                already, `final_obs` the last one of the old episode. "disabled": nothing; use `reset(mask=...)`.
            max_episode_steps: steps after which an episode is truncated; None means the task's own number.
            copy: whether every step returns new arrays.
            dtype: type of the observations, float32 or float64; None means that of the task, `Spec.dtype`. They are
                computed in 32 bits whatever it is.
            **options: arguments of the task, see `Spec.options`.
        """
    @property
    def spec(self) -> Spec:
        """Facts of the task, with this environment's ``max_episode_steps``."""
    @property
    def num_envs(self) -> int:
        """Number of agents."""
    @property
    def threads(self) -> int:
        """Number of threads."""
    @property
    def autoreset(self) -> Literal["next_step", "same_step", "disabled"]:
        """Handling of agents whose episode ended."""
    @property
    def copy(self) -> bool:
        """Whether every step returns new arrays."""
    @property
    def dtype(self) -> Literal["float32", "float64"]:
        """Type of the observations."""
    @property
    def obs(self) -> npt.NDArray[Any]:
        """Observations to act upon next, ``(num_envs, obs_size)``: what the last `reset` or `step` returned."""
    @property
    def final_obs(self) -> npt.NDArray[Any]:
        """Observations of the states that the last step reached, ``(num_envs, obs_size)``.

        With "same_step", they differ from `obs` where an episode ended. Overwritten by the next step, also with `copy`.
        """
    @property
    def reward_terms(self) -> npt.NDArray[np.float32]:
        """Terms of the last step's rewards, ``(num_envs, len(spec.reward_terms))``; they add up to the rewards."""
    @property
    def info(self) -> npt.NDArray[np.float32]:
        """Reports of the agents about the states that the last step reached, ``(num_envs, len(spec.info))``."""
    def read_info(self) -> npt.NDArray[np.float32]:
        """Reports of the agents about their present states, ``(num_envs, len(spec.info))``, a new array.

        It differs from `info` where a step has begun an episode.
        """
    @property
    def forward(self) -> npt.NDArray[np.float32]:
        """Distance that each agent moved along +x in the last step, m, ``(num_envs,)``."""
    @property
    def diverged(self) -> npt.NDArray[np.bool_]:
        """Agents whose simulation broke down in the last step, ``(num_envs,)``; they are terminated, with reward 0."""
    @property
    def x_position(self) -> npt.NDArray[np.float64] | None:
        """Position of each agent's root along x, m, ``(num_envs,)``, a new array; None if it cannot move along x."""
    def reset(
        self, seed: int | Sequence[int | None] | None = None, mask: npt.ArrayLike | None = None
    ) -> npt.NDArray[Any]:
        """Start new episodes and return the observations, ``(num_envs, obs_size)``.

        A seed restarts the random streams: the same seed gives the same episodes. A sequence has a seed, or None, for
        each agent, which then acts as the only agent of an environment with that seed. With a mask of booleans,
        ``(num_envs,)``, only the chosen agents are reset.
        """
    def step(
        self, actions: npt.ArrayLike
    ) -> tuple[npt.NDArray[Any], npt.NDArray[np.float32], npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        """Advance every agent by one decision. `actions` is ``(num_envs, act_size)``.

        Actions are in the units of `Spec.action_low`; the suite's own tasks clip them to [-1, 1].

        Returns ``(obs, reward, terminated, truncated)``, of shapes ``(num_envs, obs_size)`` and three times
        ``(num_envs,)``; more is in `final_obs`, `reward_terms`, `info`, `forward` and `diverged`. A C-contiguous
        float32 array is read in place.
        """
    def get_state(self) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """State of every agent in MuJoCo's layout: ``qpos``, ``(num_envs, nq)``, and ``qvel``, ``(num_envs, nv)``.

        Units are m, rad, m/s and rad/s; quaternions are w x y z.
        """
    def set_state(
        self, qpos: npt.ArrayLike, qvel: npt.ArrayLike, mask: npt.ArrayLike | None = None
    ) -> npt.NDArray[Any]:
        """Put agents, all or those of a mask, into states as if their episodes had begun there.

        Shapes are those of `get_state`. Returns the observations, ``(num_envs, obs_size)``.
        """
    def show(self, *, port: int = 0, page: str | PathLike[str] | None = None) -> Viewer:
        """Show up to 16 agents in a browser on this computer.

        Every step shows itself from now on, at most 60 times a second, and never waits for the page.

        Args:
            port: port on this computer; 0 takes a free one.
            page: folder of the page; None means the one of the package, or that in ``MARATHON_PAGE``.

        Returns:
            A viewer, whose ``url`` a browser can open. A notebook displays it.
        """
    @property
    def model(self) -> Model:
        """The compiled model: what the indices of bodies, actuators and height fields mean."""
    def vary(
        self,
        *,
        mass: npt.ArrayLike | None = None,
        friction: npt.ArrayLike | None = None,
        strength: npt.ArrayLike | None = None,
        gravity: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Set constants of all agents or those of a mask, for domain randomization.

        They last over resets, until changed, and belong to snapshots. Omitted constants have the model's values.

        Args:
            mass: factors of the bodies' masses and inertias, ``(num_envs, nbody)``.
            friction: factors of all friction coefficients of contacts, ``(num_envs,)``.
            strength: factors of the actuators' forces, ``(num_envs, nu)``.
            gravity: gravity, m/s^2, ``(num_envs, 3)``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    @property
    def command(self) -> npt.NDArray[np.float64]:
        """Command in each agent's current observation, ``(num_envs, len(spec.command))``, a new array."""
    def set_command(self, command: npt.ArrayLike | None, mask: npt.ArrayLike | None = None) -> None:
        """Tell agents, all or those of a mask, what to do in place of their own schedule; None gives them back to it.

        They observe it at the end of the next step, or at the start of the next episode, and are rewarded for it from
        there on. It lasts over resets, until changed, and belongs to snapshots.

        Args:
            command: numbers within the ranges of `spec.command`, ``(num_envs, len(spec.command))``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def push(
        self,
        force: npt.ArrayLike,
        torque: npt.ArrayLike | None = None,
        *,
        body: int | str,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Push a body of all agents or those of a mask until changed or until the agent's next episode.

        Both vectors are in world axes, at the body's center of mass.

        Args:
            force: force, N, ``(num_envs, 3)``.
            torque: torque, N m, ``(num_envs, 3)``; None means none.
            body: the body's name, or its index in ``model.body_names``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def ground(self, field: int = 0) -> npt.NDArray[np.float32]:
        """Ground of each agent: elevations, m above the zero of a height field, ``(num_envs, nrow, ncol)``.

        The array is new. Its first row has the smallest y. ``model.hfield`` finds the index of a field by its name.
        """
    def set_ground(self, elevations: npt.ArrayLike, field: int = 0, mask: npt.ArrayLike | None = None) -> None:
        """Set the ground of all agents or those of a mask.

        The first row has the smallest y. It lasts over resets, until changed. In tasks that draw the ground of every
        episode, such as ``TerrainWalker2d-v0``, it lasts until the episode ends.

        Args:
            elevations: elevations, m above the zero of the height field: a grid for each agent, ``(num_envs, nrow,
                ncol)``, or one for all, ``(nrow, ncol)``.
            field: index of the height field.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def save(self) -> bytes:
        """Everything that the future depends on.

        Loaded, the environment continues with the same bits, whatever the number of threads and the instruction set.
        The bytes have a checksum.
        """
    def load(self, snapshot: bytes) -> None:
        """Restore what `save` returned for the same task and number of agents."""
    def __getnewargs_ex__(self) -> tuple[tuple[str, int], dict[str, Any]]: ...
    def __getstate__(self) -> dict[str, Any]: ...
    def __setstate__(self, state: dict[str, Any], /) -> None: ...
    def __len__(self) -> int: ...

@final
class Renderer:
    """Draws agents of one kind with a ray caster on the processor, followed by a camera. No window, no GPU."""

    def __new__(
        cls, id: str | PathLike[str], width: int = 480, height: int = 480, *, num_envs: int = 1, **options: Any
    ) -> Renderer:
        """Make a renderer for pictures of `width` x `height` pixels with `num_envs` agents side by side.

        `options` are arguments of the task, see `Spec.options`: some change the model.
        """
    @staticmethod
    def of(model: Model, width: int = 480, height: int = 480, *, num_envs: int = 1) -> Renderer:
        """Make a renderer for a compiled model."""
    def render(self, qpos: npt.ArrayLike, elapsed: float = ...) -> npt.NDArray[np.uint8]:
        """Draw agents side by side, their states in the rows of `qpos`, ``(num_envs, nq)``.

        `elapsed` is the time since the last picture, s; the camera jumps to the agents at first and after more than a
        second. Returns ``(height, width, 3)``, sRGB.
        """

@final
class Policy:
    """A trained policy: a function from observations to actions."""

    @property
    def task(self) -> str:
        """Task that the policy is for, such as ``Hopper-v0``."""
    @property
    def obs_size(self) -> int:
        """Length of an observation."""
    @property
    def act_size(self) -> int:
        """Length of an action."""
    @property
    def dt(self) -> float:
        """Seconds between two actions."""
    @property
    def options(self) -> dict[str, bool | float | tuple[float, float] | str | Clip | list[str | Clip]]:
        """Arguments of the task: ``VecEnv(policy.task, **policy.options)`` is what the policy was trained in."""
    @property
    def meta(self) -> dict[str, Any]:
        """All that the file says of the policy: network, training with its configuration, evaluation."""
    def __call__(self, obs: npt.ArrayLike, rng: np.random.Generator | int | None = None) -> npt.NDArray[np.float32]:
        """The actions for observations, ``(obs_size,)`` or ``(n, obs_size)``; ``(act_size,)`` or ``(n, act_size)``.

        Without `rng`, the best actions. With a generator or a seed for one, actions drawn as in training.
        """
    def save(self, path: str | PathLike[str]) -> None:
        """Write the policy to a file: ``.safetensors``, or ``.onnx`` by the contract of ML-Agents' models."""

@final
class TrainResult:
    """Result of a training run."""

    @property
    def policy(self) -> Policy:
        """The policy."""
    @property
    def steps(self) -> int:
        """Steps of all agents together."""
    @property
    def interrupted(self) -> bool:
        """Whether the run was stopped before its last step."""
    @property
    def folder(self) -> Path | None:
        """Folder with the results, if they were written to one."""
    @property
    def evaluation(self) -> dict[str, float] | None:
        """How the policy's best actions do over 100 episodes, as `evaluate` tells it; None if interrupted."""
    @property
    def summary(self) -> dict[str, Any]:
        """The run in numbers, as in ``summary.json``."""

def train(
    task: str | PathLike[str] | type[MarathonAgent] | MarathonAgent | None = None,
    config: str | PathLike[str] | dict[str, Any] | None = None,
    *,
    callback: Callable[[dict[str, float | None]], bool | None] | None = None,
    progress: bool = True,
    seed: int | None = None,
    steps: float | None = None,
    num_envs: int | None = None,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    resume: str | PathLike[str] | None = None,
    players: Any = None,
    initialize_from: str | PathLike[str] | None = None,
    **options: Any,
) -> TrainResult:
    """Train a policy with the native trainer, without the GIL, and evaluate it.

    Ctrl-C and exceptions of the callback end training after the iteration; with a folder, what was learned is there and
    `resume` goes on with it. The same seed gives the same policy, bit for bit, for any number of threads.

    Args:
        task: its name, the path of a model, or a `MarathonAgent` class, whose functions are called once per step for
            all agents. An object of the class stands for the class.
        config: a file, or a dictionary with the same keys, such as ``{"ppo": {"lr": 3e-4}}``. The task's preset holds
            for what it leaves out. Values may be numbers and arrays of NumPy. A file of ML-Agents, or a dictionary like
            one, is imported.
        callback: called after every iteration with the numbers that ``progress.csv`` holds, such as ``steps``,
            ``return_mean`` (None if no episode ended), ``steps_per_second``; if it returns False, training stops.
        progress: show how far the run is on standard error: a bar in a terminal, a line now and then elsewhere.
        seed: seed of everything random.
        steps: steps of all agents together, such as ``4e6``.
        num_envs: number of agents, a multiple of 16.
        threads: number of threads; 0 means one per processor core.
        out: a new folder for everything that the command ``marathon train`` writes; None means that nothing is written.
        resume: the folder of a run to go on with, in place of a configuration; the task is needed for a class alone.
        players: an object that has the rollouts played elsewhere, as `marathon_rl.ray.Workers` does.
        initialize_from: a policy to start from in place of random weights, a file or the folder of a run, whose hidden
            layers are no wider; it may observe less.
        **options: options of the task, see `Spec.options`, such as ``clip="my.bvh"``. A clip may be a `Clip` or a list,
            too. A class gets them as arguments of its constructor. A run notes the options of tasks with a name only:
            pass those of a class again to `resume` and to `evaluate`.
    """

@final
class Player:
    """Plays the agents of one slice of a training run, in a process of its own.

    A run's agents are split into slices of consecutive blocks of sixteen. For each rollout, the learner sends every
    player the same orders and the state of its slice; the player keeps nothing, so any other with the same slice can
    take its place. Messages are safetensors in arrays of uint8.
    """

    def __new__(cls, task: str, config: str, slice: int, slices: int) -> Player:
        """Make the player of slice `slice` of `slices`; `config` is the JSON of the trainer's settings."""
    def play(self, orders: npt.NDArray[np.uint8], state: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
        """Play one horizon, without the GIL, and return the answer for the learner.

        The same orders and state give the same bits, whatever was played before.
        """

def _policy(bytes: bytes) -> Policy: ...
def _spec(id: str, options: dict[str, Any], max_episode_steps: int) -> Spec: ...
def _train_result(
    policy: Policy, steps: int, interrupted: bool, folder: str | PathLike[str] | None, summary: str
) -> TrainResult: ...
def load_policy(
    path: str | PathLike[str], task: str | PathLike[str] | type[MarathonAgent] | MarathonAgent | None = None
) -> Policy:
    """Read a policy from a file, ``.safetensors`` or ``.onnx``, or from the folder of a run.

    Without `task`, it is for the one that the file names; with, a policy of another one is an error. ONNX files that
    another program has written, multi-layer perceptrons from observations to actions, name none.
    """

def evaluate(
    policy: Policy,
    episodes: int = 100,
    *,
    task: str | PathLike[str] | type[MarathonAgent] | MarathonAgent | None = None,
    seed: int = ...,
    threads: int = 0,
    **options: Any,
) -> dict[str, float]:
    """Play whole episodes with a policy's best actions.

    `task` is needed for a `MarathonAgent` class; without, it is the policy's own. `options` are options of the task.

    Returns ``return_mean``, ``return_std``, ``return_min``, ``return_max``, ``length_mean`` (decisions),
    ``distance_mean`` (m), ``speed_mean`` (m/s), ``falls``, ``diverged`` and ``episodes``.
    """

@final
class Model:
    """A compiled MJCF model, the counterpart of MuJoCo's `MjModel`.

    SI units, radians, quaternions w x y z; body 0 is the world. Where the file gives no name, the name is empty.
    """

    @staticmethod
    def from_xml_path(path: str | PathLike[str], /) -> Model:
        """Read a model file; included files and height fields are looked up beside it."""
    @staticmethod
    def from_xml_string(xml: str, /, name: str = "model") -> Model:
        """Compile a model given as text, which has no other files; `name` stands for the file in messages."""
    def edit(
        self,
        changes: dict[str, dict[str, Any]] | None = None,
        *,
        remove: dict[str, Sequence[str]] | None = None,
    ) -> Model:
        """Make a copy with other attributes of its elements.

        Attributes have the names and the units of the file. A wrong name is an error that lists the nearest valid one.
        The models of tasks cannot be edited.

        Args:
            changes: new values by kind, name and attribute, such as ``{"geom": {"floor": {"friction": 0.4}}}``, or by
                section and attribute: ``{"option": {"iterations": 50}}``. Kinds are ``body``, ``joint``, ``geom``,
                ``site``, ``camera``, ``light``, ``hfield``, ``mesh``, ``tendon``, ``equality``, ``pair``, ``exclude``,
                ``actuator``, ``sensor`` and ``key``; sections are ``compiler``, ``option``, ``statistic`` and
                ``visual``. A value is a text, a bool, a number or a list of numbers; None takes the attribute away.
            remove: names of elements to remove, by kind. All that refers to them goes, too.
        """
    @property
    def option(self) -> dict[str, Any]:
        """Settings of the physics and of its solver, by the names of MJCF's ``option``: a new dict."""
    @property
    def name(self) -> str:
        """Name of the model."""
    @property
    def timestep(self) -> float:
        """Seconds per physics step."""
    @property
    def nq(self) -> int:
        """Length of ``qpos``."""
    @property
    def nv(self) -> int:
        """Length of ``qvel``."""
    @property
    def nu(self) -> int:
        """Number of actuators."""
    @property
    def mocap_bodies(self) -> npt.NDArray[np.int64]:
        """Indices of the mocap bodies, which `Simulation.set_mocap` moves, ``(nmocap,)``."""
    @property
    def body_names(self) -> list[str]:
        """Names of the bodies, the first being the world."""
    @property
    def geom_names(self) -> list[str]:
        """Names of the geoms."""
    @property
    def joint_names(self) -> list[str]:
        """Names of the joints."""
    @property
    def actuator_names(self) -> list[str]:
        """Names of the actuators."""
    @property
    def sensor_names(self) -> list[str]:
        """Names of the sensors."""
    @property
    def keyframe_names(self) -> list[str]:
        """Names of the keyframes."""
    def body(self, name: str) -> int:
        """Index of a body."""
    def geom(self, name: str) -> int:
        """Index of a geom."""
    def joint(self, name: str) -> int:
        """Index of a joint."""
    def actuator(self, name: str) -> int:
        """Index of an actuator."""
    def sensor(self, name: str) -> tuple[int, int]:
        """First value of a sensor among all sensors' values, and their number."""
    def keyframe(self, name: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """``qpos``, ``(nq,)``, and ``qvel``, ``(nv,)``, of a keyframe."""
    @property
    def qpos0(self) -> npt.NDArray[np.float64]:
        """Reference configuration, ``(nq,)``."""
    @property
    def body_parent(self) -> npt.NDArray[np.int64]:
        """Parent of each body, ``(nbody,)``."""
    @property
    def body_weld(self) -> npt.NDArray[np.int64]:
        """Body that each body follows rigidly, ``(nbody,)``: itself if it has joints; 0 if it does not move."""
    @property
    def body_root(self) -> npt.NDArray[np.int64]:
        """First body of each body's tree, ``(nbody,)``."""
    @property
    def body_quat(self) -> npt.NDArray[np.float64]:
        """Orientation of each body in its parent, ``(nbody, 4)``."""
    @property
    def body_mass(self) -> npt.NDArray[np.float64]:
        """Mass of each body, kg, ``(nbody,)``."""
    @property
    def geom_body(self) -> npt.NDArray[np.int64]:
        """Body of each geom, ``(ngeom,)``."""
    @property
    def joint_type(self) -> list[Literal["free", "ball", "slide", "hinge"]]:
        """Type of each joint."""
    @property
    def joint_body(self) -> npt.NDArray[np.int64]:
        """Body that each joint moves, ``(njoint,)``."""
    @property
    def joint_qpos(self) -> npt.NDArray[np.int64]:
        """First coordinate of each joint in ``qpos``, ``(njoint,)``."""
    @property
    def joint_dof(self) -> npt.NDArray[np.int64]:
        """First velocity of each joint in ``qvel``, ``(njoint,)``."""
    @property
    def joint_axis(self) -> npt.NDArray[np.float64]:
        """Axis of each hinge or slide in its body's frame, ``(njoint, 3)``."""
    @property
    def joint_range(self) -> npt.NDArray[np.float64]:
        """Limits of each joint, rad or m, infinite where there are none, ``(njoint, 2)``."""
    @property
    def actuator_joint(self) -> npt.NDArray[np.int64]:
        """Joint that each actuator acts on, -1 for one that acts on something else, ``(nu,)``."""
    @property
    def actuator_range(self) -> npt.NDArray[np.float64]:
        """Range of each actuator's control in its own units, infinite where there is none, ``(nu, 2)``."""
    @property
    def hfield_names(self) -> list[str]:
        """Names of the height fields."""
    def hfield(self, name: str) -> int:
        """Index of a height field."""
    @property
    def hfield_nrow(self) -> npt.NDArray[np.int64]:
        """Rows of each height field's grid, along y, ``(nhfield,)``."""
    @property
    def hfield_ncol(self) -> npt.NDArray[np.int64]:
        """Columns of each height field's grid, along x, ``(nhfield,)``."""
    @property
    def hfield_size(self) -> npt.NDArray[np.float64]:
        """Half extents along x and y, height of the highest elevation, thickness of the base, m, ``(nhfield, 4)``."""

@final
class Simulation:
    """Physics of many agents of one model, stepped together by native threads without the GIL.

    Readings are read-only arrays with one row per agent, in world axes and SI units. They are computed when they are
    first asked for after a step or a reset, and never overwritten.
    """

    def __new__(
        cls,
        model: Model,
        num_envs: int = 1,
        *,
        threads: int = 0,
        isa: Literal["f64", "f32", "baseline", "avx2", "avx512"] | None = None,
    ) -> Simulation:
        """Make a simulation with all agents in the reference configuration, at rest.

        Args:
            model: the model.
            num_envs: number of agents.
            threads: number of threads; 0 means one per processor core, but not more than one for every 64 agents.
            isa: instruction set; None means the widest that the processor has. The results do not depend on it (but for
                f64) and on the number of threads.
        """
    @property
    def model(self) -> Model:
        """The model."""
    @property
    def num_envs(self) -> int:
        """Number of agents."""
    @property
    def threads(self) -> int:
        """Number of threads."""
    def step(self, ctrl: npt.ArrayLike, substeps: int = 1) -> npt.NDArray[np.bool_]:
        """Advance every agent by `substeps` physics steps, 1 to 1000, under `ctrl`, ``(num_envs, nu)``.

        Returns which agents broke, ``(num_envs,)``: their states stopped being finite, so they were put into the
        reference configuration at rest.
        """
    def reset(
        self,
        qpos: npt.ArrayLike,
        qvel: npt.ArrayLike,
        mask: npt.ArrayLike | None = None,
        *,
        act: npt.ArrayLike | None = None,
    ) -> None:
        """Put agents, all or those of a mask, into states.

        The states are rows of `qpos`, ``(num_envs, nq)``, and `qvel`, ``(num_envs, nv)``, and the activations of
        actuators those of `act`, ``(num_envs, na)``, or 0. Quaternions are normalized. Controls, pushes and contacts
        are forgotten, and mocap bodies are put where the model has them.
        """
    def push(
        self,
        force: npt.ArrayLike,
        torque: npt.ArrayLike | None = None,
        *,
        body: int | str,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Push a body of all agents or those of a mask until changed or until a reset.

        Both vectors are in world axes, at the body's center of mass.

        Args:
            force: force, N, ``(num_envs, 3)``.
            torque: torque, N m, ``(num_envs, 3)``; None means none.
            body: the body's name, or its index in ``model.body_names``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def set_mocap(
        self,
        pos: npt.ArrayLike | None = None,
        quat: npt.ArrayLike | None = None,
        *,
        body: int | str,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Move a mocap body of all agents or those of a mask until changed or until a reset.

        It moves at once, without a velocity, and with it all that is attached to it. Omitted parts stay as they are.

        Args:
            pos: its position, m, ``(num_envs, 3)``.
            quat: its orientation, w x y z, ``(num_envs, 4)``, which is normalized.
            body: the body's name, or its index in ``model.body_names``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def vary(
        self,
        *,
        mass: npt.ArrayLike | None = None,
        friction: npt.ArrayLike | None = None,
        strength: npt.ArrayLike | None = None,
        gravity: npt.ArrayLike | None = None,
        mask: npt.ArrayLike | None = None,
    ) -> None:
        """Set constants of all agents or those of a mask, for domain randomization.

        They last over resets, until changed, and belong to snapshots. Omitted constants have the model's values. Masses
        change the softness of limits and contacts, too, as MuJoCo's ``mj_setConst`` does; muscles keep their forces.

        Args:
            mass: factors of the bodies' masses and inertias, ``(num_envs, nbody)``. A body without joints has the
                factor of the body that carries it, ``model.body_weld``.
            friction: factors of all friction coefficients of contacts, ``(num_envs,)``.
            strength: factors of the actuators' forces, ``(num_envs, nu)``.
            gravity: gravity, m/s^2, ``(num_envs, 3)``.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def ground(self, field: int = 0) -> npt.NDArray[np.float32]:
        """Ground of each agent: elevations, m above the zero of a height field, ``(num_envs, nrow, ncol)``.

        The array is new. Its first row has the smallest y. ``model.hfield`` finds the index of a field by its name.
        """
    def set_ground(self, elevations: npt.ArrayLike, field: int = 0, mask: npt.ArrayLike | None = None) -> None:
        """Set the ground of all agents or those of a mask.

        The first row has the smallest y. It lasts over resets, until changed, and belongs to snapshots.

        Args:
            elevations: elevations, m above the zero of the height field: a grid for each agent, ``(num_envs, nrow,
                ncol)``, or one for all, ``(nrow, ncol)``.
            field: index of the height field.
            mask: the agents, booleans, ``(num_envs,)``; None means all.
        """
    def ground_height(self, x: npt.ArrayLike, y: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Heights of the ground at places of the world, m, ``(num_envs, n)``.

        It is the ground of planes and of height fields that lie level, with ground of each agent's own. Beyond all of
        it, the height is that of the nearest place; 0 if the model has no ground.

        Args:
            x: places along x, m, ``(num_envs, n)``.
            y: places along y, m, ``(num_envs, n)``.
        """
    def save(self) -> bytes:
        """Everything that the future depends on, as JSON. Loaded, the simulation continues with the same bits."""
    def load(self, snapshot: bytes) -> None:
        """Restore what `save` returned for the same model and number of agents."""
    @property
    def qpos(self) -> npt.NDArray[np.float64]:
        """Configuration, ``(num_envs, nq)``."""
    @property
    def qvel(self) -> npt.NDArray[np.float64]:
        """Velocity, ``(num_envs, nv)``."""
    @property
    def act(self) -> npt.NDArray[np.float64]:
        """Activations of the actuators that have one, ``(num_envs, na)``."""
    @property
    def mocap_pos(self) -> npt.NDArray[np.float64]:
        """Positions of the mocap bodies, m, ``(num_envs, nmocap, 3)``, in the order of ``model.mocap_bodies``."""
    @property
    def mocap_quat(self) -> npt.NDArray[np.float64]:
        """Orientations of the mocap bodies, w x y z, ``(num_envs, nmocap, 4)``."""
    @property
    def qacc(self) -> npt.NDArray[np.float64]:
        """Accelerations at the present state and controls, ``(num_envs, nv)``.

        This and the forces cost about as much as a physics step.
        """
    @property
    def qfrc_constraint(self) -> npt.NDArray[np.float64]:
        """Forces of contacts, limits, dry friction and equalities on the joints, N or N m, ``(num_envs, nv)``."""
    @property
    def actuator_force(self) -> npt.NDArray[np.float64]:
        """Forces of the actuators at the present state and controls, N or N m, ``(num_envs, nu)``."""
    def contacts(self, agent: int = 0) -> dict[str, npt.NDArray[Any]]:
        """Contacts of an agent at the present state and controls, in new arrays.

        ``geom``, of shape ``(n, 2)``, has the indices of the two geoms. The others have shape ``(n, 3)``: ``pos``, the
        places, m; ``normal``, the directions from the first geom to the second; ``force``, the forces on the second
        geom, N; ``torque``, the torques on it about the place, N m, which only contacts that resist twisting or
        rolling have.
        """
    @property
    def body_pos(self) -> npt.NDArray[np.float64]:
        """Origins of the bodies' frames, m, ``(num_envs, nbody, 3)``."""
    @property
    def body_axes(self) -> npt.NDArray[np.float64]:
        """Directions of the bodies' x, y and z axes, ``(num_envs, nbody, 3, 3)``: ``[..., 0, :]`` is that of x."""
    @property
    def body_velocity(self) -> npt.NDArray[np.float64]:
        """Velocities of the origins of the bodies' frames, m/s, ``(num_envs, nbody, 3)``."""
    @property
    def body_angular_velocity(self) -> npt.NDArray[np.float64]:
        """Angular velocities of the bodies, rad/s, ``(num_envs, nbody, 3)``."""
    @property
    def geom_pos(self) -> npt.NDArray[np.float64]:
        """Centers of the geoms, m, ``(num_envs, ngeom, 3)``."""
    @property
    def geom_velocity(self) -> npt.NDArray[np.float64]:
        """Velocities of the geoms' centers, m/s, ``(num_envs, ngeom, 3)``."""
    @property
    def touching(self) -> npt.NDArray[np.bool_]:
        """Geoms that touched the static world at the last physics step, ``(num_envs, ngeom)``."""
    @property
    def touched(self) -> npt.NDArray[np.bool_]:
        """Geoms that touched the static world at any physics step of the last `step`, ``(num_envs, ngeom)``."""
    @property
    def normal_force(self) -> npt.NDArray[np.float64]:
        """Normal forces of the geoms' contacts at the last physics step, N, ``(num_envs, ngeom)``."""
    @property
    def sensors(self) -> npt.NDArray[np.float64]:
        """Sensors' values at the present state and controls, in the model's order, ``(num_envs, ...)``.

        NaN for those that cannot be evaluated. This costs about as much as a physics step.
        """
    def __len__(self) -> int: ...

def ids() -> list[str]:
    """Names of all registered tasks."""

def spec(id: str | PathLike[str], /, **options: Any) -> Spec:
    """Facts of a task, by any of its names, with other values for some of its arguments."""

def main(words: Sequence[str]) -> int:
    """Run the ``marathon`` command with the words of a command line and return its exit code.

    The first word is the program's name. It belongs at the end of a process: some commands replace the handler of
    Ctrl-C.
    """

@final
class Viewer:
    """A page on this computer that shows an environment. ``VecEnv.show`` makes it."""

    @property
    def url(self) -> str:
        """Address of the page. Only this computer can open it, and only with the token in the address."""
    @property
    def watched(self) -> bool:
        """Whether a page is open."""
    def close(self) -> None:
        """End the server; pages say so."""

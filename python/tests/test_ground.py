"""Agents written in Python see the ground where MuJoCo's rays hit it, each its own, by the heading of their parts."""

import mujoco
import numpy as np
import pytest

from marathon_rl import MarathonAgent, Model, Simulation, VecEnv

ROWS, COLUMNS = 5, 7
MODEL = f"""
<mujoco>
  <asset><hfield name="hills" nrow="{ROWS}" ncol="{COLUMNS}" size="3 2 1 0.5"/></asset>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 1" pos="0 0 -0.25" contype="0" conaffinity="1"/>
    <geom name="hills" type="hfield" hfield="hills" pos="0.5 -0.25 0.125" euler="0 0 30" contype="0" conaffinity="1"/>
    <body pos="0 0 6">
      <freejoint/>
      <geom name="eye" size="0.1" contype="1" conaffinity="0"/>
      <body><joint name="tail"/><geom size="0.05" pos="-0.3 0 0" contype="0" conaffinity="0"/></body>
    </body>
  </worldbody>
  <actuator><motor joint="tail"/></actuator>
</mujoco>"""
POINTS = [(0.0, 0.0), (0.5, 0.0), (0.25, -0.75)]
AGENTS = 20


class Eye(MarathonAgent):
    """An eye over hills."""

    mjcf = MODEL

    def observations(self) -> list[np.ndarray]:
        return [self.height_scan("eye", POINTS)]

    def step_reward(self) -> dict[str, np.ndarray]:
        x, y, _ = self.position("eye").T
        return {"ground": self.ground_height(x, y)}


def hills(agent: int) -> np.ndarray:
    """Hills of an agent's own, single precision as the physics keeps them."""
    return np.random.default_rng(agent).uniform(0.01, 1.0, (ROWS, COLUMNS)).astype(np.float32)


def ray(agent: int, x: float, y: float) -> float:
    """Height at which a ray from above meets the ground in MuJoCo."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    model.hfield_data[:] = hills(agent).ravel()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    down = np.array([0.0, 0.0, -1.0])
    return 5.0 - mujoco.mj_ray(model, data, np.array([x, y, 5.0]), down, None, 1, 1, np.zeros(1, np.int32))


def eyes() -> Eye:
    agent = Eye(AGENTS)
    agent.sim.set_ground(np.stack([hills(i) for i in range(AGENTS)]))
    return agent


def test_the_ground_is_where_mujocos_rays_meet_it() -> None:
    agent = eyes()
    x, y = np.random.default_rng(1).uniform(-4, 4, (2, AGENTS, 3))
    height = agent.ground_height(x, y)
    expected = [[ray(i, x[i, k], y[i, k]) for k in range(3)] for i in range(AGENTS)]
    np.testing.assert_allclose(height, expected, atol=1e-5)
    # some places lie on the hills, some beyond them on the floor
    assert (height > 0).sum() > 10
    assert (height == -0.25).sum() > 5
    # one place for each agent, and one for all
    np.testing.assert_array_equal(agent.ground_height(x[:, 0], y[:, 0]), height[:, 0])
    assert agent.ground_height(1.0, 0.5).shape == (AGENTS,)
    np.testing.assert_array_equal(agent.ground_height(9.0, 9.0), np.full(AGENTS, -0.25))


def test_a_scan_turns_with_the_heading() -> None:
    agent = eyes()
    random = np.random.default_rng(2)
    x, y, yaw = random.uniform([-2, -1, -3], [2, 1, 3], (AGENTS, 3)).T
    qpos = np.zeros((AGENTS, agent.model.nq))
    qpos[:, 0], qpos[:, 1], qpos[:, 2], qpos[:, 3], qpos[:, 6] = x, y, 6, np.cos(yaw / 2), np.sin(yaw / 2)
    agent.sim.reset(qpos, np.zeros((AGENTS, agent.model.nv)))
    np.testing.assert_allclose(agent.heading("eye"), np.stack([np.cos(yaw), np.sin(yaw)], 1), atol=1e-6)
    scan = agent.height_scan("eye", POINTS)
    for k, (ahead, left) in enumerate(POINTS):
        at_x, at_y = x + np.cos(yaw) * ahead - np.sin(yaw) * left, y + np.sin(yaw) * ahead + np.cos(yaw) * left
        np.testing.assert_allclose(scan[:, k], [ray(i, at_x[i], at_y[i]) - 6 for i in range(AGENTS)], atol=1e-5)
    # who looks straight up heads along +x
    qpos[:, 3:7] = np.cos(np.pi / 4), 0, -np.sin(np.pi / 4), 0
    agent.sim.reset(qpos, np.zeros((AGENTS, agent.model.nv)))
    np.testing.assert_array_equal(agent.heading("eye"), np.tile([1.0, 0.0], (AGENTS, 1)))


def test_ground_lasts_over_resets_and_snapshots_and_is_stood_upon() -> None:
    env = Eye.vec_env(2, autoreset="disabled")
    env.set_ground(np.full((ROWS, COLUMNS), 0.875), mask=[False, True])
    flat, raised = env.reset(seed=1)[:, 0]
    assert raised - flat == pytest.approx(0.875, abs=0.05)
    again = Simulation(Model.from_xml_string(MODEL), 2)
    again.load(env.agent.sim.save())
    np.testing.assert_array_equal(again.ground_height(np.zeros((2, 1)), np.zeros((2, 1)))[:, 0], [0.125, 1.0])
    # they fall onto their own ground: the lower is still on its way when the other has landed
    landed = np.full(2, -1)
    for decision in range(200):
        env.step(np.zeros((2, 1)))
        touching = env.agent.sim.touching[:, env.agent.model.geom("eye")]
        landed[(landed < 0) & touching] = decision
        if touching.any():
            depth = env.agent.height("eye") - env.agent.ground_height(*env.agent.position("eye").T[:2])
            np.testing.assert_allclose(depth[touching], 0.1, atol=0.1)
    assert 0 < landed[1] < landed[0]
    fall = np.sqrt(2 * (6 - np.array([0.225, 1.1])) / 9.81)
    np.testing.assert_allclose((landed + 1) * env.spec.dt, fall, atol=0.02)


@pytest.mark.parametrize(
    ("field", "elevations", "message"),
    [
        (1, np.zeros((5, 7)), "field is 1, expected less than 1"),
        (0, np.zeros(35), r"elevations have the shape \(35,\), expected \(2, 5, 7\) or \(5, 7\)"),
        (0, np.zeros((7, 5)), r"elevations have the shape \(7, 5\), expected \(2, 5, 7\) or \(5, 7\)"),
        (0, np.zeros((1, 5, 7)), r"elevations have the shape \(1, 5, 7\), expected \(2, 5, 7\) or \(5, 7\)"),
        (0, np.full((5, 7), np.nan), "elevations have a number that is NaN"),
    ],
)
def test_ground_that_does_not_fit_is_refused(field: int, elevations: np.ndarray, message: str) -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 2)
    with pytest.raises(ValueError, match=message):
        sim.set_ground(elevations, field)
    with pytest.raises(ValueError, match=r"mask is bool \(3,\), expected a boolean array of shape \(2,\)"):
        sim.set_ground(np.zeros((5, 7)), mask=np.ones(3, bool))


def test_a_model_tells_the_size_of_its_height_fields() -> None:
    model = Model.from_xml_string(MODEL)
    assert (model.hfield_names, model.hfield("hills")) == (["hills"], 0)
    assert (model.hfield_nrow.tolist(), model.hfield_ncol.tolist()) == ([ROWS], [COLUMNS])
    assert model.hfield_size.tolist() == [[3, 2, 1, 0.5]]
    with pytest.raises(ValueError, match="the model has no height field 'hill'; did you mean 'hills'"):
        model.hfield("hill")
    assert Model.from_xml_string("<mujoco><worldbody/></mujoco>").hfield_size.shape == (0, 4)


def test_ground_of_an_environment_lasts_as_long_as_its_task_draws_none() -> None:
    """In a task that draws the ground of every episode, ground of one's own lasts for an episode."""
    env = VecEnv("TerrainWalker2d-v0", 2, autoreset="disabled", seed=1)
    env.reset()
    rows, columns = env.model.hfield_nrow[0], env.model.hfield_ncol[0]
    drawn = env.ground()
    assert drawn.shape == (2, rows, columns) and drawn.dtype == np.float32
    flat = np.zeros((rows, columns), np.float32)
    for elevations in (flat, flat.tolist(), np.asfortranarray(flat.astype(float)), np.stack([flat + 1, flat])):
        env.set_ground(elevations, 0, [False, True])
    for _ in range(3):
        env.step(np.zeros((2, env.spec.act_size)))
        np.testing.assert_array_equal(env.ground(0), [drawn[0], flat])
    env.reset(mask=[False, True])
    assert not np.array_equal(env.ground()[1], flat)
    np.testing.assert_array_equal(env.ground()[0], drawn[0])
    for call in (lambda: env.set_ground(flat, 1), lambda: env.ground(1)):
        with pytest.raises(ValueError, match="field is 1, expected less than 1"):
            call()


def test_places_that_are_no_rows_of_agents_are_refused() -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 2)
    with pytest.raises(ValueError, match=r"x has the shape \(3, 1\), expected \(2, 1\)"):
        sim.ground_height(np.zeros((3, 1)), np.zeros((3, 1)))
    with pytest.raises(ValueError, match=r"y has the shape \(2, 2\), expected \(2, 1\)"):
        sim.ground_height(np.zeros((2, 1)), np.zeros((2, 2)))

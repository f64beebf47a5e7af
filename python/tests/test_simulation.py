"""Readings of the bare physics, compared with those of MuJoCo, and edits of a model."""

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from marathon_rl import Model, Simulation

MODEL = """
<mujoco model="crane">
  <option timestep="0.002" iterations="80" tolerance="1e-12"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body name="arm" pos="0 0 0.5">
      <joint name="swing" type="hinge" axis="0 1 0" damping="0.3" range="-40 40" limited="true"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0.5 0 0" size="0.04"/>
    </body>
    <body name="ball" pos="0.3 0 0.098"><freejoint/><geom name="ball" size="0.1" condim="4"/></body>
    <body name="die" pos="0.3 0.03 0.25"><freejoint/><geom name="die" type="box" size="0.06 0.06 0.06"/></body>
  </worldbody>
  <actuator>
    <general name="lift" joint="swing" dyntype="filter" dynprm="0.1" gainprm="3"/>
    <motor name="turn" joint="swing" gear="2"/>
  </actuator>
</mujoco>
"""


def twice(row: np.ndarray) -> np.ndarray:
    return np.tile(row, (2, 1))


def by_place(rows: np.ndarray) -> np.ndarray:
    """Rows of contacts in the order of their geoms and places."""
    return rows[np.lexsort(np.round(rows[:, :5], 6).T)]


@pytest.fixture
def both() -> tuple[Simulation, mujoco.MjModel, mujoco.MjData]:
    """The same state of two agents here, and in MuJoCo."""
    sim = Simulation(Model.from_xml_string(MODEL), 2, isa="f64")
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    random = np.random.default_rng(1)
    data.qpos[0] = 0.8  # beyond the limit
    data.qvel[:] = random.normal(size=model.nv)
    data.act[:] = 0.7
    sim.reset(twice(data.qpos), twice(data.qvel), act=twice(data.act))
    ctrl = np.array([0.4, -0.6])
    sim.step(twice(ctrl))
    data.ctrl[:] = ctrl
    mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    return sim, model, data


def test_dynamics_are_those_of_mujoco(both: tuple[Simulation, mujoco.MjModel, mujoco.MjData]) -> None:
    sim, _, data = both
    for name in ("qpos", "qvel", "act", "qacc", "qfrc_constraint", "actuator_force"):
        ours, theirs = getattr(sim, name), getattr(data, name)
        assert ours.shape == (2, theirs.size) and not ours.flags.writeable
        np.testing.assert_allclose(ours[1], theirs, rtol=1e-7, atol=1e-7, err_msg=name)
    assert np.abs(sim.qfrc_constraint[:, 0]).min() > 0  # the limit


def test_contacts_are_those_of_mujoco(both: tuple[Simulation, mujoco.MjModel, mujoco.MjData]) -> None:
    sim, model, data = both
    ours = sim.contacts(1)
    assert ours["geom"].shape == (data.ncon, 2) and data.ncon > 1
    theirs = []
    for i in range(data.ncon):
        contact, force = data.contact[i], np.zeros(6)
        mujoco.mj_contactForce(model, data, i, force)
        axes = contact.frame.reshape(3, 3)
        theirs.append([*contact.geom, *contact.pos, *axes[0], *(force[:3] @ axes), *(force[3:] @ axes)])
    fields = [ours[name] for name in ("geom", "pos", "normal", "force", "torque")]
    np.testing.assert_allclose(
        by_place(np.concatenate(fields, axis=1)), by_place(np.array(theirs)), rtol=1e-6, atol=1e-6
    )
    with pytest.raises(ValueError, match="agent is 2, expected less than 2"):
        sim.contacts(2)


def test_act_is_checked() -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 1)
    qpos, qvel = np.array(sim.qpos), np.array(sim.qvel)
    with pytest.raises(ValueError, match="act has"):
        sim.reset(qpos, qvel, act=[[0.0, 0.0]])
    with pytest.raises(ValueError, match="act of agent 0 is not finite"):
        sim.reset(qpos, qvel, act=[[np.nan]])
    sim.reset(qpos, qvel, act=[[0.5]])
    assert sim.act.tolist() == [[0.5]]
    sim.reset(qpos, qvel)
    assert sim.act.tolist() == [[0.0]]


HAND = """
<mujoco model="hand">
  <option timestep="0.002" iterations="80" tolerance="1e-12"/>
  <worldbody>
    <geom name="floor" type="plane" size="5 5 1"/>
    <body name="hand" mocap="true" pos="0 0 0.5"><geom size="0.05" contype="0" conaffinity="0"/></body>
    <body name="paddle" mocap="true" pos="0.5 0 0.1"><geom name="paddle" type="box" size="0.02 0.2 0.1"/></body>
    <body name="held" pos="0 0 0.4"><freejoint/><geom name="held" size="0.05"/></body>
    <body name="puck" pos="0.4 0 0.05"><freejoint/><geom type="box" size="0.05 0.05 0.05"/></body>
  </worldbody>
  <equality><weld body1="hand" body2="held"/></equality>
</mujoco>
"""


def test_mocap_bodies_pull_and_push_as_in_mujoco() -> None:
    ours = Model.from_xml_string(HAND)
    assert [ours.body_names[i] for i in ours.mocap_bodies] == ["hand", "paddle"]
    sim = Simulation(ours, 2, isa="f64")
    model = mujoco.MjModel.from_xml_string(HAND)
    data = mujoco.MjData(model)
    before = np.array(sim.qpos)
    for i in range(400):
        hand, turn = [0.2 * i / 400, 0.1, 0.5 + 0.1 * i / 400], [1.0, 0.0, 0.3 * i / 400, 0.0]
        paddle = [0.5 - 0.15 * i / 400, 0.0, 0.1]
        # only the second agent's move
        sim.set_mocap(twice(np.array(hand)), twice(np.array(turn)), body="hand", mask=[False, True])
        sim.set_mocap(twice(np.array(paddle)), body="paddle", mask=[False, True])
        data.mocap_pos[:], data.mocap_quat[0] = [hand, paddle], turn
        sim.step(np.zeros((2, 0)))
        mujoco.mj_step(model, data)
        np.testing.assert_allclose(sim.qpos[1], data.qpos, rtol=1e-6, atol=1e-6, err_msg=f"step {i}")
    assert sim.qpos[1, 0] > 0.1 and sim.qpos[1, 7] < 0.32  # pulled, pushed
    np.testing.assert_allclose(sim.qpos[0, 7:9], before[0, 7:9], atol=1e-3)  # the first agent's puck stands
    unit = data.mocap_quat / np.linalg.norm(data.mocap_quat, axis=1, keepdims=True)
    np.testing.assert_allclose(sim.mocap_pos[1], data.mocap_pos)
    np.testing.assert_allclose(sim.mocap_quat[1], unit)
    snapshot, pose = sim.save(), np.array(sim.body_pos)
    sim.reset(before, np.zeros_like(sim.qvel))
    assert sim.mocap_pos[1, 0].tolist() == [0.0, 0.0, 0.5]
    sim.load(snapshot)
    np.testing.assert_array_equal(sim.body_pos, pose)


def test_wrong_mocap_targets_say_what_is_right() -> None:
    sim = Simulation(Model.from_xml_string(HAND), 2)
    here = np.zeros((2, 3))
    with pytest.raises(ValueError, match="body 'held' is no mocap body; those of the model are 'hand', 'paddle'"):
        sim.set_mocap(here, body="held")
    with pytest.raises(ValueError, match="pos has the shape"):
        sim.set_mocap(np.zeros((3, 3)), body="hand")
    with pytest.raises(ValueError, match="agent 1: pos is NaN, expected finite numbers"):
        sim.set_mocap([[0, 0, 0], [0, np.nan, 0]], body="hand")
    with pytest.raises(ValueError, match="agent 0: pos is 1000"):
        sim.set_mocap([[1e39, 0, 0], [0, 0, 0]], body="hand")
    with pytest.raises(ValueError, match="agent 0: quat is zero, expected a rotation, w x y z"):
        sim.set_mocap(quat=np.zeros((2, 4)), body="hand")
    assert sim.mocap_pos[0, 0].tolist() == [0.0, 0.0, 0.5]  # nothing changed
    none = Simulation(Model.from_xml_string(MODEL), 1)
    with pytest.raises(ValueError, match="body 'arm' is no mocap body; the model has none"):
        none.set_mocap(np.zeros((1, 3)), body="arm")


def test_a_large_quaternion_is_a_rotation() -> None:
    sim = Simulation(Model.from_xml_string(HAND), 1, isa="f64")
    sim.set_mocap(quat=[[1e200] * 4], body="hand")
    np.testing.assert_allclose(sim.mocap_quat[0, 0], 0.5)


def test_masses_must_fit_single_precision() -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 1)
    for wrong in (0.0, 1e39, 1e-46):
        with pytest.raises(ValueError, match="expected a factor from 1e-30 to 1e30"):
            sim.vary(mass=np.full((1, 4), wrong))


def test_a_control_must_be_a_number() -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 2)
    with pytest.raises(ValueError, match="agent 1: ctrl of actuator 1 'turn' is NaN, expected a number"):
        sim.step([[0.0, 0.0], [0.0, np.nan]])


def test_masses_change_the_softness_of_constraints_as_in_mujoco() -> None:
    sim = Simulation(Model.from_xml_string(MODEL), 2, isa="f64")
    model = mujoco.MjModel.from_xml_string(MODEL)
    factors = np.array([1.0, 2.0, 0.5, 3.0])
    sim.vary(mass=np.stack([np.ones(4), factors]))
    model.body_mass[:] *= factors
    model.body_inertia[:] *= factors[:, None]
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data = mujoco.MjData(model)
    for i in range(300):
        sim.step(np.zeros((2, 2)))
        mujoco.mj_step(model, data)
        np.testing.assert_allclose(sim.qpos[1], data.qpos, rtol=1e-5, atol=1e-5, err_msg=f"step {i}")


def test_the_settings_are_those_of_the_file() -> None:
    option = Model.from_xml_string(MODEL).option
    theirs = mujoco.MjModel.from_xml_string(MODEL).opt
    assert (option["integrator"], option["solver"], option["cone"]) == ("Euler", "Newton", "pyramidal")
    for name, value in option.items():
        if not isinstance(value, str):
            np.testing.assert_array_equal(value, getattr(theirs, name), err_msg=name)


def test_an_edited_model_is_that_of_the_edited_file(tmp_path: Path) -> None:
    path = tmp_path / "crane.xml"
    path.write_text(MODEL)
    for model in (Model.from_xml_string(MODEL), Model.from_xml_path(path)):
        edited = model.edit(
            {
                "option": {"timestep": 0.004, "iterations": 30, "gravity": [0, 0, -1.6]},
                "joint": {"swing": {"damping": 1.5, "limited": False}},
                "geom": {"ball": {"condim": None}},
            },
            remove={"body": ["die"], "actuator": ["turn"]},
        )
        assert (edited.timestep, edited.option["iterations"], edited.option["gravity"]) == (0.004, 30, [0, 0, -1.6])
        assert edited.nu == 1 and edited.body_names == ["world", "arm", "ball"]
        # the model itself is as it was
        assert (model.timestep, model.nu) == (0.002, 2)
        again = edited.edit({"option": {"timestep": 0.002}})
        assert again.timestep == 0.002 and again.nu == 1


@pytest.mark.parametrize("kinds", [["body", "geom"], ["geom", "body"]])
def test_elements_are_removed_in_any_order(kinds: list[str]) -> None:
    edited = Model.from_xml_string(MODEL).edit(remove={kind: ["die"] for kind in kinds})
    assert edited.body_names == ["world", "arm", "ball"] and edited.geom_names == ["floor", "arm", "ball"]


def test_a_wrong_edit_says_what_is_right() -> None:
    model = Model.from_xml_string(MODEL)
    wrong = [
        ({"geoms": {"floor": {}}}, "there is no kind of elements 'geoms'; did you mean 'geom'?"),
        ({"geom": {"flor": {"size": 1.0}}}, "did you mean 'floor'"),
        ({"geom": {"floor": {"sise": "1 1 1"}}}, "did you mean 'size'"),
        ({"geom": {"floor": 3}}, "geom 'floor' is 3, expected a dict"),
        ({"geom": {"ball": {"size": object}}}, "attribute 'size' of geom 'ball' is"),
        ({"option": {"iterations": -3}}, "iterations"),
        ({"option": 3}, "changes['option'] is 3, expected a dict"),
    ]
    for changes, message in wrong:
        with pytest.raises(ValueError, match=re.escape(message)):
            model.edit(changes)
    with pytest.raises(ValueError, match="remove\\['body'\\] is a text, expected a list of names"):
        model.edit({}, remove={"body": "die"})
    with pytest.raises(ValueError, match="the world cannot be removed"):
        model.edit({}, remove={"body": ["world"]})

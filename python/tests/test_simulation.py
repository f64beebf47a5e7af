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

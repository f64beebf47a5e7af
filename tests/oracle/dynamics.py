"""Random states of MJCF models and what MuJoCo makes of them.

Reads a JSON list of jobs from standard input, one per model:
    {"xml": path, "states": n, "seed": s, "ground_only": bool, "near_floor": bool, "spread": x, "pushes": bool, "vary": bool}
and prints a JSON list with, per job, the states and MuJoCo's accelerations, forces, mass matrices, contact counts,
sensor values and next states. States and controls are rounded to single precision so that both sides start alike.
"""

import copy
import json
import sys
from pathlib import Path

import mujoco
import numpy as np

from converging import solve_to_the_end

sys.path.append(str(Path(__file__).resolve().parents[2] / "crates/cli/src/bench"))
from mujoco_side import ground_contacts_only  # the benchmark's: what is compared and what is timed are the same contacts


def lowest_point(model, data):
    """Lower bound of the height of every moving geom that can touch the floor."""
    low = np.inf
    for g in range(model.ngeom):
        kind = model.geom_type[g]
        moving = model.body_weldid[model.geom_bodyid[g]] != 0
        if not moving or not (model.geom_contype[g] or model.geom_conaffinity[g]):
            continue
        z_axis = abs(data.geom_xmat[g].reshape(3, 3)[2, 2])
        size = model.geom_size[g]
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            reach = size[0] + size[1] * z_axis
        elif kind == mujoco.mjtGeom.mjGEOM_BOX:
            reach = float(np.abs(data.geom_xmat[g].reshape(3, 3)[2]) @ size)
        else:
            reach = size[0]
        low = min(low, data.geom_xpos[g, 2] - reach)
    return low


def vertical_coordinate(model):
    """Index of the coordinate that lifts the first tree, if there is one."""
    for j in range(model.njnt):
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE:
            return model.jnt_qposadr[j] + 2
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE and abs(model.jnt_axis[j][2]) > 0.99:
            return model.jnt_qposadr[j]
    return None


def draw_joint(model, j, q, rng, reach):
    """Turns a ball joint at random, draws a joint within its limits and a little beyond, or moves it by up to `reach`."""
    a = model.jnt_qposadr[j]
    if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL:
        q[a : a + 4] = rng.normal(size=4)
        q[a : a + 4] /= np.linalg.norm(q[a : a + 4])
    elif model.jnt_limited[j]:
        low, high = model.jnt_range[j]
        slack = 0.05 * (high - low)
        q[a] = rng.uniform(low - slack, high + slack)
    else:
        q[a] += rng.uniform(-reach, reach)


def random_state(model, rng, near_floor, spread=None):
    q = model.qpos0.copy()
    v = rng.normal(size=model.nv)
    for j in range(model.njnt):
        a, kind = model.jnt_qposadr[j], model.jnt_type[j]
        if kind == mujoco.mjtJoint.mjJNT_FREE and spread is not None:
            # near the reference, so that bodies meet each other and what stands around them
            q[a : a + 3] += spread * rng.normal(size=3)
            q[a + 3 : a + 7] = rng.normal(size=4)
            q[a + 3 : a + 7] /= np.linalg.norm(q[a + 3 : a + 7])
        elif kind == mujoco.mjtJoint.mjJNT_FREE:
            q[a : a + 2] += rng.normal(size=2)
            q[a + 3 : a + 7] = rng.normal(size=4)
            q[a + 3 : a + 7] /= np.linalg.norm(q[a + 3 : a + 7])
        else:
            draw_joint(model, j, q, rng, 1.5)
    z = vertical_coordinate(model)
    if near_floor and z is not None:
        data = mujoco.MjData(model)
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        low = lowest_point(model, data)
        if np.isfinite(low):
            # mostly just inside the floor, sometimes in the air
            q[z] += -low + (-rng.uniform(0, 0.02) if rng.random() < 0.9 else 0.5)
    low = np.where(model.actuator_ctrllimited, model.actuator_ctrlrange[:, 0], -1.0) if model.nu else np.zeros(0)
    high = np.where(model.actuator_ctrllimited, model.actuator_ctrlrange[:, 1], 1.0) if model.nu else np.zeros(0)
    u = rng.uniform(1.2 * low, 1.2 * high) if model.nu else np.zeros(0)
    return [x.astype(np.float32).astype(np.float64) for x in (q, v, u)]


def full_mass_matrix(model, data):
    dense = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, dense, data.qM)
    except (TypeError, AttributeError):
        mujoco.mj_fullM(model, data, dense)
    return dense


def pushed(model, data):
    """Joint forces of the forces on bodies."""
    total = np.zeros(model.nv)
    for b in range(1, model.nbody):
        if np.any(data.xfrc_applied[b]):
            mujoco.mj_applyFT(
                model, data, data.xfrc_applied[b, :3], data.xfrc_applied[b, 3:], data.xipos[b], b, total
            )
    return total


def vary(model, rng, original):
    """Edits masses, friction, strength and gravity in place and returns their factors."""
    factor = lambda n, low, high: rng.uniform(low, high, n).astype(np.float32).astype(np.float64)
    mass = factor(model.nbody, 0.5, 2.0)
    for b in range(model.nbody):
        weld = model.body_weldid[b]
        mass[b] = mass[weld] if model.body_dofnum[weld] else 1.0
    friction = float(factor(1, 0.3, 1.5)[0])
    strength = factor(model.nu, 0.5, 1.5)
    gravity = (original.opt.gravity + factor(3, -1.0, 1.0)).astype(np.float32).astype(np.float64)
    # the shortcut for bodies without relatives uses numbers that were compiled
    model.body_simple[:] = 0
    model.dof_simplenum[:] = 0
    model.body_mass[:] = original.body_mass * mass
    model.body_subtreemass[:] = 0
    for b in range(model.nbody - 1, -1, -1):
        model.body_subtreemass[b] += model.body_mass[b]
        if b:
            model.body_subtreemass[model.body_parentid[b]] += model.body_subtreemass[b]
    model.body_inertia[:] = original.body_inertia * mass[:, None]
    model.geom_friction[:] = original.geom_friction * friction
    model.pair_friction[:] = original.pair_friction * friction
    model.actuator_gainprm[:, :3] = original.actuator_gainprm[:, :3] * strength[:, None]
    model.actuator_biasprm[:, :3] = original.actuator_biasprm[:, :3] * strength[:, None]
    model.actuator_forcerange[:] = original.actuator_forcerange * strength[:, None]
    model.opt.gravity[:] = gravity
    # inverse weights of the new masses; masses alone, since lengths at rest are those of the model
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return {
        "mass": mass.tolist(),
        "friction": friction,
        "strength": strength.tolist(),
        "gravity": gravity.tolist(),
    }


def draw_mocaps(model, rng):
    """Poses of the mocap bodies near those of the model: position and quaternion, a row per body."""
    poses = np.zeros((model.nmocap, 7))
    for body in np.flatnonzero(model.body_mocapid >= 0):
        quat = model.body_quat[body] + 0.2 * rng.normal(size=4)
        poses[model.body_mocapid[body], :3] = model.body_pos[body] + 0.1 * rng.normal(size=3)
        poses[model.body_mocapid[body], 3:] = quat / np.linalg.norm(quat)
    return poses.astype(np.float32).astype(np.float64)


def deep_in_field(model, data):
    """Whether a shape reaches into a height field with more than its rounding.

    MuJoCo finds such contacts by iteration, and where two ways out are equally long the choice is a matter of rounding.
    """
    for c in data.contact:
        kinds = [model.geom_type[g] for g in c.geom]
        if mujoco.mjtGeom.mjGEOM_HFIELD in kinds:
            other = c.geom[1 - kinds.index(mujoco.mjtGeom.mjGEOM_HFIELD)]
            round_shape = model.geom_type[other] != mujoco.mjtGeom.mjGEOM_BOX
            if c.dist < (-0.9 * model.geom_size[other, 0] if round_shape else 0):
                return True
    return False


def run(job):
    model = mujoco.MjModel.from_xml_path(job["xml"])
    if job.get("ground_only", True):
        ground_contacts_only(model)
    solve_to_the_end(model.opt)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(job.get("seed", 0))
    states = []
    original = copy.deepcopy(model)
    # penetrations of height fields are found by iteration
    model.opt.ccd_tolerance = 1e-12
    model.opt.ccd_iterations = 200
    for _ in range(job["states"]):
        q, v, u = random_state(model, rng, job.get("near_floor", True), job.get("spread"))
        act = rng.uniform(-0.5, 0.5, model.na).astype(np.float32)
        push = np.zeros((model.nbody, 6))
        if job.get("pushes"):
            push[1:] = rng.normal(size=(model.nbody - 1, 6)).astype(np.float32)

        def restart():
            mujoco.mj_resetData(model, data)
            data.qpos[:], data.qvel[:], data.ctrl[:], data.act[:] = q, v, u, act
            data.xfrc_applied[:] = push
            data.mocap_pos[:], data.mocap_quat[:] = mocap[:, :3], mocap[:, 3:]

        own = vary(model, rng, original) if job.get("vary") else None
        mocap = draw_mocaps(model, rng)
        restart()
        mujoco.mj_forward(model, data)
        mujoco.mj_rnePostConstraint(model, data)
        state = {
            "own": own,
            "deep": deep_in_field(model, data),
            "act": act.tolist(),
            "xfrc": push.ravel().tolist(),
            "mocap": mocap.tolist(),
            "qpos": q.tolist(),
            "qvel": v.tolist(),
            "ctrl": u.tolist(),
            "qacc": data.qacc.tolist(),
            "qfrc_constraint": data.qfrc_constraint.tolist(),
            "qfrc_bias": data.qfrc_bias.tolist(),
            "qfrc_applied": (data.qfrc_passive + data.qfrc_actuator + pushed(model, data)).tolist(),
            "qfrc_actuator": data.qfrc_actuator.tolist(),
            "cinert": data.cinert[1:].ravel().tolist(),
            "cvel": data.cvel[1:].ravel().tolist(),
            "cfrc_ext": data.cfrc_ext[1:].ravel().tolist(),
            "qM": full_mass_matrix(model, data).ravel().tolist(),
            # contacts in the gap exert no force and are not constraints
            "ncon": int(np.sum(data.contact.exclude == 0)),
            "sensordata": data.sensordata.tolist(),
            "xpos": data.xpos.ravel().tolist(),
            "geom_xpos": data.geom_xpos.ravel().tolist(),
        }
        restart()
        mujoco.mj_step(model, data)
        state["next_act"] = data.act.tolist()
        state["next_qpos"] = data.qpos.tolist()
        state["next_qvel"] = data.qvel.tolist()
        states.append(state)
    return {"xml": job["xml"], "states": states}


if __name__ == "__main__":
    json.dump([run(job) for job in json.load(sys.stdin)], sys.stdout)

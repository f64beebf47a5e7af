"""Random models that use everything Marathon supports, and what MuJoCo makes of them.

    python tests/oracle/random_models.py 17        prints the model of seed 17
    python tests/oracle/random_models.py 17 --draft    with every draw of its states and why it was left out

Otherwise reads a job in JSON from standard input:
    {"first": seed, "count": models, "states": states per model}
and prints a line of JSON per model:
    {"seed": s, "xml": text, "compiled": every number of the compiled model as compiled_model.py has it,
     "states": [..], "skipped": draws that were left out}
or, where MuJoCo does not compile the model, {"seed": s, "xml": text, "error": why}. A seed's model does not depend on
the others. States are such that MuJoCo's answer is well defined, as in foreign_models.py; "single" tells whether it is
so for the rounding of single precision too, "noisy" of which sensor values it is not so, "weightless" that it is not so of
what constraints do.

With {"judge": [{"seed": s, "state": index, "states": as above, "qacc": [..]}]} instead, prints per entry how far from the
minimum of MuJoCo's own problem both accelerations are: {"ours": .., "mujoco": ..}, as norms of the gradient relative to
the forces.
"""

import json
import sys

import mujoco
import numpy as np

import compiled_model
import dynamics
from converging import converges, solve_to_the_end
from foreign_models import LARGEST_ACCELERATION, put, warned
from model_generator import Generator, random_model, with_keyframe

# by how much positions are moved to see what rounding does to the answer, and by how much the answer may change then
NUDGE, CHANGE = 1e-9, 1e-4
SINGLE_NUDGE, SINGLE_CHANGE = 2e-7, 2e-3
# a change of positions that only makes double precision round otherwise; how much coarser single precision rounds
LAST_DIGIT, COARSER = 2e-16, 2.0**29
# draws per state that is asked for
PATIENCE = 8


def random_state(model, rng):
    """Positions near the reference, within the limits and a little beyond; velocities, controls, activations."""
    q, v = model.qpos0.copy(), rng.normal(size=model.nv) * rng.choice([0.3, 1.0])
    for j in range(model.njnt):
        a, kind = model.jnt_qposadr[j], model.jnt_type[j]
        if kind == mujoco.mjtJoint.mjJNT_FREE:
            q[a : a + 3] += 0.15 * rng.normal(size=3)
            q[a + 3 : a + 7] = rng.normal(size=4)
            q[a + 3 : a + 7] /= np.linalg.norm(q[a + 3 : a + 7])
        else:
            dynamics.draw_joint(model, j, q, rng, 1.0 if kind == mujoco.mjtJoint.mjJNT_HINGE else 0.2)
    z = dynamics.vertical_coordinate(model)
    if z is not None and rng.random() < 0.5:
        data = mujoco.MjData(model)
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        low = dynamics.lowest_point(model, data)
        if np.isfinite(low):
            q[z] -= low + rng.uniform(0, 0.02)
    u = rng.uniform(-1.2, 1.2, model.nu)
    act = rng.uniform(-0.5, 0.5, model.na)
    push = rng.normal(size=(model.nbody, 6)) if rng.random() < 0.2 else np.zeros((model.nbody, 6))
    push[0] = 0
    mocap = dynamics.draw_mocaps(model, rng)
    return [x.astype(np.float32).astype(np.float64) for x in (q, v, u, act, push, mocap)]


def tightened(model):
    """Solves to the end, if the model's cap does not end the solver before."""
    if converges(model.opt):
        solve_to_the_end(model.opt)
    model.opt.ccd_tolerance = 1e-15
    model.opt.ccd_iterations = 1000
    return model


def place(model, data, state):
    put(model, data, state[:4])
    data.xfrc_applied[:] = state[4]
    data.mocap_pos[:], data.mocap_quat[:] = state[5][:, :3], state[5][:, 3:]


def forward(model, data, state):
    place(model, data, state)
    mujoco.mj_forward(model, data)


def step(model, data, state):
    place(model, data, state)
    mujoco.mj_step(model, data)
    return np.concatenate([data.qpos, data.qvel, data.act])


def relative(a, b):
    return np.linalg.norm(a - b) / max(np.linalg.norm(b), 1.0)


def moved(model, state, rng, by):
    """A state with positions moved by `by` in a random direction."""
    q = state[0].copy()
    mujoco.mj_integratePos(model, q, rng.normal(size=model.nv), by)
    return [q, *state[1:]]


def weightless(model, data):
    """Whether a constraint acts on bodies that only turn about their centers of mass, a weld on bodies that only slide, or one
    on a string that they hardly move: MuJoCo has 1e-15 for their inverse weight, and rounding decides what such a constraint does."""
    pairs, welded = [model.geom_bodyid[c.geom] for c in data.contact if not c.exclude], []
    for i in np.flatnonzero(data.eq_active):
        ends = [model.eq_obj1id[i], model.eq_obj2id[i]]
        if mujoco.mjtEq(model.eq_type[i]) in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            sites = mujoco.mjtObj(model.eq_objtype[i]) == mujoco.mjtObj.mjOBJ_SITE
            pairs.append(model.site_bodyid[ends] if sites else ends)
            if mujoco.mjtEq(model.eq_type[i]) == mujoco.mjtEq.mjEQ_WELD:
                welded.append(pairs[-1])

    # strings that nothing moves in the reference configuration
    bound = (model.tendon_limited != 0) | (model.tendon_frictionloss > 0)
    for i in np.flatnonzero(data.eq_active & (model.eq_type == int(mujoco.mjtEq.mjEQ_TENDON))):
        bound[[k for k in (model.eq_obj1id[i], model.eq_obj2id[i]) if k >= 0]] = True
    if np.any(model.tendon_invweight0[bound] < 1e-8):
        return True

    def nothing(bodies, k):
        weights = model.body_invweight0[bodies].sum(axis=0)
        return weights[k] < 1e-8 < weights[1 - k]

    return any(nothing(p, 0) for p in pairs) or any(nothing(p, 1) for p in welded)


def answer(model, data, state, rng):
    """Return MuJoCo's results for a state, or the reason why it has no definite answer."""
    forward(model, data, state)
    acc, constraint, contacts = data.qacc.copy(), data.qfrc_constraint.copy(), data.ncon
    if warned(data) or not np.isfinite(acc).all() or np.abs(acc).max(initial=0.0) > LARGEST_ACCELERATION:
        return "too fast"
    if dynamics.deep_in_field(model, data):
        return "deep in a height field"
    after = step(model, data, state)
    # beyond a radian per step nothing is integrated well
    if warned(data) or not np.abs(data.qvel).max() * model.opt.timestep < 1:
        return "too fast"

    def changes(by):
        """By how much the answers change, or infinity where contacts do."""
        nudged = moved(model, state, rng, by)
        forward(model, data, nudged)
        if data.ncon != contacts:
            return np.inf
        return max(relative(data.qacc, acc), relative(step(model, data, nudged), after))

    if changes(NUDGE) > CHANGE:
        return "ill-conditioned"
    single = all(changes(SINGLE_NUDGE) < SINGLE_CHANGE for _ in range(3))
    # single precision rounds within the step, too: forces that cancel leave nothing of its digits
    noises, own = [], np.random.default_rng(0)
    for _ in range(8):
        nudged = moved(model, state, own, LAST_DIGIT)
        change = relative(step(model, data, nudged), after)
        forward(model, data, nudged)
        if not converges(model.opt):
            change = max(change, relative(data.qfrc_constraint, constraint))
            single &= COARSER * change < SINGLE_CHANGE
        noises.append(data.sensordata.copy())
    sensors = []
    for by in [NUDGE, -NUDGE]:
        shifted = mujoco.MjModel.__copy__(model)
        shifted.geom_margin += by
        shifted.pair_margin += by
        shifted.site_size *= 1 + by
        forward(shifted, data, state)
        if data.ncon != contacts:
            return "on the edge of a contact"
        if relative(data.qacc, acc) > CHANGE:
            return "ill-conditioned"
        sensors.append(data.sensordata.copy())
    forward(model, data, state)
    mujoco.mj_rnePostConstraint(model, data)
    noise = COARSER * np.max(np.abs(noises - data.sensordata), axis=0)
    noisy = noise > SINGLE_CHANGE * (1 + np.abs(data.sensordata))
    jumps = [np.abs(s - data.sensordata) > CHANGE * (1 + np.abs(s)) for s in sensors]
    if any(c.exclude for c in data.contact):
        # contacts without force are counted by MuJoCo's sensors and not by ours
        for kind, start, count in zip(model.sensor_type, model.sensor_adr, model.sensor_dim):
            jumps[0][start : start + count] |= mujoco.mjtSensor(kind) == mujoco.mjtSensor.mjSENS_CONTACT
    q, v, u, act, push, mocap = state
    nq, nv = model.nq, model.nv
    return {
        "qpos": q, "qvel": v, "ctrl": u, "act": act, "xfrc": push.ravel(), "single": bool(single), "mocap": mocap,
        "weightless": weightless(model, data),
        "qacc": data.qacc, "qfrc_constraint": data.qfrc_constraint, "qfrc_bias": data.qfrc_bias,
        "qfrc_applied": data.qfrc_passive + data.qfrc_actuator + dynamics.pushed(model, data),
        "qfrc_actuator": data.qfrc_actuator, "qM": dynamics.full_mass_matrix(model, data).ravel(),
        "cfrc_ext": data.cfrc_ext[1:].ravel(), "ncon": int(np.sum(data.contact.exclude == 0)),
        "xpos": data.xpos.ravel(), "geom_xpos": data.geom_xpos.ravel(),
        "sensordata": [None if jump else x for x, jump in zip(data.sensordata.tolist(), np.any(jumps, axis=0))],
        "next_qpos": after[:nq], "next_qvel": after[nq : nq + nv], "next_act": after[nq + nv :],
        "noisy": noisy,
    }


def states_of(model, seed, count, tell=lambda why: None):
    """States in which the answer is definite, and the number of draws that were left out."""
    data = mujoco.MjData(model)
    rng = np.random.default_rng([2028, seed])
    states, drawn = [], 0
    while len(states) < count and drawn < PATIENCE * count:
        drawn += 1
        found = answer(model, data, random_state(model, rng), rng)
        tell(found if isinstance(found, str) else "taken")
        if not isinstance(found, str):
            states.append({k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in found.items()})
    return states, drawn - len(states)


def run(seed, count):
    xml = Generator(seed).model()
    try:
        xml = with_keyframe(xml, np.random.default_rng([2027, seed]))
        model = mujoco.MjModel.from_xml_string(xml)
    except ValueError as error:
        return {"seed": seed, "xml": xml, "error": str(error)}
    out = {"seed": seed, "xml": xml, "compiled": compiled_model.dump(model)}
    out["states"], out["skipped"] = states_of(tightened(model), seed, count)
    return out


def gradient(model, data, acc):
    """How far an acceleration is from the minimum of the constraint problem: the norm of the gradient."""
    jar = np.zeros(data.nefc)
    if data.nefc:
        mujoco.mj_mulJacVec(model, data, jar, acc)
        jar -= data.efc_aref
    cost = np.zeros(1)
    mujoco.mj_constraintUpdate(model, data, jar, cost, 1)
    force = np.zeros(model.nv)
    if data.nefc:
        mujoco.mj_mulJacTVec(model, data, force, data.efc_force)
    inertia = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, inertia, acc)
    scale = max(np.linalg.norm(force), np.linalg.norm(data.qfrc_smooth), 1e-6)
    return float(np.linalg.norm(inertia - data.qfrc_smooth - force) / scale)


def judge(entry):
    model = tightened(mujoco.MjModel.from_xml_string(random_model(entry["seed"])))
    states, _ = states_of(model, entry["seed"], entry["states"])
    s = states[entry["state"]]
    data = mujoco.MjData(model)
    state = [np.array(s[k]) for k in ["qpos", "qvel", "ctrl", "act"]]
    state += [np.array(s["xfrc"]).reshape(-1, 6), np.array(s["mocap"]).reshape(-1, 7)]
    forward(model, data, state)
    return {"ours": gradient(model, data, np.array(entry["qacc"])), "mujoco": gradient(model, data, np.array(s["qacc"]))}


def main():
    # warnings are counted in the data
    mujoco.set_mju_user_warning(lambda message: None)
    if sys.argv[1:]:
        seed = int(sys.argv[1])
        print(random_model(seed), end="")
        if "--draft" in sys.argv:
            model = tightened(mujoco.MjModel.from_xml_string(random_model(seed)))
            states_of(model, seed, 3, print)
        return
    job = json.load(sys.stdin)
    if "judge" in job:
        json.dump([judge(entry) for entry in job["judge"]], sys.stdout)
        return
    for seed in range(job["first"], job["first"] + job["count"]):
        print(json.dumps(run(seed, job["states"]), default=compiled_model.plain), flush=True)


if __name__ == "__main__":
    main()

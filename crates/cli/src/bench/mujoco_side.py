"""MuJoCo's side of `marathon bench physics --against mujoco`: the same workload through `mujoco.rollout`.

The command runs this text with `python -c` and talks to it in lines of JSON, a request and an answer each:

    (start)                                         {"mujoco": version}, or {"missing": why}
    {"xml": text or "path": file, "agents": n, "threads": t, "warmup": s, "steps": s, "hold": s, "limp": bool,
     "contacts": "ground" or "all", "scenes": [..]} {}
    {"seconds": s}                                  {"steps": n, "cpu": s, "wall": s, "contacts": x, "broken": n}

Protocol: hinges off by up to 0.1 rad and velocities up to 0.1, warm up, then time steps under uniform random controls
held for `hold` steps. No agent is reset. The model's own integrator and solver settings, sensors off, double precision.
A scene has `starts` of agents, qpos and qvel, `controls` by decision, [agents][nu] row-major, and `hold`, the steps of a
decision; with scenes, a repetition is all of them, without a warm-up, and each thread has its own copy of the agents.
"""

import json
import os
import sys
import tempfile
import time

try:
    import mujoco
    import numpy as np
    from mujoco import rollout

    rollout.Rollout
    missing = None
except ImportError as error:
    missing = str(error)
except AttributeError:
    missing = f"MuJoCo {mujoco.__version__} has no rollout.Rollout"

# steps between two at which contacts are counted, off the clock
COUNT_EVERY = 40


def ground_contacts_only(model):
    """Keeps the contacts of moving geoms with static ones, as the geoms' masks have them, and no others."""
    static = [g for g in range(model.ngeom) if model.body_weldid[model.geom_bodyid[g]] == 0]
    contype, conaffinity = model.geom_contype.copy(), model.geom_conaffinity.copy()
    for g in range(model.ngeom):
        if g in static:
            continue
        meets = any((contype[g] & conaffinity[s]) or (contype[s] & conaffinity[g]) for s in static)
        model.geom_contype[g] = 1 if meets else 0
        model.geom_conaffinity[g] = 0
    for s in static:
        model.geom_contype[s] = 0
        model.geom_conaffinity[s] = 1


class Workload:
    """The agents of one model."""

    def __init__(self, job):
        if "path" in job:
            self.model = mujoco.MjModel.from_xml_path(job["path"])
        else:
            self.model = mujoco.MjModel.from_xml_string(job["xml"])
        if job["contacts"] == "ground":
            ground_contacts_only(self.model)
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        if job["limp"]:
            self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
        self.agents, self.threads, self.hold = job["agents"], job["threads"], job["hold"]
        self.warmup, self.steps = job["warmup"], job["steps"]
        self.kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.rng = np.random.default_rng(1)
        self.datas = [mujoco.MjData(self.model) for _ in range(self.threads)]
        self.size = mujoco.mj_stateSize(self.model, self.kind)
        self.scenes = [self.scene(scene) for scene in job["scenes"]]
        if self.scenes:
            self.warmup, self.steps = 0, self.scenes[0][1].shape[1]
        # written once before the clock starts: the first touch of memory is not physics
        self.out = np.empty((self.agents, self.steps, self.size))
        self.out.fill(0.0)
        self.runner = rollout.Rollout(nthread=self.threads if self.threads > 1 else 0)

    def starts(self):
        model, data = self.model, self.datas[0]
        start = np.zeros((self.agents, self.size))
        for agent in range(self.agents):
            mujoco.mj_resetData(model, data)
            for joint in range(model.njnt):
                if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_HINGE:
                    data.qpos[model.jnt_qposadr[joint]] += 0.1 * self.rng.uniform(-1, 1)
            data.qvel[:] = 0.1 * self.rng.uniform(-1, 1, model.nv)
            mujoco.mj_getState(model, data, start[agent], self.kind)
        return start

    def controls(self, steps):
        held = self.rng.uniform(-1, 1, (self.agents, -(-steps // self.hold), self.model.nu))
        return np.ascontiguousarray(np.repeat(held, self.hold, axis=1)[:, :steps])

    def scene(self, scene):
        """The agents' starts and controls in a scene."""
        model, data = self.model, self.datas[0]
        start = np.zeros((len(scene["starts"]), self.size))
        for agent, (qpos, qvel) in enumerate(scene["starts"]):
            mujoco.mj_resetData(model, data)
            data.qpos[:], data.qvel[:] = qpos, qvel
            mujoco.mj_getState(model, data, start[agent], self.kind)
        held = np.array(scene["controls"]).reshape(len(scene["controls"]), len(start), model.nu).swapaxes(0, 1)
        controls = np.repeat(held, scene["hold"], axis=1)
        return np.tile(start, (self.threads, 1)), np.ascontiguousarray(np.tile(controls, (self.threads, 1, 1)))

    def drawn(self):
        """Random starts, some steps later, and random controls."""
        warm = self.starts()
        if self.warmup:
            states, _ = self.runner.rollout(self.model, self.datas, warm, self.controls(self.warmup))
            warm = np.ascontiguousarray(states[:, -1])
        return warm, self.controls(self.steps)

    def repeat(self, warm, controls):
        """One repetition: processor seconds, seconds passed, contacts of an agent, agents that broke down."""
        cpu, wall = time.process_time(), time.perf_counter()
        self.runner.rollout(self.model, self.datas, warm, controls, state=self.out)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
        # a rollout stops at the first warning and repeats its state; the first entry of a state is the time
        passed = (self.warmup + self.steps) * self.model.opt.timestep
        late = np.abs(self.out[:, -1, 0] - passed) > 0.5 * self.model.opt.timestep
        broken = int(np.sum(late | ~np.isfinite(self.out[:, -1]).all(axis=1)))
        return cpu, wall, self.contacts(), broken

    def contacts(self):
        data, total = self.datas[0], 0
        counted = range(0, self.steps, COUNT_EVERY)
        for agent in range(self.agents):
            for step in counted:
                mujoco.mj_setState(self.model, data, self.out[agent, step], self.kind)
                mujoco.mj_fwdPosition(self.model, data)
                # contacts in the gap exert no force
                total += int(np.count_nonzero(data.contact.exclude == 0))
        return total / (self.agents * len(counted))

    def measure(self, seconds):
        repetitions = []
        while not repetitions or sum(r[0] for r in repetitions) < seconds * self.threads:
            parts = self.scenes or [self.drawn()]
            repetitions.extend(self.repeat(*part) for part in parts)
        cpu, wall, contacts, broken = (sum(column) for column in zip(*repetitions))
        steps = len(repetitions) * self.agents * self.steps
        return {"steps": steps, "cpu": cpu, "wall": wall, "contacts": contacts / len(repetitions), "broken": broken}


def serve(channel):
    """Answers the requests on standard input."""

    def answer(fields):
        channel.write(json.dumps(fields) + "\n")
        channel.flush()

    if missing:
        answer({"missing": missing})
        return
    answer({"mujoco": mujoco.__version__})
    workload = None
    for line in sys.stdin:
        job = json.loads(line)
        try:
            if "seconds" in job:
                answer(workload.measure(job["seconds"]))
            else:
                workload = Workload(job)
                answer({})
        except (ValueError, mujoco.FatalError) as error:
            answer({"error": str(error)})


if __name__ == "__main__":
    # MuJoCo prints its warnings, and writes them to a file in the working directory
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        serve(answers)
        os.chdir("/")

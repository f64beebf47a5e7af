"""MuJoCo's side of `marathon bench physics`: the same workload through `mujoco.rollout`.

    bench_mujoco.py MODEL.xml [--agents 64] [--warmup 200] [--steps 400] [--threads 1]

Prints one JSON object. Protocol: start off by up to 0.1 rad, warm up, then time steps under uniform random controls held
for four steps; ground contacts only, Euler, sensors off, default solver settings. CPU time of the process.
"""

import argparse
import json
import time

import mujoco
import numpy as np
from mujoco import rollout

from dynamics import ground_contacts_only


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("model")
    parser.add_argument("--agents", type=int, default=64)
    parser.add_argument("--warmup", type=int, default=200)
    parser.add_argument("--steps", type=int, default=400)
    parser.add_argument("--threads", type=int, default=1)
    args = parser.parse_args()

    model = mujoco.MjModel.from_xml_path(args.model)
    ground_contacts_only(model)
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    rng = np.random.default_rng(1)
    data = mujoco.MjData(model)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    start = np.zeros((args.agents, mujoco.mj_stateSize(model, kind)))
    for i in range(args.agents):
        mujoco.mj_resetData(model, data)
        for j in range(model.njnt):
            if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE:
                data.qpos[model.jnt_qposadr[j]] += 0.1 * rng.uniform(-1, 1)
        data.qvel[:] = 0.1 * rng.uniform(-1, 1, model.nv)
        mujoco.mj_getState(model, data, start[i], kind)

    def controls(steps):
        held = rng.uniform(-1, 1, (args.agents, (steps + 3) // 4, model.nu))
        return np.repeat(held, 4, axis=1)[:, :steps]

    datas = [mujoco.MjData(model) for _ in range(args.threads)]
    with rollout.Rollout(nthread=args.threads if args.threads > 1 else 0) as runner:
        states, _ = runner.rollout(model, datas, start, controls(args.warmup))
        warm = np.ascontiguousarray(states[:, -1])
        u = controls(args.steps)
        out = np.zeros((args.agents, args.steps, start.shape[1]))
        cpu, wall = time.process_time(), time.perf_counter()
        runner.rollout(model, datas, warm, u, state=out)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
    steps = args.agents * args.steps
    print(
        json.dumps(
            {
                "model": args.model,
                "version": mujoco.__version__,
                "threads": args.threads,
                "ns_per_agent_step": cpu / steps * 1e9,
                "wall_ns_per_agent_step": wall / steps * 1e9,
                "finite": bool(np.isfinite(out).all()),
            }
        )
    )


if __name__ == "__main__":
    main()

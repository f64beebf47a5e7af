// Marathon's module and MuJoCo's own, under the same workload, in a page or in Node: many agents of one model that nobody resets, with
// random controls that are held for one decision.

/** Agents with the physics steps of a decision. */
export const AGENTS = { "Hopper-v0": "hopper", "Walker2d-v0": "walker2d", "Ant-v0": "ant", "Humanoid-v0": "humanoid" };
/** Different controls of an agent before they repeat. */
const STOCK = 251;

/** Random numbers from -1 to 1 (mulberry32). */
function uniform(seed) {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let z = Math.imul(state ^ (state >>> 15), state | 1);
    z ^= z + Math.imul(z ^ (z >>> 7), z | 61);
    return ((z ^ (z >>> 14)) >>> 0) / 2 ** 31 - 1;
  };
}

/** Environments of Marathon: physics, observations and rewards. */
export async function marathon(load, options) {
  const module = await load(options);
  let env, actions, at;
  return {
    info: module.lanes,
    begin({ task, many, seed }) {
      env?.free();
      env = module.env(task, { agents: many, seed, autoreset: "disabled", max_episode_steps: 0 });
      const next = uniform(seed);
      actions = Array.from({ length: STOCK }, () => Float32Array.from({ length: many * env.spec.act }, next));
      at = 0;
      return env.spec.frame_skip;
    },
    advance(decisions) {
      for (let i = 0; i < decisions; i++, at++) env.step(actions[at % STOCK]);
    },
    /** Trains a task for a number of decisions. */
    learn({ task, steps }) {
      const trainer = module.trainer(task, { run: { total_steps: steps, seed: 1 } });
      let last = null;
      while (!trainer.done) last = trainer.iterate();
      trainer.free();
      return { steps: last.steps, return_mean: last.return_mean };
    },
  };
}

/** MuJoCo's module: physics only, without sensors, and without contacts between parts of an agent, which the tasks do not have. */
export async function mujoco(load, models) {
  const mj = await load();
  let model, datas = [], ctrls = [], stock = [], at = 0, skip = 1;
  return {
    info: mj.mj_versionString?.() ?? "",
    begin({ task, many, seed, frame_skip }) {
      datas.forEach((data) => data.delete());
      model?.delete();
      model = mj.MjModel.from_xml_string(models[task]);
      const fixed = (g) => model.body_weldid[model.geom_bodyid[g]] === 0;
      const contype = Array.from(model.geom_contype);
      const conaffinity = Array.from(model.geom_conaffinity);
      const geoms = contype.map((_, g) => g);
      const statics = geoms.filter(fixed);
      for (const g of geoms.filter((g) => !fixed(g))) {
        const meets = statics.some((s) => contype[g] & conaffinity[s] || contype[s] & conaffinity[g]);
        model.geom_contype[g] = meets ? 1 : 0;
        model.geom_conaffinity[g] = 0;
      }
      for (const s of statics) {
        model.geom_contype[s] = 0;
        model.geom_conaffinity[s] = 1;
      }
      model.opt.disableflags |= mj.mjtDisableBit.mjDSBL_SENSOR.value;
      datas = Array.from({ length: many }, () => new mj.MjData(model));
      const next = uniform(seed);
      stock = datas.map(() => Array.from({ length: STOCK }, () => Float64Array.from({ length: model.nu }, next)));
      ctrls = datas.map((data) => data.ctrl);
      [at, skip] = [0, frame_skip];
      return frame_skip;
    },
    advance(decisions) {
      for (let n = 0; n < decisions; n++, at++) {
        for (let i = 0; i < datas.length; i++) {
          // the view ends when the module's memory grows
          if (ctrls[i].length === 0) ctrls[i] = datas[i].ctrl;
          ctrls[i].set(stock[i][at % STOCK]);
          for (let k = 0; k < skip; k++) mj.mj_step(model, datas[i]);
        }
      }
    },
  };
}

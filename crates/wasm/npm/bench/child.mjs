// One side of the benchmark in a process of its own.
import * as sides from "./sides.mjs";

const [which] = process.argv.slice(2);
let side = null;
async function start(models) {
  if (which === "mujoco") {
    const { default: load } = await import("@mujoco/mujoco");
    return sides.mujoco(load, models);
  }
  const { load } = await import("../dist/index.js");
  return sides.marathon(load, { lanes: which });
}
process.on("message", async ([name, argument, models]) => {
  side ??= await start(models);
  process.send(side[name](argument) ?? null);
});
process.send(which);

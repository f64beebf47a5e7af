// Processor time per physics step of Marathon's modules and of @mujoco/mujoco, in turns, in Chromium or in Node.
//
//   npm install --no-save @mujoco/mujoco playwright-core
//   node bench/run.mjs [--engine chromium|node] [--rounds 7] [--agents 64]
//   node bench/run.mjs --learn 4e6 [--engine chromium|node]    decisions per processor second of a hopper that learns
//
// Times are those of the thread that computes, from /proc, so this runs on Linux only.
import { fork } from "node:child_process";
import { readFileSync, readdirSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { parseArgs } from "node:util";
import { AGENTS } from "./sides.mjs";

const { values } = parseArgs({
  options: {
    engine: { type: "string", default: "chromium" },
    rounds: { type: "string", default: "7" },
    agents: { type: "string", default: "64" },
    learn: { type: "string" },
  },
});
const [rounds, many] = [Number(values.rounds), Number(values.agents)];
const root = new URL("..", import.meta.url);
const assets = new URL("../../../assets/agents/", root);
const models = Object.fromEntries(
  Object.entries(AGENTS).map(([task, name]) => [task, readFileSync(new URL(`${name}.xml`, assets), "utf8")]),
);
/** Processor time of a thread, ns. */
const cpu = (path) => Number(readFileSync(path, "utf8").split(" ")[0]);
const median = (numbers) => [...numbers].sort((a, b) => a - b)[numbers.length >> 1];

/** A process of Node with one side. */
async function inNode(side) {
  const relaxed = Number(process.versions.node.split(".")[0]) < 21 ? ["--experimental-wasm-relaxed-simd"] : [];
  const child = fork(new URL("child.mjs", import.meta.url), [side], { execArgv: relaxed });
  const answer = () => new Promise((resolve) => child.once("message", resolve));
  const call = (name, argument) => {
    const next = answer();
    child.send([name, argument, models]);
    return next;
  };
  const info = await answer();
  return {
    info: `Node ${process.versions.node}, ${info}`,
    call,
    cpu: () => cpu(`/proc/${child.pid}/task/${child.pid}/schedstat`),
    close: () => child.disconnect(),
  };
}

/** A server of the package's files. */
async function serve() {
  const types = { js: "text/javascript", mjs: "text/javascript", wasm: "application/wasm", html: "text/html" };
  const server = createServer(async (request, response) => {
    const path = new URL(request.url, "http://localhost").pathname;
    const body = path === "/" ? "<!doctype html>" : await readFile(new URL(`.${path}`, root)).catch(() => null);
    const type = types[path.split(".").pop()] ?? "text/html";
    response.writeHead(body === null ? 404 : 200, { "content-type": type }).end(body ?? "");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return server;
}

/** A page of Chromium with one side. */
async function inChromium(side, port) {
  const { chromium } = await import("playwright-core");
  const host = await chromium.launchServer({ executablePath: "/usr/bin/chromium", args: ["--no-sandbox"] });
  const browser = await chromium.connect(host.wsEndpoint());
  const page = await browser.newPage();
  await page.goto(`http://127.0.0.1:${port}/`);
  const info = await page.evaluate(
    async ([side, models]) => {
      const sides = await import("/bench/sides.mjs");
      if (side === "mujoco") {
        const { default: load } = await import("/node_modules/@mujoco/mujoco/mujoco.js");
        globalThis.side = await sides.mujoco(load, models);
      } else {
        const { load } = await import("/dist/index.js");
        globalThis.side = await sides.marathon(load, { lanes: side });
      }
      return globalThis.side.info;
    },
    [side, models],
  );
  const parent = (pid) => Number(readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ")[1]);
  const isBelow = (pid) => {
    for (; pid > 1; pid = parent(pid)) if (pid === host.process().pid) return true;
    return false;
  };
  const renderers = readdirSync("/proc").filter((pid) => {
    try {
      const isRenderer = /^\d+$/.test(pid) && readFileSync(`/proc/${pid}/cmdline`, "utf8").includes("--type=renderer");
      return isRenderer && isBelow(Number(pid));
    } catch {
      return false; // it has ended
    }
  });
  return {
    info: `Chromium ${browser.version()}, ${info}`,
    call: (name, argument) => page.evaluate(([name, argument]) => globalThis.side[name](argument), [name, argument]),
    cpu: () => renderers.reduce((sum, pid) => sum + cpu(`/proc/${pid}/task/${pid}/schedstat`), 0),
    close: async () => {
      await browser.close();
      await host.close();
    },
  };
}

const server = await serve();
const { port } = server.address();
if (values.learn) {
  for (const lanes of ["relaxed", "exact"]) {
    const side = values.engine === "node" ? await inNode(lanes) : await inChromium(lanes, port);
    const from = side.cpu();
    const { steps, return_mean } = await side.call("learn", { task: "Hopper-v0", steps: Number(values.learn) });
    const seconds = (side.cpu() - from) / 1e9;
    const rate = Math.round(steps / seconds);
    console.log(`${side.info}: ${steps} decisions in ${seconds.toFixed(1)} s, ${rate}/s, return ${return_mean.toFixed(1)}`);
    await side.close();
  }
  server.close();
  process.exit(0);
}
const sides = [];
for (const name of ["mujoco", "exact", "relaxed"]) {
  const side = values.engine === "node" ? await inNode(name) : await inChromium(name, port);
  console.log(`${name}: ${side.info}`);
  sides.push({ name, ...side, times: [] });
}
sides.push(sides.shift());
for (const task of Object.keys(AGENTS)) {
  let frame_skip = 1;
  for (const side of sides) {
    frame_skip = await side.call("begin", { task, many, seed: 1, frame_skip });
    // until the engine's optimizing compiler is done
    let from = side.cpu();
    do await side.call("advance", 50);
    while (side.cpu() - from < 6e8);
    from = side.cpu();
    await side.call("advance", 100);
    side.decisions = Math.max(1, Math.round((100 * 2.5e8) / (side.cpu() - from)));
    side.times = [];
  }
  for (let round = 0; round < rounds; round++) {
    for (const side of sides) {
      await side.call("begin", { task, many, seed: 2 + round, frame_skip });
      await side.call("advance", 50);
      const from = side.cpu();
      await side.call("advance", side.decisions);
      side.times.push((side.cpu() - from) / (many * frame_skip * side.decisions));
    }
  }
  const base = sides.find((side) => side.name === "mujoco").times;
  for (const { name, times } of sides) {
    const ratios = times.map((time, i) => base[i] / time);
    const range = `${Math.min(...ratios).toFixed(1)} to ${Math.max(...ratios).toFixed(1)}`;
    console.log(`${task.padEnd(12)} ${name.padEnd(8)} ${median(times).toFixed(0).padStart(6)} ns ${median(ratios).toFixed(2)} (${range})`);
  }
}
for (const side of sides) await side.close();
server.close();

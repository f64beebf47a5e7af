import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { test } from "node:test";
import { MarathonError, load } from "../dist/index.js";

const root = new URL("../../../../", import.meta.url);
const bits = JSON.parse(await readFile(new URL("../../tests/bits.json", import.meta.url), "utf8"));
const policy = async (name) => new Uint8Array(await readFile(new URL(`assets/policies/${name}.safetensors`, root)));
// the tests run once per module
const marathon = await load({ lanes: process.env.MARATHON_LANES ?? "exact" });

/** FNV-1a, as in tests/bits.rs. */
function fnv(bytes) {
  let hash = 0xcbf29ce484222325n;
  for (const byte of bytes) hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
  return hash.toString(16).padStart(16, "0");
}

for (const [task, expected] of Object.entries(bits.states)) {
  test(`the states of ${task} have the bits of the native program`, () => {
    const env = marathon.env(task, { agents: 16, seed: 1 });
    const actions = new Float32Array(16 * env.spec.act);
    for (let step = 0; step < 1000; step++) {
      for (let i = 0; i < actions.length; i++) actions[i] = ((step * 7 + i * 13) % 17) / 8 - 1;
      env.step(actions);
    }
    assert.equal(env.hash(), expected);
    env.free();
  });
}

for (const [file, expected] of Object.entries(bits.models)) {
  test(`the states of ${file} have the bits of the native program`, async () => {
    const simulation = marathon.simulation(await readFile(new URL(`assets/${file}`, root), "utf8"));
    for (let step = 0; step < 1000; step++) {
      const { ctrl } = simulation;
      for (let i = 0; i < ctrl.length; i++) ctrl[i] = ((step * 7 + i * 13) % 17) / 8 - 1;
      simulation.step();
    }
    assert.equal(simulation.hash(), expected);
    simulation.free();
  });
}

test("a short training has the weights of the native program", () => {
  const { task, config, policy: expected } = bits.training;
  const trainer = marathon.trainer(task, config);
  let steps = 0;
  while (!trainer.done) steps = trainer.iterate().steps;
  assert.ok(steps >= config.run.total_steps);
  assert.equal(fnv(trainer.policy()), expected);
  assert.throws(() => trainer.iterate(), /has made its 200000 steps/);
  trainer.free();
});

test("a policy obeys commands", async () => {
  const env = marathon.env("MarathonManController", { policy: await policy("MarathonManController"), seed: 3 });
  const speed = env.spec.command.find((range) => range.unit === "m/s");
  const x = () => env.state(0).qpos[0];
  env.command(0, {});
  for (let i = 0; i < 60; i++) env.step();
  assert.ok(Math.abs(x()) < 0.5, `it stands, at ${x()}`);
  env.command(0, { [speed.name]: 2 });
  for (let i = 0; i < 120; i++) env.step();
  assert.ok(x() > 2, `it walks, to ${x()}`);
  assert.throws(() => env.command(0, { sped: 1 }), /no command 'sped', expected one of/);
});

test("a snapshot restores the future", async () => {
  const env = marathon.env("Hopper-v0", { policy: await policy("hopper"), agents: 3, seed: 5 });
  for (let i = 0; i < 30; i++) env.step();
  const snapshot = env.snapshot();
  for (let i = 0; i < 50; i++) env.step();
  const hash = env.hash();
  env.restore(snapshot);
  for (let i = 0; i < 50; i++) env.step();
  assert.equal(env.hash(), hash);
  env.push(1, 1, [200, 0, 0]);
  for (let i = 0; i < 5; i++) env.step();
  assert.notEqual(env.hash(), hash);
});

test("a model is simulated, and its poses follow", () => {
  const xml = `<mujoco><worldbody><geom type="plane" size="5 5 1"/><body name="ball" pos="0 0 2"><freejoint/>
    <geom type="sphere" size="0.1" rgba="1 0 0 1"/></body></worldbody></mujoco>`;
  const simulation = marathon.simulation(xml);
  assert.deepEqual(simulation.model.geoms.map((geom) => geom.kind), ["plane", "sphere"]);
  const start = simulation.poses()[16 + 14];
  assert.equal(start, 2);
  assert.ok(simulation.step(100));
  assert.ok(simulation.poses()[16 + 14] < 1.9);
  simulation.reset();
  simulation.push(1, [0, 0, 1000]);
  simulation.step(10);
  assert.ok(simulation.state().qpos[2] > 2);
});

test("height fields have heights in meters", () => {
  const xml = `<mujoco><asset><hfield name="hill" nrow="2" ncol="3" size="3 2 0.5 0.1" elevation="0 1 2 0 1 4"/></asset>
    <worldbody><geom type="hfield" hfield="hill"/></worldbody></mujoco>`;
  const simulation = marathon.simulation(xml);
  // MJCF lists the rows from the largest y on
  assert.deepEqual([...simulation.ground(0)], [0, 0.125, 0.5, 0, 0.125, 0.25]);
  assert.throws(() => simulation.ground(1), /field is 1, expected a whole number from 0 to 0/);
});

test("meshes have their triangles", () => {
  const xml = `<mujoco><asset><mesh name="tip" file="tip.obj"/></asset>
    <worldbody><body><freejoint/><geom type="mesh" mesh="tip"/></body></worldbody></mujoco>`;
  const obj = "v 0 0 0\nv 3 0 0\nv 0 2 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const simulation = marathon.simulation(xml, { "tip.obj": new TextEncoder().encode(obj) });
  const { geoms, meshes } = simulation.model;
  assert.deepEqual([geoms[0].mesh, meshes[0]], [0, { vertices: 4, faces: 4 }]);
  const { vertices, faces } = simulation.mesh(0);
  assert.deepEqual([vertices.length, faces.length, Math.max(...faces)], [12, 12, 3]);
  const volume = [0, 1, 2, 3].reduce((sum, face) => {
    const [a, b, c] = [0, 1, 2].map((i) => vertices.subarray(3 * faces[3 * face + i], 3 * faces[3 * face + i] + 3));
    const cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
    return sum + (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6;
  }, 0);
  assert.ok(Math.abs(volume - 1) < 1e-5, `${volume}`);
  assert.deepEqual(marathon.simulation(xml.replace("<geom", '<geom contype="0" conaffinity="0" mass="0"').replace("<freejoint/>", "<freejoint/><geom size=\"1\"/>")).model.meshes, []);
});

test("a module for play has the same bits, but no training", async () => {
  const play = await load({ lanes: process.env.MARATHON_LANES ?? "exact", parts: "play" });
  const hashes = [marathon, play].map((module) => {
    const env = module.env("Walker2d-v0", { agents: 3, seed: 5 });
    for (let i = 0; i < 200; i++) env.step(new Float32Array(3 * env.spec.act).fill(0.2));
    return env.hash();
  });
  assert.equal(hashes[0], hashes[1]);
  assert.throws(() => play.trainer("Hopper-v0"), /for play and has no training/);
  assert.throws(() => play.importMotion("MarathonMan", "walk.bvh", new Uint8Array(9)), /only \.motion files/);
});

test("errors name the place, and missing files", () => {
  const refused = (xml) => {
    try {
      marathon.simulation(xml, {}, "robot.xml");
    } catch (error) {
      assert.ok(error instanceof MarathonError);
      return error;
    }
    return assert.fail("accepted");
  };
  assert.match(refused("<mujoco").message, /robot\.xml/);
  assert.match(refused(`<mujoco><worldbody><body pos="0 NaN 0"/></worldbody></mujoco>`).message, /NaN/);
  assert.deepEqual(refused(`<mujoco><include file="arm.xml"/></mujoco>`).missing, ["arm.xml"]);
  assert.throws(() => marathon.env("Hoper-v0"), /Hopper-v0/);
  assert.throws(() => marathon.env("Hopper-v0", { agents: 0 }), /agents/);
  assert.throws(() => marathon.trainer("Hopper-v0", { ppo: { lrr: 1 } }), /lr/);
  const noise = Uint8Array.from({ length: 100_000 }, (_, i) => (i * 7919) % 251);
  assert.throws(() => marathon.policyInfo(noise), MarathonError);
  assert.throws(() => marathon.importMotion("MarathonMan", "walk.bvh", noise), MarathonError);
  assert.equal(marathon.env("Hopper-v0").spec.id, "Hopper-v0", "the module still works");
});

test("numbers and bytes are checked before the module sees them", async () => {
  const env = marathon.env("Hopper-v0", { agents: 2 });
  const simulation = marathon.simulation(`<mujoco><worldbody><body><freejoint/><geom size="1"/></body></worldbody></mujoco>`);
  const walker = await policy("WalkerController");
  const snapshot = env.snapshot();
  for (const [wrong, message] of [
    [() => simulation.step(-1), /steps is -1, expected a whole number from 0/],
    [() => simulation.step(1.5), /steps is 1.5/],
    [() => simulation.push(2, [0, 0, 1]), /body is 2, expected a whole number from 0 to 1/],
    [() => simulation.setState([0, 0, NaN, 1, 0, 0, 0], [0, 0, 0, 0, 0, 0]), /qpos\[2\] is NaN/],
    [() => env.state(-1), /agent is -1, expected a whole number from 0 to 1/],
    [() => env.step([1, 2, 3]), /actions has 3 numbers, expected 8/],
    [() => env.step([0, 0, 0, 0, NaN, 0, 0, 0]), /actions\[4\] is NaN, expected a finite number/],
    [() => env.command(0, { speed: 1 }), /expected none: the task takes no commands/],
    [() => env.reset(-1), /seed is -1/],
    [() => marathon.env("Hopper-v0", { agnets: 2 }), /'agnets', expected some of agents, seed,/],
    [() => marathon.env("Hopper-v0", { agents: 1e9 }), /agents is 1000000000, expected a whole number from 1 to 100000/],
    [() => marathon.trainer("Hopper-v0", { network: { hidden: [65536, 65536] } }), /network\.hidden is \[65536, 65536\]/],
    [() => env.restore(snapshot.map((x, i) => (i === 20 ? x ^ 64 : x))), /the snapshot is damaged/],
    [() => marathon.env("Nothing-v0"), /`agents\(\)`/],
    [() => marathon.env("Hopper-v0", { policy: "hopper" }), /policy is hopper, expected the bytes of a file/],
    [() => marathon.policyInfo(walker.slice(9)), /neither those of a \.safetensors file nor/],
    [() => marathon.env("Hopper-v0", { agents: 3 }).restore(snapshot), /the snapshot has 2 agents of \d+ observations, expected 3/],
  ]) {
    assert.throws(wrong, (error) => {
      assert.ok(error instanceof MarathonError, `${error}`);
      assert.match(error.message, message);
      assert.doesNotMatch(error.message, /MARATHON_LIMITS/);
      return true;
    });
  }
  assert.equal(marathon.policyInfo(walker.buffer).agent, "WalkerController-v0", "an ArrayBuffer will do");
});

test("a page that has no module says so", async (t) => {
  const server = createServer((_, response) => response.setHeader("content-type", "text/html").end("<!doctype html>"));
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  t.after(() => server.close());
  await assert.rejects(load({ base: `http://127.0.0.1:${server.address().port}/wasm` }), /wasm\/\w+\.wasm is not a WebAssembly module; copy the \.wasm files/);
  await assert.rejects(load({ base: "http://[" }), /base is 'http:\/\/\['/);
});

test("freed objects are refused, and memory does not grow", () => {
  const env = marathon.env("Hopper-v0");
  env.free();
  // the module gives the number of a freed object to the next one
  const other = marathon.env("Hopper-v0");
  const hash = other.hash();
  assert.throws(() => env.step(), /has been freed/);
  assert.throws(() => env.step([1, 1, 1, 1]), /has been freed/);
  assert.equal(other.hash(), hash);
  const before = marathon.memoryBytes;
  for (let i = 0; i < 200; i++) marathon.env("Hopper-v0", { agents: 16 }).free();
  assert.ok(marathon.memoryBytes - before < 2e6, `${marathon.memoryBytes - before} bytes`);
});

// Parts of the page that need no browser. The numbers of steering are those of the Bevy plugin's tests.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { createServer } from "vite";

let vite;
before(async () => {
  vite = await createServer({
    configFile: false,
    root: fileURLToPath(new URL("..", import.meta.url)),
    server: { middlewareMode: true, hmr: false, ws: false, watch: null },
    optimizeDeps: { noDiscovery: true },
    logLevel: "error",
    appType: "custom",
  });
});
after(() => vite.close());
const source = (path) => vite.ssrLoadModule(`/src/${path}`);

const range = (name, low, high, unit) => ({ name, low, high, unit });
const WALKER = [range("speed", 0, 3, "m/s"), range("left", -0.8, 0.8, "m/s"), range("turn", -1.5, 1.5, "rad/s")];
const STILL = { heading: 0, turn: 0, velocity: [0, 0] };

test("a walker turns first and walks then", async () => {
  const { Aim, Steered } = await source("play/direction.ts");
  const course = (angle, pace) => new Aim(Steered.of(WALKER)).course(angle, pace, STILL, 0.025);
  assert.deepEqual(course(0, 1), { ahead: 3, left: 0, turn: 0 });
  assert.equal(course(0, 0.5).ahead, 1.5);
  // behind it: no step, and the short way around
  assert.deepEqual(course(3, 1), { ahead: 0, left: 0, turn: 1.5 });
  assert.equal(course(-3, 1).turn, -1.5);
  const aside = course(0.3, 1);
  assert.ok(aside.ahead > 2.8 && Math.abs(aside.turn - 0.9) < 1e-12);
  assert.equal(Steered.of(WALKER.slice(0, 2)), null);
});

test("the aim moves against drift", async () => {
  const { Aim, Steered } = await source("play/direction.ts");
  const aim = new Aim(Steered.of(WALKER));
  const drifting = { ...STILL, velocity: [1, 0.2] };
  for (let i = 0; i < 200; i++) aim.course(0, 1, drifting, 0.025);
  // the largest shift, to the right: a turn by 0.5 rad
  assert.ok(Math.abs(aim.course(0, 1, STILL, 0.025).turn + 1.5) < 1e-12);
});

test("a character that can go sideways does not turn", async () => {
  const { Aim, Steered } = await source("play/direction.ts");
  const steered = Steered.of([range("speed", -3, 3, "m/s"), range("left", -2, 2, "m/s"), range("turn", -1.5, 1.5, "rad/s")]);
  const { ahead, left, turn } = new Aim(steered).course(Math.PI / 2, 1, STILL, 0.01);
  assert.ok(Math.abs(ahead) < 1e-9 && Math.abs(left - 2) < 1e-9 && turn === 0);
  assert.ok(Math.abs(new Aim(steered).course(Math.PI, 0.5, STILL, 0.01).ahead + 1.5) < 1e-9);
});

test("links name views and models", async () => {
  const { linkOf, optionsOf, parseRoute, tidy } = await source("app/route.ts");
  const { addressOf, normalize } = await source("models/paths.ts");
  const at = (path) => new URL(path, "https://host/folder/");
  assert.equal(parseRoute(at("")).view, "play");
  assert.equal(parseRoute(at("?model=a.xml")).view, "models");
  assert.equal(parseRoute(at("?agent=Hopper-v0&policy=p.onnx")).view, "policies");
  assert.equal(linkOf(parseRoute(at("#/learn?seed=3"))), "#/learn?seed=3");
  assert.equal(tidy(at("?embed=1&model=a.xml")).href, "https://host/folder/?embed=1#/models?model=a.xml");
  assert.deepEqual(optionsOf(new URLSearchParams("option=a=0.5&option=b=true&option=c=x")), { a: 0.5, b: true, c: "x" });
  assert.equal(addressOf("github:o/r/a/b.xml", "https://host/").href, "https://raw.githubusercontent.com/o/r/HEAD/a/b.xml");
  assert.equal(addressOf("github:o/r@v2/a/../b.xml", "https://host/").href, "https://raw.githubusercontent.com/o/r/v2/b.xml");
  assert.throws(() => addressOf("github:o/b.xml", "https://host/"));
  assert.throws(() => addressOf("javascript:alert(1)", "https://host/"));
  assert.equal(normalize("./a//b/../c\\d"), "a/c/d");
});

test("time is made up for a few steps and then dropped", async () => {
  const { Clock } = await source("physics/clock.ts");
  const clock = new Clock(0.02);
  assert.equal(clock.steps(0.05), 2);
  assert.ok(Math.abs(clock.share - 0.5) < 1e-9);
  assert.equal(clock.steps(1), 4);
  assert.equal(clock.steps(0.019), 0);
  clock.paused = true;
  assert.equal(clock.steps(1), 0);
  clock.step();
  assert.equal(clock.steps(0), 1);
});

test("units: messages of a program come whole, however their bytes are cut", async () => {
  const { Parser } = await source("live/messages.ts");
  const message = (kind, content) => {
    const head = Buffer.alloc(5);
    head.writeUInt32LE(content.length);
    head[4] = kind;
    return Buffer.concat([head, content]);
  };
  const model = { geoms: [{}], bodies: [{}, {}] };
  const scene = Buffer.from(JSON.stringify({ title: "Hopper", model, agents: 2, dt: 0.02 }));
  const numbers = Float32Array.from({ length: 96 }, (_, i) => i);
  const frame = Buffer.concat([Buffer.from(new Float64Array([1.5]).buffer), Buffer.from(new Uint32Array([3, 4]).buffer), Buffer.from(numbers.buffer)]);
  const ground = Buffer.concat([Buffer.from(new Uint32Array([1, 0]).buffer), Buffer.from(new Float32Array([0.25, 0.5]).buffer)]);
  const all = Buffer.concat([message(1, scene), message(4, ground), message(5, Buffer.alloc(0)), message(2, frame)]);
  for (const size of [1, 7, 64, all.length]) {
    const parser = new Parser();
    const found = [];
    for (let at = 0; at < all.length; at += size) found.push(...parser.push(new Uint8Array(all.subarray(at, at + size))));
    assert.deepEqual(found.map(({ type }) => type), ["scene", "ground", "frame"], `${size} bytes`);
    const [{ agents }, { agent, heights }, { time, episodes, geoms, bodies }] = found;
    assert.deepEqual([agents, agent, [...heights], time, [...episodes]], [2, 1, [0.25, 0.5], 1.5, [3, 4]]);
    assert.deepEqual([...geoms, ...bodies], [...numbers]);
  }
  const broken = new Parser();
  broken.push(new Uint8Array(message(1, scene)));
  assert.throws(() => broken.push(new Uint8Array(message(2, frame.subarray(8)))), /a frame has 392 bytes, expected 400/);
  assert.throws(() => new Parser().push(new Uint8Array([255, 255, 255, 255, 2])), /at most/);
});

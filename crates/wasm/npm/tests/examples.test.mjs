import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { test } from "node:test";
import { fileURLToPath } from "node:url";

const read = (path) => readFileSync(new URL(path, import.meta.url), "utf8");
const [example] = [...read("../README.md").matchAll(/^```js\n([\s\S]*?)^```/gm)].map((match) => match[1]);

test("the guide has the example of the README", () => {
  assert.ok(read("../../../../docs/how-to/browser.md").includes(example));
});

// the exact module takes ten times as long
test("the example of the README runs, pasted into a file", { skip: process.env.MARATHON_LANES !== "relaxed" }, () => {
  const folder = mkdtempSync(join(tmpdir(), "marathon-"));
  try {
    mkdirSync(join(folder, "node_modules"));
    symlinkSync(fileURLToPath(new URL("..", import.meta.url)), join(folder, "node_modules", "marathon-rl"), "dir");
    writeFileSync(join(folder, "example.mjs"), example);
    const args = process.execArgv.filter((arg) => arg.startsWith("--experimental-wasm"));
    const output = execFileSync(process.execPath, [...args, "example.mjs"], { cwd: folder, encoding: "utf8" });
    const lines = output.trim().split("\n");
    const [steps, last] = lines.at(-2).split(" ").map(Number);
    assert.ok(steps >= 500_000 && last > 50, `after ${steps} steps it returns ${last}`);
    assert.ok(Number(lines.at(-1)) > 0.2, `it moves to ${lines.at(-1)}`);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

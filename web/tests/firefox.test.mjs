// The page in Firefox, over WebDriver BiDi: loading, bits, keyboard.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { existsSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { after, before, test } from "node:test";
import { load } from "marathon-rl";
import puppeteer from "puppeteer-core";
import { LANES } from "./browser.mjs";
import { serve } from "./server.mjs";

const FIREFOX = process.env.FIREFOX ?? ["/usr/bin/firefox-esr", "/usr/bin/firefox"].find((path) => existsSync(path));
const skip = FIREFOX ? false : "Firefox is not installed";

const XVFB = "/usr/bin/Xvfb";

let server;
let browser;
let screen;

/** Firefox has no software WebGL without a screen: starts a virtual one, and returns the name of its display. */
function virtualScreen() {
  screen = spawn(XVFB, ["-displayfd", "1", "-screen", "0", "1280x800x24"], { stdio: ["ignore", "pipe", "ignore"] });
  return new Promise((resolve, reject) => {
    screen.on("error", reject);
    screen.stdout.once("data", (number) => resolve(`:${String(number).trim()}`));
  });
}

before(async () => {
  server = await serve();
  if (skip) return;
  const display = process.env.DISPLAY ?? (existsSync(XVFB) ? await virtualScreen() : undefined);
  browser = await puppeteer.launch({
    browser: "firefox",
    executablePath: FIREFOX,
    headless: display === undefined,
    env: { ...process.env, ...(display === undefined ? {} : { DISPLAY: display }) },
    extraPrefsFirefox: { "webgl.force-enabled": true, "webgl.disabled": false },
  });
});
after(async () => {
  await browser?.close();
  screen?.kill();
  await server.close();
});

test("Firefox loads the page, has the same bits, and steers", { skip }, async (t) => {
  const page = await browser.newPage();
  const errors = [];
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  page.on("pageerror", (error) => errors.push(String(error)));
  await page.goto(`${server.url}#/play?agent=Hopper`);
  await page.waitForFunction(() => document.documentElement.dataset.ready === "play", { timeout: 60_000 });
  const bytes = new Uint8Array(await readFile(new URL("../../assets/policies/HopperController.safetensors", import.meta.url)));
  const marathon = await load({ lanes: LANES });
  const env = marathon.env("HopperController-v0", { policy: bytes, seed: 7 });
  for (let i = 0; i < 1000; i++) env.step();
  const [hash, lanes] = await page.evaluate(async () => {
    const marathon = await window.marathonPage.engine();
    const policy = new Uint8Array(await (await fetch("policies/HopperController.safetensors")).arrayBuffer());
    const env = marathon.env("HopperController-v0", { policy, seed: 7 });
    for (let i = 0; i < 1000; i++) env.step();
    return [env.hash(), marathon.lanes];
  });
  t.diagnostic(`lanes: ${lanes}`);
  assert.equal(hash, env.hash());
  const x = () => page.evaluate(() => window.marathonPage.view.player.arena.puppet.center.x);
  await page.keyboard.down("d");
  await new Promise((resolve) => setTimeout(resolve, 300));
  const start = await x();
  await page.waitForFunction((from) => window.marathonPage.view.player.arena.puppet.center.x > from + 1, { timeout: 30_000 }, start);
  await page.keyboard.up("d");
  assert.deepEqual(errors, []);
});

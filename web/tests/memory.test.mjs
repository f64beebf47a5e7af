// Memory stays flat in play: 45 s, or 5 minutes with --long (or MARATHON_LONG=1).
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { DESKTOP, hasChromium, launch, open } from "./browser.mjs";
import { serve } from "./server.mjs";

const skip = hasChromium ? false : "Chromium is not installed";
const SECONDS = process.argv.includes("--long") || process.env.MARATHON_LONG ? 300 : 45;
const WARM_UP = 12;

let server;
let browser;

before(async () => {
  server = await serve();
  if (!skip) browser = await launch();
});
after(async () => {
  await browser?.close();
  await server.close();
});

test(`memory is flat for ${SECONDS} s`, { skip }, async (t) => {
  const context = await browser.newContext(DESKTOP);
  const { page, errors } = await open(context, `${server.url}#/play?agent=MarathonMan`, "play");
  const session = await context.newCDPSession(page);
  const measure = async () => {
    await session.send("HeapProfiler.collectGarbage");
    const { usedSize } = await session.send("Runtime.getHeapUsage");
    const module = await page.evaluate(async () => (await window.marathonPage.engine()).memoryBytes);
    return { heap: usedSize, module };
  };
  await page.keyboard.down("KeyW");
  const play = async (seconds) => {
    for (let i = 0; i < seconds; i += 3) {
      await page.keyboard.press("KeyB");
      if (i % 15 === 0) await page.keyboard.press("KeyX");
      await page.waitForTimeout(3000);
    }
  };
  await play(WARM_UP);
  const start = await measure();
  await play(SECONDS - WARM_UP);
  const end = await measure();
  const decisions = await page.evaluate(() => window.marathonPage.view.player.arena.steps);
  t.diagnostic(`heap ${start.heap} to ${end.heap}, module ${start.module} to ${end.module} bytes, ${decisions} decisions`);
  assert.equal(end.module, start.module);
  assert.ok(end.module <= 64 * 2 ** 20);
  assert.ok(end.heap - start.heap < 2e6, `the heap grew by ${end.heap - start.heap} bytes`);
  assert.ok(decisions > 5 * SECONDS, `${decisions} decisions in ${SECONDS} s`);
  assert.deepEqual(errors, []);
  await context.close();
});

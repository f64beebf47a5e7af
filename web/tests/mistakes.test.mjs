// Mistakes of a user, a link or a host leave the page as it was, with a message, and nothing is lost by going elsewhere.
import assert from "node:assert/strict";
import { after, before, test } from "node:test";
import { DESKTOP, PHONE, hasChromium, launch, ready, visitWith } from "./browser.mjs";
import { drop } from "./drop.mjs";
import { serve } from "./server.mjs";

const skip = hasChromium ? false : "Chromium is not installed";
let server;
let browser;

before(async () => {
  server = await serve({});
  if (!skip) browser = await launch();
});
after(async () => {
  await browser?.close();
  await server.close();
});

const visit = (path, view, options, prepare) => visitWith(browser, server.url + path, view, options, prepare);

const message = (page) => page.locator(".message[data-kind=error]");
const ball = (size) => `<mujoco><worldbody><body pos="0 0 1"><freejoint/><geom size="${size}"/></body></worldbody></mujoco>`;

test("a drop that fails keeps what was there, and one that works ends the message", { skip }, async () => {
  const { page, errors, close } = await visit("#/models", "models");
  await drop(page, [["good.xml", ball("0.1")]]);
  await page.waitForFunction(() => document.querySelector(".panel h3")?.textContent === "good.xml");
  await drop(page, [["bad.xml", ball("-1")]]);
  await message(page).waitFor();
  assert.match(await message(page).textContent(), /bad\.xml/);
  await ready(page, "models");
  assert.equal(await page.locator(".panel h3").first().textContent(), "good.xml");
  await drop(page, [["noise.bvh", "HIERARCHY"]]);
  await page.waitForFunction(() => document.querySelector(".message span")?.textContent.includes("noise.bvh"));
  await page.waitForFunction(() => document.querySelector(".panel h3")?.textContent === "good.xml");
  await drop(page, [["better.xml", ball("0.2")]]);
  await page.waitForFunction(() => document.querySelector(".panel h3")?.textContent === "better.xml");
  assert.equal(await message(page).isVisible(), false);
  assert.deepEqual(errors, []);
  await close();
});

for (const [link, view, text] of [
  ["#/play?agent=Foo", "play", /agent is 'Foo', expected MarathonMan, Walker/],
  ["#/play?agent=Hopper&seed=-5", "play", /seed is '-5', expected a whole number/],
  ["#/play?agent=Course&option=difficulty=99", "play", /difficulty/],
  ["#/learn?agent=foo", "learn", /agent is 'foo', expected hopper/],
  ["#/learn?agent=hopper&steps=-1", "learn", /steps is '-1'/],
  ["#/policies?policy=nothing.safetensors", "policies", /nothing\.safetensors/],
]) {
  test(`the link ${link} gets a message and a view`, { skip }, async () => {
    const { page, close } = await visit(link, view);
    await message(page).waitFor();
    assert.match(await message(page).textContent(), text);
    assert.ok((await page.locator(".panel button").count()) > 0, "the panel is there");
    assert.equal(new URL(page.url()).hash, `#/${view}`);
    await close();
  });
}

test("a training waits while another view is open", { skip }, async () => {
  const { page, errors, close } = await visit("#/learn?agent=hopper&seed=3&start=1", "learn");
  await page.waitForFunction(() => window.marathonPage.view.progress.last !== null, undefined, { timeout: 60_000 });
  const first = await page.evaluate(() => window.marathonPage.view.progress.first);
  await page.getByRole("link", { name: "Models" }).click();
  await ready(page, "models");
  await page.getByRole("link", { name: "Learn" }).click();
  await ready(page, "learn");
  const back = await page.evaluate(() => window.marathonPage.view.progress);
  assert.equal(back.phase, "paused");
  assert.equal(back.first, first);
  assert.equal(await page.getByRole("spinbutton", { name: "Seed" }).inputValue(), "3");
  await page.getByRole("button", { name: "Continue" }).click();
  await page.waitForFunction((text) => window.marathonPage.view.progress.text !== text, back.text, { timeout: 60_000 });
  assert.deepEqual(errors, []);
  await close();
});

test("Play works where gamepads are forbidden, and on a phone that is turned", { skip }, async () => {
  const { page, errors, close } = await visit("#/play?agent=Hopper", "play", PHONE, (context) =>
    context.addInitScript(() => {
      navigator.getGamepads = () => {
        throw new DOMException("forbidden", "SecurityError");
      };
    }),
  );
  const frames = await page.evaluate(() => window.marathonPage.stage.frames);
  await page.waitForFunction((before) => window.marathonPage.stage.frames > before + 5, frames, { timeout: 30_000 });
  await page.setViewportSize({ width: 844, height: 390 });
  await page.getByRole("button", { name: "Controls" }).click();
  await page.getByRole("combobox", { name: "Character" }).waitFor();
  assert.deepEqual(errors, []);
  await close();
});

test("one entry of the storage that cannot be read hides no other, and the list survives", { skip }, async () => {
  const { page, errors, close } = await visit("#/policies", "policies", DESKTOP, (context) =>
    context.addInitScript(() => {
      localStorage.setItem("marathon.policy.bad", "%%%");
      localStorage.setItem("marathon.policy.good", btoa("good"));
    }),
  );
  assert.ok(await page.getByRole("button", { name: "good", exact: true }).isVisible());
  assert.equal(await page.getByRole("button", { name: "bad", exact: true }).count(), 0);
  assert.deepEqual(errors, []);
  await close();
});

test("a module that has stopped is replaced", { skip }, async () => {
  const { page, close } = await visit("#/models", "models");
  // more bodies at one place than the memory of a module can solve
  const crowd = `<mujoco><worldbody>${"<body pos='0 0 .01'><freejoint/><geom size='.1'/></body>".repeat(600)}</worldbody></mujoco>`;
  await drop(page, [["crowd.xml", crowd]]);
  await page.waitForFunction(() => document.querySelector(".message span")?.textContent.includes("stopped"), undefined, { timeout: 60_000 });
  await ready(page, "models");
  assert.ok((await page.locator(".panel button").count()) > 0);
  await close();
});

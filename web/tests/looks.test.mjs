// Every view in both themes and on both screens: accessibility, and pictures for people to look at (in test-pictures/).
import assert from "node:assert/strict";
import { mkdir, readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { DESKTOP, PHONE, hasChromium, launch, open, ready } from "./browser.mjs";
import { serve } from "./server.mjs";

const skip = hasChromium ? false : "Chromium is not installed";
const AXE = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");
const PICTURES = fileURLToPath(new URL("../test-pictures/", import.meta.url));
const VIEWS = {
  play: "#/play?agent=MarathonMan",
  learn: "#/learn?agent=hopper",
  models: "#/models?model=arm",
  motion: "#/motion?motion=dance",
  policies: "#/policies?policy=walker2d",
};

let server;
let browser;

before(async () => {
  await mkdir(PICTURES, { recursive: true });
  server = await serve();
  if (!skip) browser = await launch();
});
after(async () => {
  await browser?.close();
  await server.close();
});

async function violations(page) {
  const { violations: found } = await page.evaluate(() => window.axe.run({ resultTypes: ["violations"] }));
  return found.map(({ id, nodes }) => `${id}: ${nodes.map(({ html, failureSummary }) => `${html} ${failureSummary}`).join("; ")}`);
}

for (const [name, screen] of Object.entries({ "1280x720": DESKTOP, "390x844": PHONE })) {
  test(`views at ${name} are accessible and fit`, { skip }, async () => {
    const context = await browser.newContext({ ...screen, colorScheme: "light" });
    const { page, errors } = await open(context, `${server.url}?quality=1${VIEWS.play}`, "play");
    await page.evaluate(AXE);
    for (const [view, link] of Object.entries(VIEWS)) {
      await page.evaluate((hash) => (location.hash = hash), link);
      await ready(page, view);
      if (view === "learn") await page.evaluate(() => document.querySelector(".primary").click());
      await page.waitForTimeout(view === "learn" ? 4000 : 1200);
      await page.screenshot({ path: `${PICTURES}${view}-${name}.png` });
      const folded = page.locator(".panel.folded .fold");
      if (await folded.count()) {
        await folded.click();
        await page.screenshot({ path: `${PICTURES}${view}-${name}-controls.png` });
      }
      for (const colorScheme of screen === DESKTOP ? ["light", "dark"] : ["light"]) {
        await page.emulateMedia({ colorScheme });
        assert.deepEqual(await violations(page), [], `${view}, ${colorScheme}`);
      }
      if (view === "play" && screen === DESKTOP) await page.screenshot({ path: `${PICTURES}${view}-${name}-dark.png` });
      await page.emulateMedia({ colorScheme: "light" });
      const [inside, width] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
      assert.ok(inside <= width, `${view} is ${inside} wide on ${width}`);
    }
    assert.deepEqual(errors, []);
    await context.close();
  });
}

test("every control can be reached with the keyboard, and shows it", { skip }, async () => {
  const context = await browser.newContext(DESKTOP);
  const { page } = await open(context, `${server.url}${VIEWS.play}`, "play");
  const seen = new Set();
  for (let i = 0; i < 24; i++) {
    await page.keyboard.press("Tab");
    const [label, outline] = await page.evaluate(() => {
      const { activeElement: element } = document;
      return [element.getAttribute("aria-label") ?? element.textContent ?? element.tagName, getComputedStyle(element).outlineStyle];
    });
    if (label.length < 60) assert.notEqual(outline, "none", `${label} has no visible focus`);
    seen.add(label.trim());
  }
  for (const label of ["Play", "Learn", "Save a picture", "Switch between dark and light", "Throw a ball", "Pause", "New seed"]) {
    assert.ok(seen.has(label), `${label} is not reached: ${[...seen].join(", ")}`);
  }
  await context.close();
});

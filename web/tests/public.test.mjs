// Models of other projects open in the page by their links, or it says in a sentence why not. The models are those of Python packages
// that ./test.sh installs into .venv.
import assert from "node:assert/strict";
import { existsSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath } from "node:url";
import { DESKTOP, hasChromium, launch } from "./browser.mjs";
import { serve } from "./server.mjs";

const VENV = fileURLToPath(new URL("../../.venv/", import.meta.url));
const python = existsSync(join(VENV, "lib")) && readdirSync(join(VENV, "lib")).find((name) => name.startsWith("python3"));
const FOLDERS = { "/models/": join(VENV, "foreign-models"), "/packages/": join(VENV, `lib/${python}/site-packages`) };
const missing = Object.values(FOLDERS).find((folder) => !existsSync(join(folder, ".")));
const skip = !hasChromium ? "Chromium is not installed" : missing ? `there is no ${missing}: run ./test.sh` : false;

/** Links, and words of the refusal of those that are not supported. */
const MODELS = [
  ["packages/dm_control/suite/humanoid.xml"],
  ["packages/dm_control/suite/acrobot.xml"],
  ["packages/dm_control/suite/fish.xml"],
  ["packages/gymnasium/envs/mujoco/assets/humanoid.xml"],
  ["packages/gymnasium/envs/mujoco/assets/pusher_v5.xml"],
  ["models/brax/envs/assets/ant.xml"],
  ["models/gymnasium_robotics/envs/assets/fetch/reach.xml"],
  ["models/gymnasium_robotics/envs/assets/hand/reach.xml"],
  ["models/mujoco_warp/test_data/humanoid/humanoid.xml"],
  ["models/mujoco_warp/test_data/hfield/hfield.xml"],
  ["models/mujoco_warp/test_data/aloha_pot/scene.xml"],
  ["models/mujoco_warp/test_data/flex/floppy.xml", /deformable bodies are not supported/],
];

let server;
let browser;

before(async () => {
  if (skip) return;
  server = await serve({}, FOLDERS);
  browser = await launch();
});
after(async () => {
  await browser?.close();
  await server?.close();
});

for (const [path, refusal] of MODELS) {
  test(`${path} ${refusal ? "is refused by name" : "opens"}`, { skip }, async (t) => {
    const context = await browser.newContext(DESKTOP);
    const page = await context.newPage();
    const thrown = [];
    page.on("pageerror", (error) => thrown.push(String(error)));
    await page.goto(`${server.url}?model=${encodeURIComponent(`${server.origin}/${path}`)}`);
    const title = page.locator(".panel h3").first();
    const message = page.locator(".message[data-kind=error]");
    const name = path.split("/").at(-1);
    const seen = await Promise.race([
      page.waitForFunction((name) => document.querySelector(".panel h3")?.textContent === name, name, { timeout: 60_000 }).then(() => "opens"),
      message.waitFor({ timeout: 60_000 }).then(() => "refused"),
    ]);
    const text = seen === "refused" ? (await message.textContent()).trim() : "";
    t.diagnostic(`${seen} ${text}`);
    if (refusal) {
      assert.equal(seen, "refused");
      assert.match(text, refusal);
    } else {
      assert.equal(seen, "opens", text);
      assert.equal(await title.textContent(), name);
    }
    assert.deepEqual(thrown, []);
    await context.close();
  });
}

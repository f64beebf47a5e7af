// A real run that `marathon serve` shows in Chromium. MARATHON_PROGRAM is the command.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { mkdir } from "node:fs/promises";
import { test } from "node:test";
import { fileURLToPath } from "node:url";
import { hasChromium, launch } from "./browser.mjs";

const program = process.env.MARATHON_PROGRAM;
const here = (path) => fileURLToPath(new URL(path, import.meta.url));

async function serve(source) {
  const words = ["serve", source, "--page", here("../dist"), "--agents", "4", "--json"];
  const server = spawn(program, words, { stdio: ["ignore", "pipe", "inherit"] });
  let text = "";
  for await (const part of server.stdout) {
    text += part;
    if (text.trimEnd().endsWith("}")) break;
  }
  return { server, url: JSON.parse(text).url };
}

test("a browser shows what the program serves, and survives its end", { skip: program && hasChromium ? false : "MARATHON_PROGRAM or Chromium is missing" }, async () => {
  const { server, url } = await serve(here("../../assets/policies/hopper.safetensors"));
  const browser = await launch();
  try {
    const page = await browser.newPage({ viewport: { width: 1000, height: 640 } });
    const errors = [];
    page.on("pageerror", (error) => errors.push(String(error)));
    await page.goto(url);
    await page.waitForFunction(() => (window.marathonPage?.view?.frames ?? 0) > 50, null, { timeout: 60_000 });
    assert.match(await page.locator("#panel").innerText(), /Hopper-v0 after [\d,]+ decisions\s+4 agents · \d+\.\d s/);
    await mkdir(here("../test-pictures"), { recursive: true });
    await page.screenshot({ path: here("../test-pictures/live.png") });
    // another tab without the token
    const other = await browser.newPage();
    await other.goto(url.replace(/token=.*/, "token=0"));
    await other.getByText("The token is wrong").waitFor();
    server.kill("SIGINT");
    await page.getByText(/The program (has ended|cannot be reached)/).waitFor();
    assert.deepEqual(errors, []);
  } finally {
    await browser.close();
    server.kill("SIGKILL");
  }
});

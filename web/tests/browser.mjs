// Chromium for tests, with a software renderer.
import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";
export const hasChromium = existsSync(CHROMIUM);

/** The module that Node compares with: the exact one, unless only the other was built. */
export const LANES = process.env.MARATHON_MODULES === "relaxed" ? "relaxed" : "exact";

export const DESKTOP = { viewport: { width: 1280, height: 720 } };
export const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true, deviceScaleFactor: 2 };

export function launch() {
  return chromium.launch({
    executablePath: CHROMIUM,
    headless: true,
    args: ["--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"],
  });
}

/** Opens a view and waits until it plays. `errors` collects errors of the console and of scripts. */
export async function open(context, url, view) {
  const page = await context.newPage();
  const errors = [];
  page.on("console", (message) => {
    if (message.type() === "error") errors.push(message.text());
  });
  page.on("pageerror", (error) => errors.push(String(error)));
  await page.goto(url);
  await ready(page, view);
  return { page, errors };
}

/** Opens a view in a context of its own. `prepare` gets the context before the page is there. */
export async function visitWith(browser, url, view, options = DESKTOP, prepare = async () => {}) {
  const context = await browser.newContext(options);
  await prepare(context);
  const { page, errors } = await open(context, url, view);
  return { page, errors, close: () => context.close() };
}

export function ready(page, view) {
  return page.waitForFunction((name) => document.documentElement.dataset.ready === name, view, { timeout: 30_000 });
}

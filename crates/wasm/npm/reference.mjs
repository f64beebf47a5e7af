// Writes the reference of the package to docs/reference/npm.md. With --check, tells whether it is up to date.
import { execFileSync } from "node:child_process";
import { readFile, writeFile } from "node:fs/promises";

const page = new URL("../../../docs/reference/npm.md", import.meta.url);
execFileSync("npx", ["typedoc", "--logLevel", "Error"], { stdio: "inherit", cwd: new URL(".", import.meta.url) });
const generated = await readFile(new URL("dist/reference/README.md", import.meta.url), "utf8");
const text = generated
  .replace(/^# marathon-rl\n/, "<!-- written by `npm run reference` in crates/wasm/npm -->\n# JavaScript package\n\nThe npm package `marathon-rl`. [In your browser](../how-to/browser.md) shows how to use it.\n")
  // anchors of table rows, which nothing refers to
  .replace(/<a id="[^"]*"><\/a> /g, "")
  .replace(/\n\*\*\*\n/g, "\n")
  .replace(/\| - \|$/gm, "| |");
if (process.argv.includes("--check")) {
  const found = await readFile(page, "utf8").catch(() => "");
  if (found !== text) {
    console.error("docs/reference/npm.md is out of date; run `npm run reference` in crates/wasm/npm");
    process.exit(1);
  }
} else {
  await writeFile(page, text);
}

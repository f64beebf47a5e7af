import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";
import { repositoryAssets } from "./build/assets.ts";
import { offline } from "./build/offline.ts";
import { preload } from "./build/preload.ts";

const here = (path: string): string => fileURLToPath(new URL(path, import.meta.url));

export default defineConfig({
  // the page works from any folder of any host
  base: "./",
  plugins: [
    repositoryAssets({
      modules: here("../crates/wasm/npm/dist"),
      policies: here("../assets/policies"),
      motions: here("../assets/motions/marathon_man"),
    }),
    preload("src/app/shell.ts"),
    offline(here("public"), here("build/sw.js")),
  ],
  resolve: { alias: { "node:fs/promises": here("build/no-files.ts") } },
  build: { license: { fileName: "licenses.md" }, target: "es2022", assetsInlineLimit: 0, modulePreload: { polyfill: false } },
  worker: { format: "es" },
  // the package finds its modules by the folder that the page passes
  optimizeDeps: { exclude: ["marathon-rl"] },
});

/**
 * Files of the repository that the page loads at run time: the WebAssembly modules, under a folder with their hash, the policies
 * and some clips. The development server serves them from their place; a build copies them.
 */
import { createHash } from "node:crypto";
import { existsSync, readFileSync } from "node:fs";
import { join } from "node:path";
import type { Plugin } from "vite";
import { CLIPS } from "../src/motion/samples.ts";
import { FOLLOWER, POLICIES } from "../src/views/characters.ts";

const MODULES = ["relaxed.wasm", "exact.wasm", "relaxed-play.wasm", "exact-play.wasm"];

export interface Folders {
  readonly modules: string;
  readonly policies: string;
  readonly motions: string;
}

export function repositoryAssets({ modules, policies, motions }: Folders): Plugin {
  const found = MODULES.filter((name) => existsSync(join(modules, name)));
  if (found.length === 0) throw new Error(`${modules} has no module; run crates/wasm/build.sh first`);
  const hash = createHash("sha256");
  for (const name of found) hash.update(readFileSync(join(modules, name)));
  const folder = `wasm/${hash.digest("hex").slice(0, 10)}`;
  // path in the page to path on the disk
  const files = new Map<string, string>();
  for (const name of found) files.set(`${folder}/${name}`, join(modules, name));
  for (const name of [...POLICIES, FOLLOWER.policy]) files.set(`policies/${name}.safetensors`, join(policies, `${name}.safetensors`));
  for (const name of CLIPS) files.set(`motions/${name}.motion`, join(motions, `${name}.motion`));
  return {
    name: "repository-assets",
    config: () => ({ define: { __WASM_FOLDER__: JSON.stringify(folder) } }),
    configureServer(server) {
      server.middlewares.use((request, response, next) => {
        const path = new URL(request.url ?? "/", "http://localhost").pathname.slice(1);
        const file = files.get(path);
        if (file === undefined) return next();
        response.setHeader("content-type", path.endsWith(".wasm") ? "application/wasm" : "application/octet-stream");
        response.end(readFileSync(file));
      });
    },
    generateBundle() {
      for (const [fileName, file] of files) this.emitFile({ type: "asset", fileName, source: readFileSync(file) });
    },
  };
}

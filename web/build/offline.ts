/**
 * Writes the service worker: a template with the list of the build's files and an identifier of the build. The worker caches the
 * small files at once; the modules are cached when the page has loaded one, because a browser needs only one of them.
 */
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, statSync } from "node:fs";
import { join, relative } from "node:path";
import type { Plugin } from "vite";

function filesBelow(folder: string): string[] {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    return entry.isDirectory() ? filesBelow(path) : [path];
  });
}

export function offline(publicFolder: string, template: string): Plugin {
  return {
    name: "offline",
    apply: "build",
    generateBundle(_options, bundle) {
      const identifier = createHash("sha256");
      const add = (name: string, bytes: Uint8Array | string): void => {
        identifier.update(name);
        identifier.update(bytes);
      };
      const names: string[] = ["./", "index.html"];
      for (const [name, item] of Object.entries(bundle)) {
        add(name, item.type === "chunk" ? item.code : item.source);
        if (!name.endsWith(".wasm") && name !== "index.html") names.push(name);
      }
      for (const path of filesBelow(publicFolder).filter((path) => statSync(path).isFile())) {
        const name = relative(publicFolder, path).replaceAll("\\", "/");
        add(name, readFileSync(path));
        names.push(name);
      }
      const source = readFileSync(template, "utf8")
        .replace("__BUILD__", identifier.digest("hex").slice(0, 12))
        .replace('["__FILES__"]', JSON.stringify(names.sort()));
      this.emitFile({ type: "asset", fileName: "sw.js", source });
    },
  };
}

import { Bridge } from "./bridge.js";
import { MarathonError } from "./error.js";
import { relaxedFuses } from "./probe.js";

/** Kind of vectors of a module: multiply-adds of relaxed SIMD, or exact emulation. The bits are the same. */
export type Lanes = "relaxed" | "exact";

/** Parts of a module: everything, or all but training and the import of recordings, in two thirds of the size. */
export type Parts = "all" | "play";

/** Options of `load`. */
export interface LoadOptions {
  /** Folder of the modules. Default: the folder of this script. */
  readonly base?: string | URL;
  /** Which module. Default: `relaxed` where a probe shows that this engine's products are rounded once. */
  readonly lanes?: Lanes;
  /** Which parts. Default: `all`. */
  readonly parts?: Parts;
  /** A module that another thread has compiled, `Marathon.module`. */
  readonly module?: WebAssembly.Module;
}

/** A compiled module and an instance of it. */
export interface Loaded {
  readonly bridge: Bridge;
  readonly lanes: Lanes;
  readonly module: WebAssembly.Module;
}

/** Compiles and starts the module. */
export async function instantiate(options: LoadOptions): Promise<Loaded> {
  const lanes = options.lanes ?? ((await relaxedFuses()) ? "relaxed" : "exact");
  const name = options.parts === "play" ? `${lanes}-play` : lanes;
  const module = options.module ?? (await compile(new URL(`${name}.wasm`, options.base ?? import.meta.url)));
  const bridge = new Bridge(await WebAssembly.instantiate(module, {}));
  if (!bridge.exports.fuses()) {
    throw new MarathonError("the multiply-adds of this engine are rounded twice; load the exact module");
  }
  return { bridge, lanes, module };
}

async function compile(url: URL): Promise<WebAssembly.Module> {
  if (url.protocol === "file:") {
    const { readFile } = await import("node:fs/promises");
    return WebAssembly.compile(await readFile(url));
  }
  const response = await fetch(url);
  if (!response.ok) throw new MarathonError(`${url.href}: ${response.status} ${response.statusText}`);
  // some hosts serve modules under another type
  if (response.headers.get("content-type")?.startsWith("application/wasm")) {
    return WebAssembly.compileStreaming(response);
  }
  return WebAssembly.compile(await response.arrayBuffer());
}

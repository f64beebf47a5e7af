import { Bridge } from "./bridge.js";
import { known, one } from "./check.js";
import { MarathonError } from "./error.js";
import { relaxedFuses } from "./probe.js";

/** Kind of vectors of a module: multiply-adds of relaxed SIMD, or exact emulation. The bits are the same. */
export type Lanes = "relaxed" | "exact";

/** Parts of a module: everything, or all but training and the import of recordings, in three quarters of the size. */
export type Parts = "all" | "play";

/** Options of `load`. */
export interface LoadOptions {
  /** Folder of the modules, relative to the page. Default: the folder of this script. */
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
  known("the options", options, ["base", "lanes", "parts", "module"]);
  one("lanes", options.lanes, ["relaxed", "exact"]);
  one("parts", options.parts, ["all", "play"]);
  const lanes = options.lanes ?? ((await relaxedFuses()) ? "relaxed" : "exact");
  const name = options.parts === "play" ? `${lanes}-play` : lanes;
  const module = options.module ?? (await compile(new URL(`${name}.wasm`, folder(options.base))));
  const bridge = new Bridge(await WebAssembly.instantiate(module, {}));
  if (!bridge.exports.fuses()) {
    throw new MarathonError("the multiply-adds of this engine are rounded twice; load the exact module");
  }
  return { bridge, lanes, module };
}

/** The address of the folder of the modules. */
function folder(base?: string | URL): URL {
  const here = new URL("./", import.meta.url);
  if (base === undefined) return here;
  const text = String(base);
  try {
    return new URL(text.endsWith("/") ? text : `${text}/`, globalThis.document?.baseURI ?? globalThis.location?.href ?? here);
  } catch {
    throw new MarathonError(`base is '${text}', expected the address of a folder`);
  }
}

/** The first bytes of a module. */
const MAGIC = [0x00, 0x61, 0x73, 0x6d];

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
  const code = new Uint8Array(await response.arrayBuffer());
  if (MAGIC.some((byte, i) => code[i] !== byte)) {
    throw new MarathonError(`${url.href} is not a WebAssembly module; copy the .wasm files of the package to a folder that your page serves, and pass its address as 'base'`);
  }
  return WebAssembly.compile(code);
}

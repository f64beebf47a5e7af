/** The physics module and the files that come with the page. */
import { type Marathon, load } from "marathon-rl";

/** Folder of the page, with a slash at its end. */
const PAGE = new URL("./", document.baseURI);

/** Address of a file of the page. */
export function pageUrl(path: string): URL {
  return new URL(path, PAGE);
}

let loading: Promise<Marathon> | undefined;

/** Folder of the modules. Workers have no document that tells it. */
export const MODULES = pageUrl(`${__WASM_FOLDER__}/`).href;

/** Loads the module for play, the smaller one; a second call returns the same instance. `?lanes=exact` takes the module for older browsers. */
export function engine(): Promise<Marathon> {
  const lanes = new URLSearchParams(location.search).get("lanes");
  loading ??= load({ base: MODULES, parts: "play", ...(lanes === "exact" ? { lanes } : {}) });
  return loading;
}

/** Replaces a module that has stopped by a new instance of the same code. */
export async function restartEngine(): Promise<Marathon> {
  const { module, lanes } = await engine();
  loading = load({ module, lanes });
  return loading;
}

const files = new Map<string, Promise<Uint8Array>>();

/** A policy that comes with the page, by the name of its file. */
export function policy(name: string): Promise<Uint8Array> {
  let file = files.get(name);
  if (file === undefined) {
    file = fetchBytes(pageUrl(`policies/${name}.safetensors`));
    files.set(name, file);
    file.catch(() => files.delete(name));
  }
  return file;
}

/** The bytes at an address, at most `limit`. */
export async function fetchBytes(url: URL, limit = 64e6): Promise<Uint8Array> {
  let response: Response;
  try {
    response = await fetch(url);
  } catch {
    throw new Error(`${url.href} cannot be loaded; check the address and the network`);
  }
  if (!response.ok) throw new Error(`${url.href} cannot be loaded: status ${response.status}`);
  if (Number(response.headers.get("content-length") ?? 0) > limit) throw tooLarge(url.href, limit);
  return readAtMost(response, limit);
}

/** Reads an answer, and stops at the limit: not every server tells the size before. */
async function readAtMost(response: Response, limit: number): Promise<Uint8Array> {
  const reader = response.body?.getReader();
  const parts: Uint8Array<ArrayBuffer>[] = [];
  let length = 0;
  while (reader) {
    const { done, value } = await reader.read();
    if (done) break;
    length += value.length;
    if (length > limit) {
      await reader.cancel();
      throw tooLarge(response.url, limit);
    }
    parts.push(value);
  }
  return new Uint8Array(await new Blob(parts).arrayBuffer());
}

export function tooLarge(name: string, limit: number): Error {
  return new Error(`${name} is larger than ${Math.round(limit / 1e6)} MB`);
}

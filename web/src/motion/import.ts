/** Imports recordings beside the page, which stays responsive. */
import type { Marathon } from "marathon-rl";
import { MODULES } from "../app/engine";

export interface Recording {
  /** Folder of the modules: the page's own one is for play. */
  readonly base: string;
  readonly lanes: "relaxed" | "exact";
  readonly character: string;
  readonly name: string;
  readonly bytes: Uint8Array;
  /** Files beside the recording, by name. */
  readonly files: Readonly<Record<string, Uint8Array>>;
}

export type Imported =
  /** The bytes of a `.motion` file. */
  { readonly motion: Uint8Array; readonly warnings: readonly string[] } | { readonly error: string };

export interface Import {
  readonly result: Promise<{ readonly motion: Uint8Array; readonly warnings: readonly string[] }>;
  /** Stops it. The result never comes then. */
  stop(): void;
}

/** Starts to import a recording. */
export function startImport({ lanes }: Marathon, recording: Omit<Recording, "base" | "lanes">): Import {
  const worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
  const result = new Promise<{ motion: Uint8Array; warnings: readonly string[] }>((resolve, reject) => {
    worker.onmessage = ({ data }: MessageEvent<Imported>) => {
      worker.terminate();
      if ("error" in data) reject(new Error(data.error));
      else resolve(data);
    };
    worker.onerror = (event) => reject(new Error(event.message || "the import cannot start"));
  });
  worker.postMessage({ base: MODULES, lanes, ...recording } satisfies Recording);
  return { result, stop: () => worker.terminate() };
}

/** Messages between the page and the worker that trains. */
import type { Config, Iteration } from "marathon-rl";

export type ToWorker =
  | { readonly type: "start"; readonly base: string; readonly lanes: "relaxed" | "exact"; readonly agent: string; readonly config: Config }
  | { readonly type: "pause" }
  | { readonly type: "continue" };

export type FromWorker =
  | { readonly type: "point"; readonly iteration: Iteration; readonly seconds: number }
  | { readonly type: "policy"; readonly bytes: Uint8Array; readonly done: boolean }
  | { readonly type: "error"; readonly message: string };

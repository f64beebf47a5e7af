/** Links: the view and its settings are in the part of the address after `#`, such as `#/play?agent=Ant&seed=3`. */

import type { OptionValue } from "marathon-rl";

export const VIEWS = ["play", "learn", "models", "motion", "policies", "live"] as const;
export type ViewName = (typeof VIEWS)[number];

/** Settings of the whole page, before the `#`. */
const PAGE_WIDE = new Set(["embed", "lanes", "quality"]);

export interface Route {
  readonly view: ViewName;
  readonly params: URLSearchParams;
}

/** The address with all settings of the view after the `#`. */
export function tidy(url: URL): URL {
  const tidied = new URL(url);
  for (const name of [...tidied.searchParams.keys()]) if (!PAGE_WIDE.has(name)) tidied.searchParams.delete(name);
  tidied.hash = linkOf(parseRoute(url));
  return tidied;
}

/** The route of an address. `?model=`, `?agent=` and `?policy=` before the `#` count too. */
export function parseRoute(url: URL): Route {
  const [path = "", query = ""] = url.hash.replace(/^#\/?/, "").split("?", 2);
  const params = new URLSearchParams(query);
  const own = new Set(params.keys());
  for (const [name, value] of url.searchParams) {
    if (!PAGE_WIDE.has(name) && !own.has(name)) params.append(name, value);
  }
  const named = VIEWS.find((view) => view === path);
  const implied = params.has("model") ? "models" : params.has("policy") ? "policies" : "play";
  return { view: named ?? implied, params };
}

export function linkOf({ view, params }: Route): string {
  const query = params.toString();
  return `#/${view}${query === "" ? "" : `?${query}`}`;
}

/** Whether the page is shown inside another one. */
export function isEmbedded(url: URL): boolean {
  return url.searchParams.get("embed") === "1";
}

/** Options of a task in a link: `option=difficulty=0.5&option=course=steps`. */
export function optionsOf(params: URLSearchParams): Record<string, OptionValue> {
  const options = new Map<string, OptionValue>();
  for (const text of params.getAll("option")) {
    const [name = "", ...rest] = text.split("=");
    const value = rest.join("=");
    const number = value.trim() === "" ? Number.NaN : Number(value);
    options.set(name, value === "true" || value === "false" ? value === "true" : Number.isFinite(number) ? number : value);
  }
  return Object.fromEntries(options);
}

/** A whole number of an address. */
export function integer(params: URLSearchParams, name: string, low: number, high: number, otherwise: number): number {
  const text = params.get(name);
  if (text === null) return otherwise;
  const value = text.trim() === "" ? Number.NaN : Number(text);
  if (Number.isInteger(value) && value >= low && value <= high) return value;
  throw new Error(`${name} is '${text}', expected a whole number from ${low} to ${high}`);
}

/** Links: the view and its settings are in the part of the address after `#`, such as `#/play?agent=Ant&seed=3`. */

export const VIEWS = ["play", "learn", "models", "motion", "policies"] as const;
export type ViewName = (typeof VIEWS)[number];

export interface Route {
  readonly view: ViewName;
  readonly params: URLSearchParams;
}

/** The route of an address. `?model=`, `?agent=` and `?policy=` before the `#` count too. */
export function parseRoute(url: URL): Route {
  const [path = "", query = ""] = url.hash.replace(/^#\/?/, "").split("?", 2);
  const params = new URLSearchParams(query);
  for (const [name, value] of url.searchParams) {
    if (name !== "embed" && !params.has(name)) params.set(name, value);
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

/** A whole number of an address, within limits. */
export function integer(params: URLSearchParams, name: string, low: number, high: number, otherwise: number): number {
  const text = params.get(name);
  const value = text === null || text.trim() === "" ? Number.NaN : Number(text);
  return Number.isInteger(value) ? Math.min(Math.max(value, low), high) : otherwise;
}

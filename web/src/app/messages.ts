/** Messages to the user: a line at the bottom of the page, which screen readers read out. */
import { el } from "./dom";

export type Kind = "info" | "error";

/** Seconds that a message stays. */
const SECONDS: Record<Kind, number> = { info: 5, error: 15 };

export class Messages {
  readonly element: HTMLElement;
  readonly #text = el("span", {});
  #timer = 0;

  constructor() {
    const close = el("button", { type: "button", class: "close", "aria-label": "Close message", click: () => this.clear() }, "×");
    this.element = el("div", { class: "message", role: "status", "aria-live": "polite", hidden: true }, this.#text, close);
  }

  say(text: string, kind: Kind = "info"): void {
    this.element.hidden = false;
    this.element.dataset["kind"] = kind;
    this.element.setAttribute("aria-live", kind === "error" ? "assertive" : "polite");
    this.#text.textContent = text;
    clearTimeout(this.#timer);
    this.#timer = window.setTimeout(() => this.clear(), 1000 * SECONDS[kind]);
  }

  clear(): void {
    this.element.hidden = true;
    this.#text.textContent = "";
  }
}

/** The message of anything that was thrown, at a length that fits the screen. */
export function reason(error: unknown): string {
  const text = error instanceof Error ? error.message : String(error);
  const line = text.replaceAll(/\s+/g, " ").trim();
  return line.length > 400 ? `${line.slice(0, 400)} …` : line;
}

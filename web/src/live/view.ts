/** Live: agents of a program on this computer, such as a run in training. `marathon serve` and `env.show()` open it. */
import { el } from "../app/dom";
import { reason } from "../app/messages";
import type { Context, View } from "../app/view";
import { NO_HANDS, PointerControl } from "../input/pointer";
import { type Chart, returnChart, speedChart } from "../learn/chart";
import { type Curve, type Message, Parser } from "./messages";
import { Troupe } from "./troupe";

/** Time before the page tries again to reach the program, ms. */
const AGAIN = 1500;

/** What the program refuses for good. */
class Refused extends Error {}

class Live implements View {
  readonly #context: Context;
  readonly #pointer: PointerControl;
  readonly #title = el("h3", {}, "");
  readonly #status = el("p", { class: "numbers", role: "status" }, "Waiting for the program");
  readonly #charts = el("div", { class: "charts" });
  readonly #end = new AbortController();
  #returns: Chart | null = null;
  #speeds: Chart | null = null;
  #troupe: Troupe | null = null;
  #agents = 0;
  /** Frames so far. */
  frames = 0;

  constructor(context: Context) {
    this.#context = context;
    const { stage, panel } = context;
    this.#pointer = new PointerControl(stage, NO_HANDS);
    stage.canvas.setAttribute("aria-label", "Agents of a running program. Drag to look around.");
    panel.replaceChildren(el("h2", {}, "Live"), this.#title, this.#status, this.#charts);
    void this.#follow();
  }

  dispose(): void {
    this.#end.abort();
    this.#pointer.dispose();
    this.#troupe?.dispose();
  }

  /** Reads from the program, again and again, until the view is left. */
  async #follow(): Promise<void> {
    const { signal } = this.#end;
    while (!signal.aborted) {
      try {
        await this.#read(signal);
        this.#status.textContent = "The program has ended.";
      } catch (error) {
        if (signal.aborted) return;
        if (error instanceof Refused) {
          this.#status.textContent = error.message;
          return;
        }
        this.#status.textContent = `The program cannot be reached: ${reason(error)}`;
      }
      await new Promise((resolve) => setTimeout(resolve, AGAIN));
    }
  }

  async #read(signal: AbortSignal): Promise<void> {
    const url = new URL("live", document.baseURI);
    url.searchParams.set("token", this.#context.params.get("token") ?? "");
    const response = await fetch(url, { signal, cache: "no-store" });
    if (!response.ok || !response.body) throw new Refused(await response.text());
    const parser = new Parser();
    const reader = response.body.getReader();
    for (let part = await reader.read(); !part.done; part = await reader.read()) {
      for (const message of parser.push(part.value)) this.#take(message);
    }
  }

  #take(message: Message): void {
    switch (message.type) {
      case "scene": {
        const { stage } = this.#context;
        this.#title.textContent = message.title;
        const first = this.#troupe === null;
        this.#troupe?.dispose();
        this.#troupe = new Troupe(stage, message);
        this.#agents = message.agents;
        if (first) {
          stage.follow.set("side", Math.min(Math.max(0.9 * this.#troupe.width, 4), 30));
          stage.follow.yaw -= 0.1;
          stage.follow.turn(0.25, 0.16);
        }
        stage.show(this.#troupe);
        break;
      }
      case "ground":
        this.#troupe?.lay(message);
        break;
      case "frame":
        this.#troupe?.take(message);
        this.frames++;
        this.#status.textContent = `${this.#agents} agent${this.#agents === 1 ? "" : "s"} · ${message.time.toFixed(1)} s`;
        break;
      case "curve":
        this.#draw(message);
    }
  }

  #draw({ total, steps, return_mean, speed_mean }: Curve): void {
    this.#returns ??= returnChart(total);
    this.#speeds ??= speedChart(total);
    if (this.#charts.childElementCount === 0) this.#charts.append(this.#returns.element, this.#speeds.element);
    for (const [chart, values] of [[this.#returns, return_mean], [this.#speeds, speed_mean]] as const) {
      chart.clear(Math.max(total, steps.at(-1) ?? 0));
      for (const [i, step] of steps.entries()) chart.add(step, values[i] ?? null);
    }
  }
}

export function makeLive(context: Context): View {
  return new Live(context);
}

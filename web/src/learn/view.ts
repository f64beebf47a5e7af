/** Learn: a figure learns from nothing in a worker, while figures on the screen act by its newest policy. */
import { button, download, el, select } from "../app/dom";
import { MODULES } from "../app/engine";
import { reason } from "../app/messages";
import { integer } from "../app/route";
import type { Context, View } from "../app/view";
import { NO_HANDS, PointerControl } from "../input/pointer";
import { type Chart, returnChart, speedChart } from "./chart";
import { Crowd } from "./crowd";
import { keep } from "./kept";
import type { FromWorker, ToWorker } from "./messages";

interface Task {
  readonly name: string;
  readonly label: string;
  readonly agent: string;
  readonly agents: number;
  readonly gap: number;
  readonly distance: number;
  /** Decisions of a run, in millions. A hopper's shorter runs end standing still. */
  readonly millions: number;
}

const TASKS: readonly Task[] = [
  { name: "hopper", label: "Hopper", agent: "Hopper-v0", agents: 12, gap: 0.9, distance: 9, millions: 4 },
  { name: "walker2d", label: "Walker", agent: "Walker2d-v0", agents: 12, gap: 1, distance: 10, millions: 6 },
  { name: "ant", label: "Ant", agent: "Ant-v0", agents: 8, gap: 2.2, distance: 14, millions: 6 },
];

type Phase = "ready" | "running" | "paused" | "done";

class Learn implements View {
  readonly #context: Context;
  readonly #task: Task;
  readonly #crowd: Crowd;
  readonly #pointer: PointerControl;
  readonly #returns: Chart;
  readonly #speeds: Chart;
  readonly #numbers = el("p", { class: "numbers", role: "status" });
  readonly #main: HTMLButtonElement;
  readonly #after: HTMLButtonElement[];
  #worker: Worker | null = null;
  #policy: Uint8Array | null = null;
  #phase: Phase = "ready";
  #seed: number;
  #steps: number;

  constructor(context: Context) {
    this.#context = context;
    const { params, stage, marathon } = context;
    const task = TASKS.find(({ name }) => name === params.get("agent")) ?? TASKS[0];
    if (!task) throw new Error("there are no tasks");
    this.#task = task;
    this.#seed = integer(params, "seed", 0, 2 ** 31 - 1, 1);
    this.#steps = integer(params, "steps", 10_000, 1e9, 1e6 * task.millions);
    this.#crowd = new Crowd(stage, marathon, { ...task, seed: this.#seed, onError: (error) => context.fail(error) });
    this.#pointer = new PointerControl(stage, NO_HANDS);
    stage.follow.set("side", task.distance);
    stage.follow.yaw -= 0.1;
    stage.follow.turn(0.25, 0.16);
    stage.canvas.setAttribute("aria-label", `${task.agents} figures that act by the newest policy. Drag to look around.`);
    this.#returns = returnChart(this.#steps);
    this.#speeds = speedChart(this.#steps);
    this.#main = button("Start", () => this.#press(), { class: "primary" });
    this.#after = [
      button("Keep", () => this.#keep(), { title: "Keep the policy in this browser" }),
      button("Download", () => this.#download(), { title: "Save the policy as a file" }),
      button("Watch", () => this.#watch(), { title: "Play with the policy" }),
    ];
    this.#fill();
    this.#update();
    stage.show(this.#crowd);
    if (params.get("start") === "1") this.#start();
  }

  /** Numbers for tests. */
  get progress(): { readonly phase: Phase; readonly first: number | null; readonly last: number | null; readonly text: string } {
    return { phase: this.#phase, first: this.#returns.first, last: this.#returns.last, text: this.#numbers.textContent ?? "" };
  }

  dispose(): void {
    this.#worker?.terminate();
    this.#pointer.dispose();
    this.#crowd.dispose();
  }

  #fill(): void {
    const { panel, marathon, open } = this.#context;
    const number = (label: string, value: number, low: number, set: (value: number) => void): HTMLElement => {
      const input = el("input", {
        type: "number",
        min: low,
        step: 1,
        value,
        change: () => {
          if (Number.isInteger(input.valueAsNumber) && input.valueAsNumber >= low) set(input.valueAsNumber);
          else input.value = String(value);
        },
      });
      return el("label", { class: "field" }, el("span", {}, label), input);
    };
    const slow = "Training needs relaxed SIMD, which this browser does not have: here it is about ten times slower.";
    panel.replaceChildren(
      el("h2", {}, "Learn"),
      el("p", { class: "roomy" }, `${this.#task.label} learns to move from nothing, in this page.`),
      marathon.lanes === "exact" ? el("p", { class: "notice" }, slow) : "",
      el(
        "div",
        { class: "trio" },
        select("Body", TASKS.map(({ name, label }) => ({ value: name, label })), this.#task.name, (name) => open("learn", { agent: name })),
        number("Seed", this.#seed, 0, (seed) => {
          this.#seed = seed;
          this.#context.link({ seed: String(seed) });
        }),
        number("Decisions", this.#steps, 10_000, (steps) => {
          this.#steps = steps;
          this.#context.link({ steps: String(steps) });
        }),
      ),
      el("div", { class: "row" }, this.#main, ...this.#after),
      this.#numbers,
      el("div", { class: "charts" }, this.#returns.element, this.#speeds.element),
    );
  }

  #press(): void {
    switch (this.#phase) {
      case "ready":
      case "done":
        this.#start();
        break;
      case "running":
        this.#tell({ type: "pause" });
        this.#set("paused");
        break;
      case "paused":
        this.#tell({ type: "continue" });
        this.#set("running");
        break;
    }
  }

  #start(): void {
    const { marathon } = this.#context;
    this.#worker?.terminate();
    this.#returns.clear(this.#steps);
    this.#speeds.clear(this.#steps);
    this.#worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#take(data);
    this.#worker.onerror = (event) => this.#stop(event.message || "the training cannot start");
    const config = { run: { total_steps: this.#steps, seed: this.#seed } };
    this.#tell({ type: "start", base: MODULES, lanes: marathon.lanes, agent: this.#task.agent, config });
    this.#set("running");
  }

  #tell(message: ToWorker): void {
    this.#worker?.postMessage(message);
  }

  #take(message: FromWorker): void {
    switch (message.type) {
      case "point": {
        const { steps, return_mean, speed_mean, fall_fraction } = message.iteration;
        this.#returns.add(steps, return_mean);
        this.#speeds.add(steps, speed_mean);
        const rate = steps / Math.max(message.seconds, 1e-3);
        const falls = fall_fraction === null ? "" : ` · ${(100 * fall_fraction).toFixed(0)} % falls`;
        const count = steps < 1e6 ? `${(steps / 1e3).toFixed(0)} k` : `${(steps / 1e6).toFixed(2)} M`;
        this.#numbers.textContent = `${count} decisions · ${(rate / 1e3).toFixed(1)} k/s${falls}`;
        break;
      }
      case "policy":
        this.#policy = message.bytes;
        try {
          this.#crowd.env.setPolicy(message.bytes);
        } catch (error) {
          this.#context.fail(error);
        }
        if (message.done) {
          this.#set("done");
          this.#context.say("The training is done.");
        }
        this.#update();
        break;
      case "error":
        this.#stop(message.message);
    }
  }

  #stop(message: string): void {
    this.#worker?.terminate();
    this.#worker = null;
    this.#set("ready");
    this.#context.say(message, "error");
  }

  #set(phase: Phase): void {
    this.#phase = phase;
    this.#update();
  }

  #update(): void {
    const labels: Record<Phase, string> = { ready: "Start", running: "Pause", paused: "Continue", done: "Train again" };
    this.#main.textContent = labels[this.#phase];
    for (const item of this.#after) item.disabled = this.#policy === null;
  }

  get #name(): string {
    return `${this.#task.name}-seed${this.#seed}`;
  }

  #keep(): void {
    if (!this.#policy) return;
    try {
      keep(this.#name, this.#policy);
      this.#context.say(`${this.#name} is kept in this browser. The view Policies lists it.`);
    } catch (error) {
      this.#context.say(`The policy cannot be kept: ${reason(error)}`, "error");
    }
  }

  #download(): void {
    if (this.#policy) download(`${this.#name}.safetensors`, this.#policy);
  }

  #watch(): void {
    if (this.#policy) this.#context.open("policies", {}, [{ path: `${this.#name}.safetensors`, bytes: this.#policy }]);
  }
}

export function makeLearn(context: Context): View {
  return new Learn(context);
}

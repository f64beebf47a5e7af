/** Learn: a figure learns from nothing in a worker, while figures on the screen act by its newest policy. */
import { button, download, el, select } from "../app/dom";
import { reason } from "../app/messages";
import { integer } from "../app/route";
import type { Context, View } from "../app/view";
import { NO_HANDS, PointerControl } from "../input/pointer";
import { type Chart, returnChart, speedChart } from "./chart";
import { Crowd } from "./crowd";
import { keep } from "./kept";
import { type Phase, type Plan, type Point, Run, latestRun } from "./run";

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

/** Fewest and most decisions of a run. */
const DECISIONS = { low: 10_000, high: 1e9 };

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
  #run: Run | null = null;
  #seed: number;
  #steps: number;

  constructor(context: Context) {
    this.#context = context;
    const { params, stage, marathon } = context;
    // without settings in the link, the view shows the training that is there
    const last = ["agent", "seed", "steps"].some((name) => params.has(name)) ? null : (latestRun()?.plan ?? null);
    const named = params.get("agent") ?? TASKS.find(({ agent }) => agent === last?.agent)?.name ?? TASKS[0]?.name;
    const task = TASKS.find(({ name }) => name === named);
    if (!task) throw new Error(`agent is '${named}', expected ${TASKS.map(({ name }) => name).join(", ")}`);
    this.#task = task;
    this.#seed = integer(params, "seed", 0, 2 ** 31 - 1, last?.seed ?? 1);
    this.#steps = integer(params, "steps", DECISIONS.low, DECISIONS.high, last?.steps ?? 1e6 * task.millions);
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
    const run = latestRun(this.#plan);
    if (run) this.#attach(run);
    else if (params.get("start") === "1") this.#start();
  }

  /** Numbers for tests. */
  get progress(): { readonly phase: Phase | "ready"; readonly first: number | null; readonly last: number | null; readonly text: string } {
    return { phase: this.#run?.phase ?? "ready", first: this.#returns.first, last: this.#returns.last, text: this.#numbers.textContent ?? "" };
  }

  dispose(): void {
    if (this.#run) {
      this.#run.listener = null;
      this.#run.pause();
    }
    this.#pointer.dispose();
    this.#crowd.dispose();
  }

  #fill(): void {
    const { panel, marathon, open } = this.#context;
    const number = (label: string, value: number, low: number, high: number, set: (value: number) => void): HTMLElement => {
      const input = el("input", {
        type: "number",
        min: low,
        max: high,
        step: 1,
        value,
        change: () => {
          const whole = Number.isInteger(input.valueAsNumber) && input.valueAsNumber >= low && input.valueAsNumber <= high;
          if (whole) set((value = input.valueAsNumber));
          else this.#context.say(`${label} is ${input.value || "not a number"}, expected ${low} to ${high}`, "error");
          if (!whole) input.value = String(value);
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
        number("Seed", this.#seed, 0, 2 ** 31 - 1, (seed) => {
          this.#seed = seed;
          this.#context.link({ seed: String(seed) });
        }),
        number("Decisions", this.#steps, DECISIONS.low, DECISIONS.high, (steps) => {
          this.#steps = steps;
          this.#context.link({ steps: String(steps) });
        }),
      ),
      el("div", { class: "row" }, this.#main, ...this.#after),
      this.#numbers,
      el("div", { class: "charts" }, this.#returns.element, this.#speeds.element),
    );
  }

  get #plan(): Plan {
    return { agent: this.#task.agent, seed: this.#seed, steps: this.#steps };
  }

  #press(): void {
    if (this.#run?.phase === "running") this.#run.pause();
    else if (this.#run?.phase === "paused") this.#run.resume();
    else this.#start();
  }

  #start(): void {
    this.#attach(new Run(this.#plan, this.#context.marathon.lanes));
  }

  /** Shows a training and what it has learned so far. */
  #attach(run: Run): void {
    this.#run = run;
    this.#returns.clear(run.plan.steps);
    this.#speeds.clear(run.plan.steps);
    for (const point of run.points) this.#draw(point);
    if (run.policy) this.#act(run.policy);
    run.listener = {
      point: (point) => this.#draw(point),
      learned: (policy) => this.#act(policy),
      changed: (message) => {
        if (message !== undefined) this.#context.say(message, "error");
        if (run.phase === "done") this.#context.say("The training is done.");
        this.#update();
      },
    };
    this.#update();
  }

  #draw({ iteration, seconds }: Point): void {
    const { steps, return_mean, speed_mean, fall_fraction } = iteration;
    this.#returns.add(steps, return_mean);
    this.#speeds.add(steps, speed_mean);
    const rate = steps / Math.max(seconds, 1e-3);
    const falls = fall_fraction === null ? "" : ` · ${(100 * fall_fraction).toFixed(0)} % falls`;
    const count = steps < 1e6 ? `${(steps / 1e3).toFixed(0)} k` : `${(steps / 1e6).toFixed(2)} M`;
    this.#numbers.textContent = `${count} decisions · ${(rate / 1e3).toFixed(1)} k/s${falls}`;
  }

  #act(policy: Uint8Array): void {
    try {
      this.#crowd.env.setPolicy(policy);
    } catch (error) {
      this.#context.fail(error);
    }
    this.#update();
  }

  #update(): void {
    const labels: Record<Phase | "ready", string> = { ready: "Start", running: "Pause", paused: "Continue", done: "Train again", failed: "Start" };
    this.#main.textContent = labels[this.#run?.phase ?? "ready"];
    for (const item of this.#after) item.disabled = !this.#run?.policy;
  }

  get #name(): string {
    return `${this.#task.name}-seed${this.#run?.plan.seed ?? this.#seed}`;
  }

  #keep(): void {
    if (!this.#run?.policy) return;
    try {
      keep(this.#name, this.#run.policy);
      this.#context.say(`${this.#name} is kept in this browser. The view Policies lists it.`);
    } catch (error) {
      this.#context.say(`The policy cannot be kept: ${reason(error)}`, "error");
    }
  }

  #download(): void {
    if (this.#run?.policy) download(`${this.#name}.safetensors`, this.#run.policy);
  }

  #watch(): void {
    const policy = this.#run?.policy;
    if (policy) this.#context.open("policies", {}, [{ path: `${this.#name}.safetensors`, bytes: policy }]);
  }
}

export function makeLearn(context: Context): View {
  return new Learn(context);
}

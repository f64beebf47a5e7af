/** A training in a worker. It outlives the view: it pauses while the user is elsewhere, and goes on where it was. */
import type { Iteration, Lanes } from "marathon-rl";
import { MODULES } from "../app/engine";
import type { FromWorker, ToWorker } from "./messages";

export type Phase = "running" | "paused" | "done" | "failed";

/** What a training is of. */
export interface Plan {
  readonly agent: string;
  readonly seed: number;
  readonly steps: number;
}

/** What the view does when something has happened. */
export interface Listener {
  point(point: Point): void;
  /** There is a new policy. */
  learned(policy: Uint8Array): void;
  /** Another phase; `message` says why it failed. */
  changed(message?: string): void;
}

export interface Point {
  readonly iteration: Iteration;
  /** Time of training so far, s. */
  readonly seconds: number;
}

/** The training that was started last. */
let latest: Run | null = null;

/** The training that was started last, if there is one; `of` asks for one of a plan. */
export function latestRun(of?: Plan): Run | null {
  const plan = latest?.plan;
  return !of || (plan?.agent === of.agent && plan.seed === of.seed && plan.steps === of.steps) ? latest : null;
}

export class Run {
  readonly plan: Plan;
  readonly points: Point[] = [];
  policy: Uint8Array | null = null;
  listener: Listener | null = null;
  #phase: Phase = "running";
  readonly #worker: Worker;

  /** Starts a training. It ends the one before. */
  constructor(plan: Plan, lanes: Lanes) {
    latest?.stop();
    latest = this;
    this.plan = plan;
    this.#worker = new Worker(new URL("./worker.ts", import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }: MessageEvent<FromWorker>) => this.#take(data);
    this.#worker.onerror = (event) => this.#fail(event.message || "the training cannot start");
    const config = { run: { total_steps: plan.steps, seed: plan.seed } };
    this.#tell({ type: "start", base: MODULES, lanes, agent: plan.agent, config });
  }

  get phase(): Phase {
    return this.#phase;
  }

  pause(): void {
    if (this.#phase !== "running") return;
    this.#tell({ type: "pause" });
    this.#set("paused");
  }

  resume(): void {
    if (this.#phase !== "paused") return;
    this.#tell({ type: "continue" });
    this.#set("running");
  }

  stop(): void {
    this.#worker.terminate();
    this.listener = null;
    if (latest === this) latest = null;
  }

  #tell(message: ToWorker): void {
    this.#worker.postMessage(message);
  }

  #take(message: FromWorker): void {
    switch (message.type) {
      case "point": {
        const point = { iteration: message.iteration, seconds: message.seconds };
        this.points.push(point);
        this.listener?.point(point);
        break;
      }
      case "policy":
        this.policy = message.bytes;
        this.listener?.learned(message.bytes);
        if (message.done) {
          this.#worker.terminate();
          this.#set("done");
        }
        break;
      case "error":
        this.#fail(message.message);
    }
  }

  #fail(message: string): void {
    this.#worker.terminate();
    this.#phase = "failed";
    this.listener?.changed(message);
  }

  #set(phase: Phase): void {
    this.#phase = phase;
    this.listener?.changed();
  }
}

/** Figures side by side that act by the newest policy. */
import type { Vector3 } from "three";
import type { Env, Marathon } from "marathon-rl";
import { Clock } from "../physics/clock";
import type { Level } from "../scene/quality";
import { Row } from "../scene/row";
import type { Actor, Stage } from "../scene/stage";

/** Seconds after which all figures begin again: they stay in the picture. */
const EPISODE = 6;

export interface CrowdOptions {
  readonly agent: string;
  readonly agents: number;
  /** Distance between neighbors, m. */
  readonly gap: number;
  readonly seed: number;
  readonly policy?: Uint8Array;
  readonly onError: (error: unknown) => void;
}

export class Crowd implements Actor {
  readonly env: Env;
  readonly clock: Clock;
  readonly #row: Row;
  readonly #agents: number;
  readonly #onError: (error: unknown) => void;

  constructor(stage: Stage, marathon: Marathon, { agent, agents, gap, seed, policy, onError }: CrowdOptions) {
    this.#agents = agents;
    this.#onError = onError;
    const probe = marathon.env(agent, { agents: 1 });
    const length = Math.round(EPISODE / probe.spec.dt);
    probe.free();
    this.env = marathon.env(agent, { agents, seed, max_episode_steps: length, ...(policy ? { policy } : {}) });
    this.clock = new Clock(this.env.spec.dt);
    this.#row = new Row(stage, this.env.model, agents, gap);
    this.#take();
    for (let i = 0; i < agents; i++) this.#row.cut(i);
  }

  frame(dt: number): Vector3 {
    this.clock.run(dt, () => this.#step(), this.#onError);
    return this.#row.show(this.clock.share, dt);
  }

  quality(level: Level): void {
    this.#row.quality(level);
  }

  dispose(): void {
    this.#row.dispose();
    this.env.free();
  }

  #step(): void {
    const { terminated, truncated } = this.env.step();
    const over = Array.from({ length: this.#agents }, (_, i) => terminated[i] === 1 || truncated[i] === 1);
    this.#take();
    for (const [agent, ended] of over.entries()) if (ended) this.#row.cut(agent);
  }

  #take(): void {
    // a view of the module's memory lasts until its next call
    const geoms = this.env.poses().slice();
    this.#row.take(geoms, this.env.bodyPoses());
  }
}

/** Figures side by side that act by the newest policy. */
import { Vector3 } from "three";
import type { Env, Marathon } from "marathon-rl";
import { Clock } from "../physics/clock";
import { Blobs } from "../scene/blobs";
import { Figure } from "../scene/figure";
import { PoseTrack } from "../scene/poses";
import type { Level } from "../scene/quality";
import type { Actor, Stage } from "../scene/stage";

/** Seconds after which all figures begin again: they stay in the picture. */
const EPISODE = 6;
/** Half-life of the point that the camera looks at, s. */
const SMOOTH = 0.35;

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
  readonly #figure: Figure;
  readonly #agents: number;
  readonly #shift: (agent: number) => readonly [number, number];
  readonly #geoms: PoseTrack;
  readonly #bodies: PoseTrack;
  readonly #onError: (error: unknown) => void;
  readonly #focus = new Vector3(0, 0, 0.7);
  readonly #blobs: Blobs;

  constructor(stage: Stage, marathon: Marathon, { agent, agents, gap, seed, policy, onError }: CrowdOptions) {
    this.#agents = agents;
    this.#onError = onError;
    const probe = marathon.env(agent, { agents: 1 });
    const length = Math.round(EPISODE / probe.spec.dt);
    probe.free();
    this.env = marathon.env(agent, { agents, seed, max_episode_steps: length, ...(policy ? { policy } : {}) });
    const { model, spec } = this.env;
    this.clock = new Clock(spec.dt);
    this.#figure = new Figure(model, { agents, joints: true, tinted: true, level: stage.level });
    this.#shift = (i) => [0, gap * (i - (agents - 1) / 2)];
    this.#figure.spread(this.#shift);
    this.#geoms = new PoseTrack(16 * agents * model.geoms.length);
    this.#bodies = new PoseTrack(16 * agents * model.bodies.length);
    this.#blobs = new Blobs(model, agents, this.#shift);
    stage.world.add(this.#figure.group, this.#blobs.mesh);
    stage.scenery.setShadows(0.5 * gap * agents + 2);
    this.quality(stage.level);
    this.#take();
    this.#geoms.cut();
    this.#bodies.cut();
  }

  frame(dt: number): Vector3 {
    this.clock.run(dt, () => this.#step(), this.#onError);
    const { share } = this.clock;
    const geoms = this.#geoms.mix(share);
    this.#figure.show(geoms, this.#bodies.mix(share));
    this.#blobs.show(geoms);
    this.#look(dt);
    return this.#focus;
  }

  quality(level: Level): void {
    this.#figure.setQuality(level);
    this.#blobs.setQuality(level);
  }

  dispose(): void {
    this.#figure.dispose();
    this.#blobs.dispose();
    this.env.free();
  }

  #step(): void {
    const { terminated, truncated } = this.env.step();
    const over = Array.from({ length: this.#agents }, (_, i) => terminated[i] === 1 || truncated[i] === 1);
    this.#take();
    for (const [agent, ended] of over.entries()) if (ended) this.#cut(agent);
  }

  #take(): void {
    this.#geoms.push(this.env.poses());
    this.#bodies.push(this.env.bodyPoses());
  }

  /** An agent begins again somewhere else. */
  #cut(agent: number): void {
    const { geoms, bodies } = this.env.model;
    for (const [track, count] of [[this.#geoms, geoms.length], [this.#bodies, bodies.length]] as const) {
      for (let i = 0; i < count; i++) {
        const at = 16 * (i * this.#agents + agent);
        track.cut(at, at + 16);
      }
    }
  }

  /** Looks at the middle of all trunks. */
  #look(dt: number): void {
    const bodies = this.#bodies.now;
    let [x, y] = [0, 0];
    for (let agent = 0; agent < this.#agents; agent++) {
      const at = 16 * (this.#agents + agent);
      x += (bodies[at + 12] ?? 0) / this.#agents;
      y += (bodies[at + 13] ?? 0) / this.#agents;
    }
    const share = 1 - Math.exp((-Math.LN2 * dt) / SMOOTH);
    this.#focus.x += (x - this.#focus.x) * share;
    this.#focus.y += (y - this.#focus.y) * share;
  }
}

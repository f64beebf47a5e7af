/** Figures of one model side by side. */
import { Vector3 } from "three";
import type { ModelInfo } from "marathon-rl";
import { Blobs, type Height } from "./blobs";
import { Figure } from "./figure";
import { PoseTrack } from "./poses";
import type { Level } from "./quality";
import type { Stage } from "./stage";

/** Half-life of the point that the camera looks at, s. */
const SMOOTH = 0.35;

export class Row {
  readonly #model: ModelInfo;
  readonly #agents: number;
  readonly #figure: Figure;
  readonly #geoms: PoseTrack;
  readonly #bodies: PoseTrack;
  readonly #blobs: Blobs;
  readonly #focus = new Vector3(0, 0, 0.7);

  /** `gap` is the distance between neighbors, m. */
  constructor(stage: Stage, model: ModelInfo, agents: number, gap: number) {
    this.#model = model;
    this.#agents = agents;
    this.#figure = new Figure(model, { agents, joints: true, tinted: true, level: stage.level });
    const shift = (agent: number): readonly [number, number] => [0, shiftOf(agent, agents, gap)];
    this.#figure.spread(shift);
    this.#geoms = new PoseTrack(16 * agents * model.geoms.length);
    this.#bodies = new PoseTrack(16 * agents * model.bodies.length);
    this.#blobs = new Blobs(model, agents, shift);
    stage.world.add(this.#figure.group, this.#blobs.mesh);
    stage.scenery.setShadows(0.5 * gap * agents + 2);
    this.quality(stage.level);
  }

  /** Takes in matrices of geoms and bodies, `[geom][agent][16]` and `[body][agent][16]`. They are copied. */
  take(geoms: Float32Array, bodies: Float32Array): void {
    this.#geoms.push(geoms);
    this.#bodies.push(bodies);
  }

  /** The last poses of an agent have nothing to do with the ones before. */
  cut(agent: number): void {
    for (const [track, count] of [[this.#geoms, this.#model.geoms.length], [this.#bodies, this.#model.bodies.length]] as const) {
      for (let i = 0; i < count; i++) {
        const at = 16 * (i * this.#agents + agent);
        track.cut(at, at + 16);
      }
    }
  }

  /** Shows the poses at a share of the way between the last two. Returns the middle of all trunks, which moves smoothly. */
  show(share: number, dt: number, height?: Height): Vector3 {
    const geoms = this.#geoms.mix(share);
    const bodies = this.#bodies.mix(share);
    this.#figure.show(geoms, bodies);
    this.#blobs.show(geoms, height);
    let [x, y] = [0, 0];
    for (let agent = 0; agent < this.#agents; agent++) {
      const at = 16 * (this.#agents + agent);
      x += (bodies[at + 12] ?? 0) / this.#agents;
      y += (bodies[at + 13] ?? 0) / this.#agents;
    }
    const part = 1 - Math.exp((-Math.LN2 * dt) / SMOOTH);
    this.#focus.x += (x - this.#focus.x) * part;
    this.#focus.y += (y - this.#focus.y) * part;
    return this.#focus;
  }

  quality(level: Level): void {
    this.#figure.setQuality(level);
    this.#blobs.setQuality(level);
  }

  dispose(): void {
    this.#figure.dispose();
    this.#blobs.dispose();
  }
}

/** Where an agent stands in the row, m. */
export function shiftOf(agent: number, agents: number, gap: number): number {
  return gap * (agent - (agents - 1) / 2);
}

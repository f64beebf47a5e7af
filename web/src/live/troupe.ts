/** The agents of a running program. */
import type { Vector3 } from "three";
import type { Level } from "../scene/quality";
import { Row, shiftOf } from "../scene/row";
import type { Actor, Stage } from "../scene/stage";
import { Terrain } from "../scene/terrain";
import type { Frame, Ground, Scene } from "./messages";

/** Distance between neighbors that move in a plane, and of others, m. */
const [PLANAR, FREE] = [1, 2.2];

export class Troupe implements Actor {
  readonly #stage: Stage;
  readonly #scene: Scene;
  readonly #row: Row;
  readonly #gap: number;
  readonly #terrains = new Map<number, Terrain>();
  #episodes: Uint32Array | null = null;
  #elapsed = 0;

  constructor(stage: Stage, scene: Scene) {
    this.#stage = stage;
    this.#scene = scene;
    const { model, agents } = scene;
    const wide = Math.max(0, ...model.fields.map(({ radius }) => 2 * radius[1] + 0.1));
    this.#gap = Math.max(model.nq === model.nv ? PLANAR : FREE, wide);
    this.#row = new Row(stage, model, agents, this.#gap);
    stage.scenery.setLevel(model.geoms.some(({ kind }) => kind === "plane"));
  }

  /** Width of all agents, m. */
  get width(): number {
    return this.#gap * this.#scene.agents;
  }

  take({ episodes, geoms, bodies }: Frame): void {
    this.#row.take(geoms, bodies);
    for (const [agent, episode] of episodes.entries()) if (this.#episodes?.[agent] !== episode) this.#row.cut(agent);
    this.#episodes = episodes;
    this.#elapsed = 0;
  }

  /** Lays the ground of an agent. */
  lay({ agent, field, heights }: Ground): void {
    const facts = this.#scene.model.fields[field];
    // the first field is the course
    if (!facts || field !== 0) return;
    this.#terrains.get(agent)?.dispose();
    const [x, y, z] = facts.pos;
    const shifted = { ...facts, pos: [x, y + shiftOf(agent, this.#scene.agents, this.#gap), z] as const };
    const terrain = new Terrain(shifted, heights, this.#stage.scenery.checker);
    this.#terrains.set(agent, terrain);
    this.#stage.world.add(terrain.mesh);
  }

  frame(dt: number): Vector3 {
    this.#elapsed += dt;
    return this.#row.show(Math.min(this.#elapsed / this.#scene.dt, 1), dt, (x, y) => this.#height(x, y));
  }

  quality(level: Level): void {
    this.#row.quality(level);
  }

  dispose(): void {
    this.#row.dispose();
    for (const terrain of this.#terrains.values()) terrain.dispose();
  }

  #height(x: number, y: number): number {
    const { agents } = this.#scene;
    const agent = Math.min(Math.max(Math.round(y / this.#gap + (agents - 1) / 2), 0), agents - 1);
    return this.#terrains.get(agent)?.height(x, y) ?? 0;
  }
}

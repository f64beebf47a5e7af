/** A model that the page simulates: physics steps in real time, hands and controls. */
import { Vector3 } from "three";
import type { Simulation } from "marathon-rl";
import { Clock } from "../physics/clock";
import { Puppet } from "../scene/puppet";
import type { Level } from "../scene/quality";
import type { Actor, Stage } from "../scene/stage";
import { Terrain } from "../scene/terrain";

/** Time between two forces of the hand, s. */
const PERIOD = 0.01;
/** Most physics steps in this time. A model with a smaller timestep moves in slow motion. */
const MOST_STEPS = 1000;

export class Table implements Actor {
  readonly puppet: Puppet;
  readonly clock: Clock;
  readonly controls: Float64Array;
  readonly #simulation: Simulation;
  readonly #stage: Stage;
  readonly #steps: number;
  readonly #onError: (error: unknown) => void;
  readonly #focus = new Vector3();
  readonly #terrains: Terrain[] = [];
  #blowups = 0;

  constructor(stage: Stage, simulation: Simulation, onError: (error: unknown) => void) {
    this.#stage = stage;
    this.#simulation = simulation;
    this.#onError = onError;
    const { model } = simulation;
    this.#steps = Math.min(Math.max(Math.round(PERIOD / model.timestep), 1), MOST_STEPS);
    const dt = this.#steps * model.timestep;
    this.clock = new Clock(dt);
    this.puppet = new Puppet(stage, simulation, dt, false);
    this.controls = Float64Array.from(simulation.ctrl);
    this.#layGround();
    const size = this.#size();
    this.#focus.z = Math.max(this.#focus.z, 0.05);
    stage.follow.set("side", Math.min(Math.max(2.6 * size, 1), 40));
    stage.follow.yaw += 0.3;
    stage.follow.turn(0.3, 0.12);
  }

  frame(dt: number): Vector3 {
    this.clock.run(dt, () => this.step(), this.#onError);
    const center = this.puppet.show(this.clock.share);
    // models stay where they are: only what leaves the picture is followed
    if (center.distanceTo(this.#focus) > 0.5 * this.#stage.follow.distance) this.#focus.lerp(center, 0.05);
    return this.#focus;
  }

  step(): void {
    this.#simulation.ctrl.set(this.controls);
    this.puppet.beforeStep();
    const finite = this.#simulation.step(this.#steps);
    this.puppet.takePoses(!finite);
    if (!finite && ++this.#blowups === 1) {
      this.#onError(new Error("the state became infinite, so that the model is back at its start; a smaller timestep may help"));
    }
  }

  reset(): void {
    this.#simulation.reset();
    this.controls.set(this.#simulation.ctrl);
    this.puppet.takePoses(true);
  }

  quality(level: Level): void {
    this.puppet.setQuality(level);
  }

  dispose(): void {
    this.puppet.dispose();
    for (const terrain of this.#terrains) terrain.dispose();
    this.#simulation.free();
  }

  /** Draws the height fields. */
  #layGround(): void {
    const { model } = this.#simulation;
    for (const [i, field] of model.fields.entries()) {
      const geom = model.geoms.findIndex(({ field: own }) => own === i);
      if (geom < 0) continue;
      const terrain = new Terrain(field, this.#simulation.ground(i), this.#stage.scenery.checker);
      // it may be turned
      terrain.mesh.matrixAutoUpdate = false;
      terrain.mesh.matrix.fromArray(this.#simulation.poses(), 16 * geom);
      this.#terrains.push(terrain);
      this.#stage.world.add(terrain.mesh);
    }
    const [first] = this.#terrains;
    if (!first) return;
    this.#stage.scenery.setLevel(model.geoms.some(({ kind }) => kind === "plane"));
    this.puppet.ground = (x, y) => first.height(x, y);
  }

  /** Finds the middle of what moves, and returns how far it reaches, m. */
  #size(): number {
    const { model } = this.#simulation;
    const poses = this.#simulation.poses();
    const [low, high] = [new Vector3(Infinity, Infinity, Infinity), new Vector3(-Infinity, -Infinity, -Infinity)];
    for (const [i, { kind, size, body }] of model.geoms.entries()) {
      if (kind === "plane" || kind === "hfield") continue;
      if (body === 0 && Math.max(...size) > 5) continue;
      const at = new Vector3(poses[16 * i + 12], poses[16 * i + 13], poses[16 * i + 14]);
      const reach = Math.min(Math.max(...size), 5);
      low.min(at.clone().subScalar(reach));
      high.max(at.clone().addScalar(reach));
    }
    if (!Number.isFinite(low.x)) return 1;
    this.#focus.copy(low).add(high).multiplyScalar(0.5);
    return Math.max(high.x - low.x, high.y - low.y, high.z - low.z, 0.2);
  }
}

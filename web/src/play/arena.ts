/** A task that plays in the page: the policy acts, the user steers, pushes and throws. */
import type { Vector3 } from "three";
import type { Env, EnvOptions, Marathon, Vector } from "marathon-rl";
import { type Deflection, REST, isRest } from "../input/controls";
import { Clock } from "../physics/clock";
import { Puppet } from "../scene/puppet";
import type { Level } from "../scene/quality";
import type { Actor, Stage } from "../scene/stage";
import { Terrain } from "../scene/terrain";
import { Aim, Steered } from "./direction";

export interface ArenaOptions {
  readonly agent: string;
  readonly options: EnvOptions;
  readonly distance: number;
  /** Name of the skin, or how it follows from the names of the bodies. */
  readonly skin: string | null | ((bodies: readonly string[]) => string | null);
  /** Reads the devices, once per frame. */
  readonly read: () => Deflection;
  readonly onError: (error: unknown) => void;
}

export class Arena implements Actor {
  readonly env: Env;
  readonly puppet: Puppet;
  readonly clock: Clock;
  readonly steered: Steered | null;
  /** Commands that are buttons: without a unit, from 0 to 1. */
  readonly buttons: readonly string[];
  /** Whether the task's own schedule commands. It does until the user steers. */
  own = true;
  steps = 0;
  readonly #stage: Stage;
  readonly #read: () => Deflection;
  readonly #onError: (error: unknown) => void;
  readonly #aim: Aim | null;
  /** Whether the root moves freely: then the state begins with a position and a quaternion. */
  readonly #free: boolean;
  #terrain: Terrain | null = null;
  #deflection: Deflection = REST;

  constructor(stage: Stage, marathon: Marathon, { agent, options, distance, skin, read, onError }: ArenaOptions) {
    this.#stage = stage;
    this.#read = read;
    this.#onError = onError;
    this.env = marathon.env(agent, { agents: 1, max_episode_steps: 0, ...options });
    const { spec, model } = this.env;
    const source = {
      model,
      poses: () => this.env.poses(),
      bodyPoses: () => this.env.bodyPoses(),
      push: (body: number, force: Vector, torque: Vector) => this.env.push(0, body, force, torque),
    };
    this.puppet = new Puppet(stage, source, spec.dt, true);
    this.clock = new Clock(spec.dt);
    this.steered = Steered.of(spec.command);
    this.#aim = this.steered && new Aim(this.steered);
    this.#free = model.nq === model.nv + 1;
    this.buttons = spec.command.filter(({ unit, low, high }) => unit === "" && low === 0 && high === 1).map(({ name }) => name);
    stage.scenery.setLevel(model.geoms.some(({ kind }) => kind === "plane"));
    this.#layGround();
    stage.follow.set(this.#free ? "chase" : "side", distance, this.#heading());
    stage.canvas.dataset["agent"] = spec.id;
    const name = typeof skin === "function" ? skin(model.bodies.map((body) => body.name)) : skin;
    if (name !== null) void this.puppet.wear(name);
  }

  /** Level velocity of the center of mass, m/s. */
  get speed(): number {
    return Math.hypot(this.puppet.velocity.x, this.puppet.velocity.y);
  }

  /** Whether the user can steer it. */
  get takesCommands(): boolean {
    return this.env.spec.command.length > 0;
  }

  frame(dt: number): Vector3 {
    this.#deflection = this.#read();
    const [yaw, pitch] = this.#deflection.look;
    if (yaw !== 0 || pitch !== 0) this.#stage.follow.turn(yaw * dt, pitch * dt);
    if (!isRest(this.#deflection)) this.own = false;
    this.clock.run(dt, () => this.step(), this.#onError);
    return this.puppet.show(this.clock.share);
  }

  /** Makes a decision. */
  step(): void {
    if (this.takesCommands) this.env.command(0, this.own ? null : this.#command());
    this.puppet.beforeStep();
    const { terminated, truncated } = this.env.step();
    const over = terminated[0] === 1 || truncated[0] === 1;
    this.steps++;
    this.puppet.takePoses(over);
    if (over) this.#begin();
  }

  reset(seed?: number): void {
    this.env.reset(seed);
    this.puppet.takePoses(true);
    this.#begin();
  }

  push(): void {
    this.puppet.pushTrunk(this.#heading());
  }

  quality(level: Level): void {
    this.puppet.setQuality(level);
  }

  dispose(): void {
    this.puppet.dispose();
    this.#terrain?.dispose();
    this.env.free();
  }

  #begin(): void {
    this.#aim?.restart();
    this.#layGround();
  }

  /** Draws the ground of a course, which changes with each episode. */
  #layGround(): void {
    const { model } = this.env;
    const [field] = model.fields;
    if (!field) return;
    this.#terrain?.dispose();
    const terrain = new Terrain(field, this.env.ground(0, 0), this.#stage.scenery.checker);
    this.#terrain = terrain;
    this.#stage.world.add(terrain.mesh);
    this.puppet.ground = (x, y) => terrain.height(x, y);
  }

  /** The direction of the world that the user points to in the picture. */
  #direction(): readonly [number, number] {
    const { yaw } = this.#stage.follow;
    const { right, ahead } = this.#deflection;
    const [cos, sin] = [Math.cos(yaw), Math.sin(yaw)];
    // the camera looks along -(cos, sin); right of that is (-sin, cos)
    return [-ahead * cos - right * sin, -ahead * sin + right * cos];
  }

  #command(): Record<string, number> {
    const { jump, flip, right, ahead } = this.#deflection;
    const [x, y] = this.#direction();
    const values: Record<string, number> = {};
    const [first, second] = this.buttons;
    if (first !== undefined) values[first] = Number(jump);
    if (second !== undefined) values[second] = Number(flip);
    if (this.steered && this.#aim) {
      const { qvel } = this.env.state(0);
      const velocity = [qvel[0] ?? 0, qvel[1] ?? 0] as const;
      return { ...values, ...this.steered.command(this.#aim.decide(x, y, this.#heading(), velocity, this.env.spec.dt)) };
    }
    // a planar figure moves along x; up in the picture is ahead as well
    const range = this.env.spec.command.find(({ unit }) => unit === "m/s");
    if (range) {
      const share = Math.abs(right) >= Math.abs(ahead) ? Math.sign(x) * Math.abs(right) : ahead;
      values[range.name] = share > 0 ? share * range.high : -share * range.low;
    }
    return values;
  }

  /** Angle of the root's forward axis along the ground, rad. */
  #heading(): number {
    if (!this.#free) return 0;
    const { qpos } = this.env.state(0);
    const [w, x, y, z] = [qpos[3] ?? 1, qpos[4] ?? 0, qpos[5] ?? 0, qpos[6] ?? 0];
    return Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
  }
}

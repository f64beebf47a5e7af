import { type Bridge, Handle, joinState, splitState } from "./bridge.js";
import { bytes, count, finite, index, known, numbers, text } from "./check.js";
import { ARRAY, MATRIX } from "./exports.js";
import type { EnvOptions, ModelInfo, Spec, State, Step } from "./types.js";

/** A vector of three numbers. */
export type Vector = readonly [number, number, number];

const NONE: Vector = [0, 0, 0];
/** Most agents: those of the largest tasks then fit into the memory of a module. */
const MOST_AGENTS = 100_000;
const OPTIONS = ["agents", "seed", "options", "autoreset", "max_episode_steps", "model", "policy", "clip"] as const satisfies (keyof EnvOptions)[];

/** Agents of one task, stepped together. */
export class Env extends Handle {
  readonly spec: Spec;
  readonly model: ModelInfo;
  /** Number of agents. */
  readonly agents: number;
  #hasPolicy: boolean;

  /** @internal Use `Marathon.env`. */
  static create(bridge: Bridge, agent: string, options: EnvOptions): Env {
    known("the options", options, OPTIONS);
    const { policy, clip, ...fields } = options;
    if (fields.agents !== undefined) count("agents", fields.agents, 1, MOST_AGENTS);
    if (fields.seed !== undefined) count("seed", fields.seed, 0, Number.MAX_SAFE_INTEGER);
    if (fields.max_episode_steps !== undefined) count("max_episode_steps", fields.max_episode_steps);
    const files: Record<string, Uint8Array> = {};
    if (policy !== undefined) files["policy"] = bytes("policy", policy);
    if (clip !== undefined) files["clip"] = bytes("clip", clip);
    const object = bridge.call((exports) => exports.env_new(), { agent: text("the task", agent), ...fields }, files);
    return new Env(bridge, object, policy !== undefined);
  }

  private constructor(bridge: Bridge, object: number, hasPolicy: boolean) {
    super(bridge, object);
    const { spec, model, agents } = bridge.json<{ spec: Spec; model: ModelInfo; agents: number }>();
    this.spec = spec;
    this.model = model;
    this.agents = agents;
    this.#hasPolicy = hasPolicy;
  }

  /** Starts new episodes, from a seed if one is given. Returns the observations. */
  reset(seed?: number): Float32Array {
    if (seed !== undefined) count("seed", seed, 0, Number.MAX_SAFE_INTEGER);
    this.bridge.call((exports) => exports.env_reset(this.object), { seed: seed ?? null });
    return this.#floats(ARRAY.obs, this.spec.obs);
  }

  /** Starts a new episode of one agent. */
  resetAgent(agent: number): void {
    this.#check(agent);
    this.bridge.call((exports) => exports.env_reset_agent(this.object, agent));
  }

  /**
   * Advances all agents by a decision. Without actions the policy decides; without a policy, actions are zero.
   * `actions` is `[agent][act]`, in the units of `spec.action_low`.
   */
  step(actions?: ArrayLike<number>): Step {
    const { act, obs } = this.spec;
    if (actions !== undefined) {
      numbers("actions", actions, this.agents * act);
      this.#floats(ARRAY.actions, act).set(actions);
    } else if (!this.#hasPolicy) {
      this.#floats(ARRAY.actions, act).fill(0);
    }
    const byPolicy = actions === undefined && this.#hasPolicy;
    this.bridge.call((exports) => exports.env_step(this.object, byPolicy ? 1 : 0));
    return {
      obs: this.#floats(ARRAY.obs, obs),
      reward: this.#floats(ARRAY.reward, 1),
      terminated: this.bridge.octets(this.#place(ARRAY.terminated), this.agents),
      truncated: this.bridge.octets(this.#place(ARRAY.truncated), this.agents),
    };
  }

  /** Lets a policy act: the bytes of a `.safetensors` or `.onnx` file. */
  setPolicy(policy: Uint8Array): void {
    this.bridge.call((exports) => exports.env_set_policy(this.object), {}, { policy: bytes("policy", policy) });
    this.#hasPolicy = true;
  }

  /**
   * Sets the command of an agent, which overrides its own schedule. Numbers that are missing are at rest, others are clamped
   * to their ranges. `null` returns to the schedule.
   */
  command(agent: number, values: Readonly<Record<string, number>> | null): void {
    this.#check(agent);
    for (const [name, value] of Object.entries(values ?? {})) finite(name, value);
    this.bridge.call((exports) => exports.env_command(this.object, agent), { values });
  }

  /** Pushes a body until changed or until the next episode: force, N, and torque, N m, in world axes at its center of mass. */
  push(agent: number, body: number, force: Vector, torque: Vector = NONE): void {
    this.#check(agent);
    index("body", body, this.model.bodies.length);
    numbers("force", force, 3);
    numbers("torque", torque, 3);
    this.bridge.call((exports) => exports.env_push(this.object, agent, body, ...force, ...torque));
  }

  /** Matrices of the geoms, `[geom][agent][16]`: four columns, m, z up. The view is valid until the next call. */
  poses(): Float32Array {
    return this.#floats(ARRAY.geoms, this.model.geoms.length * MATRIX);
  }

  /** Matrices of the bodies, `[body][agent][16]`. The view is valid until the next call. */
  bodyPoses(): Float32Array {
    return this.#floats(ARRAY.bodies, this.model.bodies.length * MATRIX);
  }

  /** Infos about the states, `[agent][spec.info]`. The view is valid until the next call. */
  info(): Float32Array {
    return this.#floats(ARRAY.info, this.spec.info.length);
  }

  /** State of an agent. */
  state(agent: number): State {
    this.#check(agent);
    this.bridge.call((exports) => exports.env_state(this.object, agent));
    return splitState(this.bridge.bytes(), this.spec.nq);
  }

  /** Sets the state of an agent, as if an episode began there. */
  setState(agent: number, qpos: ArrayLike<number>, qvel: ArrayLike<number>): void {
    this.#check(agent);
    numbers("qpos", qpos, this.spec.nq);
    numbers("qvel", qvel, this.spec.nv);
    this.bridge.call((exports) => exports.env_set_state(this.object, agent), {}, { state: joinState(qpos, qvel) });
  }

  /** Heights of a height field of an agent, m, `[row][column]`. */
  ground(agent: number, field: number): Float32Array {
    this.#check(agent);
    index("field", field, this.model.fields.length);
    this.bridge.call((exports) => exports.env_ground(this.object, agent, field));
    return new Float32Array(this.bridge.bytes().buffer);
  }

  /** Sets the heights of a height field of an agent. */
  setGround(agent: number, field: number, elevations: ArrayLike<number>): void {
    this.#check(agent);
    index("field", field, this.model.fields.length);
    const { rows, cols } = this.model.fields[field] ?? { rows: 0, cols: 0 };
    numbers("heights", elevations, rows * cols);
    const heights = new Uint8Array(Float32Array.from(elevations).buffer);
    this.bridge.call((exports) => exports.env_set_ground(this.object, agent, field), {}, { heights });
  }

  /** The complete state of all agents. */
  snapshot(): Uint8Array {
    this.bridge.call((exports) => exports.env_save(this.object));
    return this.bridge.bytes();
  }

  /** Restores a snapshot: the future is then what it was when the snapshot was taken. */
  restore(snapshot: Uint8Array): void {
    this.bridge.call((exports) => exports.env_load(this.object), {}, { snapshot: bytes("snapshot", snapshot) });
  }

  /** 16 hexadecimal digits over the bits of all states. They are the same in all browsers and in the native program. */
  hash(): string {
    this.bridge.call((exports) => exports.env_hash(this.object));
    return this.bridge.text();
  }

  #check(agent: number): void {
    index("agent", agent, this.agents);
  }

  #place(which: number): number {
    return this.bridge.place((exports) => exports.env_array(this.object, which));
  }

  #floats(which: number, width: number): Float32Array {
    return this.bridge.floats(this.#place(which), this.agents * width);
  }
}

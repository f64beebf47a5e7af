/**
 * Marathon in the browser and in Node: agents and tasks, policies, training, single models and motion clips. The physics is
 * MuJoCo's; states have the bits of the native program.
 *
 * @module
 */
import type { Bridge } from "./bridge.js";
import { bytes } from "./check.js";
import { Clip } from "./clip.js";
import { Env } from "./env.js";
import { type Lanes, type LoadOptions, instantiate } from "./load.js";
import { Simulation } from "./simulation.js";
import { Trainer } from "./trainer.js";
import type { Config, EnvOptions, PolicyInfo } from "./types.js";

export { Clip } from "./clip.js";
export { Env, type Vector } from "./env.js";
export { MarathonError } from "./error.js";
export type { Lanes, LoadOptions, Parts } from "./load.js";
export { Simulation } from "./simulation.js";
export { Trainer } from "./trainer.js";
export type * from "./types.js";

/** Loads the module. A worker loads its own instance: pass it `Marathon.module`, so that it need not compile again. */
export async function load(options: LoadOptions = {}): Promise<Marathon> {
  const { bridge, lanes, module } = await instantiate(options);
  return new Marathon(bridge, lanes, module);
}

/** An instance of the module. It has one thread. */
export class Marathon {
  readonly lanes: Lanes;
  readonly module: WebAssembly.Module;
  readonly #bridge: Bridge;

  /** @internal Use `load`. */
  constructor(bridge: Bridge, lanes: Lanes, module: WebAssembly.Module) {
    this.#bridge = bridge;
    this.lanes = lanes;
    this.module = module;
  }

  /** Bytes of the instance's memory. It grows and never shrinks. */
  get memoryBytes(): number {
    return this.#bridge.exports.memory.buffer.byteLength;
  }

  /** Names of all tasks. */
  agents(): string[] {
    this.#bridge.call((exports) => exports.agents());
    return this.#bridge.json<string[]>();
  }

  /** Creates an environment of a task. */
  env(agent: string, options: EnvOptions = {}): Env {
    return Env.create(this.#bridge, agent, options);
  }

  /**
   * Simulates any MJCF. `files` are the files that it names, by their paths as written in it; an error has the names of those
   * that are missing. `name` stands for the model in messages.
   */
  simulation(xml: string, files: Readonly<Record<string, Uint8Array>> = {}, name?: string): Simulation {
    return Simulation.create(this.#bridge, xml, files, name);
  }

  /** Creates a run in training; modules for play have none. `config` has the keys of a configuration file; others come from the preset of the task. */
  trainer(agent: string, config: Config = {}): Trainer {
    return Trainer.create(this.#bridge, agent, config);
  }

  /** Reads the description in a policy file. */
  policyInfo(policy: Uint8Array): PolicyInfo {
    this.#bridge.call((exports) => exports.policy_info(), {}, { policy: bytes("policy", policy) });
    return this.#bridge.json<PolicyInfo>();
  }

  /**
   * Makes a motion clip of a recording (`.bvh`, `.glb`, `.gltf`, `.vrm`, `.vrma`) or reads one (`.motion`). `character` is an
   * agent with a mapping: `MarathonMan`, `Humanoid-v0` or `Walker2d-v0`. `files` are files beside a `.gltf`.
   */
  importMotion(
    character: string,
    name: string,
    recording: Uint8Array,
    files: Readonly<Record<string, Uint8Array>> = {},
  ): Clip {
    return Clip.create(this.#bridge, character, name, recording, files);
  }
}

import { type Bridge, Handle } from "./bridge.js";
import { text } from "./check.js";
import { MarathonError } from "./error.js";
import type { Config, Iteration } from "./types.js";

/** A run in training. It has the bits of `marathon train` with the same settings. */
export class Trainer extends Handle {
  /** The configuration, with the values of all keys. */
  readonly config: Config;
  #done = false;

  /** @internal Use `Marathon.trainer`. */
  static create(bridge: Bridge, agent: string, config: Config): Trainer {
    if (!("training_new" in bridge.exports)) {
      throw new MarathonError('this module is for play and has no training; load it with parts: "all"');
    }
    const object = bridge.call((exports) => exports.training_new(), { agent: text("the task", agent), config });
    return new Trainer(bridge, object);
  }

  private constructor(bridge: Bridge, object: number) {
    super(bridge, object);
    this.config = bridge.json<Config>();
  }

  /** Whether all steps have been made. */
  get done(): boolean {
    return this.#done;
  }

  /** Collects experience and learns from it once. */
  iterate(): Iteration {
    this.#done = this.bridge.call((exports) => exports.training_iterate(this.object)) === 1;
    return this.bridge.json<Iteration>();
  }

  /** The policy as it is now: the bytes of a `.safetensors` file. */
  policy(): Uint8Array {
    this.bridge.call((exports) => exports.training_policy(this.object));
    return this.bridge.bytes();
  }
}

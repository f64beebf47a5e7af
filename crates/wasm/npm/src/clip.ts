import { type Bridge, Handle } from "./bridge.js";
import { bytes, files as checked, finite, text } from "./check.js";
import { ARRAY, MATRIX } from "./exports.js";
import type { ClipInfo, ModelInfo } from "./types.js";

/** A motion clip of a character. */
export class Clip extends Handle {
  readonly info: ClipInfo;
  /** The character. */
  readonly model: ModelInfo;
  /** Warnings about the motion, one sentence each. */
  readonly warnings: readonly string[];

  /** @internal Use `Marathon.importMotion`. */
  static create(
    bridge: Bridge,
    character: string,
    name: string,
    recording: Uint8Array,
    files: Readonly<Record<string, Uint8Array>>,
  ): Clip {
    const request = { character: text("character", character), name: text("name", name) };
    const all = { ...checked("files", files), recording: bytes("recording", recording) };
    const object = bridge.call((exports) => exports.clip_new(), request, all);
    return new Clip(bridge, object);
  }

  private constructor(bridge: Bridge, object: number) {
    super(bridge, object);
    const { info, model, warnings } = bridge.json<{ info: ClipInfo; model: ModelInfo; warnings: string[] }>();
    this.info = info;
    this.model = model;
    this.warnings = warnings;
  }

  /** Matrices of the character's geoms at a time, s, `[geom][16]`. The view is valid until the next call. */
  poses(time: number): Float32Array {
    return this.#floats(ARRAY.geoms, time, this.model.geoms.length);
  }

  /** Matrices of the character's bodies at a time, s, `[body][16]`. The view is valid until the next call. */
  bodyPoses(time: number): Float32Array {
    return this.#floats(ARRAY.bodies, time, this.model.bodies.length);
  }

  /** The bytes of a `.motion` file. */
  bytes(): Uint8Array {
    this.bridge.call((exports) => exports.clip_bytes(this.object));
    return this.bridge.bytes();
  }

  #floats(which: number, time: number, count: number): Float32Array {
    finite("time", time);
    const place = this.bridge.place((exports) => exports.clip_array(this.object, which, time));
    return this.bridge.floats(place, count * MATRIX);
  }
}

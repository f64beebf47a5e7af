/** Poses between decisions. */

/** Keeps the matrices of the last two decisions, and mixes them. */
export class PoseTrack {
  #before: Float32Array;
  #after: Float32Array;
  /** The mixed matrices. */
  readonly now: Float32Array<ArrayBuffer>;

  constructor(length: number) {
    this.#before = new Float32Array(length);
    this.#after = new Float32Array(length);
    this.now = new Float32Array(length);
  }

  /** Takes in the poses of a decision. They are copied: a view of the module's memory lasts until its next call. */
  push(poses: Float32Array): void {
    [this.#before, this.#after] = [this.#after, this.#before];
    this.#after.set(poses);
  }

  /** There is nothing before the last poses, such as after the start of an episode. `from` and `to` limit it to a part. */
  cut(from = 0, to = this.#after.length): void {
    this.#before.set(this.#after.subarray(from, to), from);
  }

  /**
   * Mixes at a share of the way, 0 to 1. Numbers of matrices are mixed one by one: a body turns so little in a decision that it
   * shrinks by less than a pixel.
   */
  mix(share: number): Float32Array<ArrayBuffer> {
    const [before, after, now] = [this.#before, this.#after, this.now];
    for (let i = 0; i < now.length; i++) {
      const a = before[i] ?? 0;
      now[i] = a + ((after[i] ?? 0) - a) * share;
    }
    return now;
  }
}

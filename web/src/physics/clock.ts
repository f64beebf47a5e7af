/** Real time in steps of a fixed length. */

/** Most steps that a frame catches up with. The rest of the time is dropped: a slow device runs in slow motion. */
const MOST = 4;

export class Clock {
  readonly dt: number;
  /** Speed of time: 1 is real time. */
  speed = 1;
  paused = false;
  #left = 0;
  #single = false;
  #failed = false;

  constructor(dt: number) {
    this.dt = dt;
  }

  /** Number of steps for a frame that took `seconds`. */
  steps(seconds: number): number {
    if (this.#single) {
      this.#single = false;
      return 1;
    }
    if (this.paused) return 0;
    this.#left += seconds * this.speed;
    const steps = Math.floor(this.#left / this.dt);
    if (steps <= MOST) {
      this.#left -= steps * this.dt;
      return steps;
    }
    this.#left = 0;
    return MOST;
  }

  /** Makes the steps of a frame. After a step that failed, no further ones are made. */
  run(seconds: number, step: () => void, onError: (error: unknown) => void): void {
    if (this.#failed) return;
    try {
      for (let i = this.steps(seconds); i > 0; i--) step();
    } catch (error) {
      this.#failed = true;
      onError(error);
    }
  }

  /** The next frame makes one step, even while time stands still. */
  step(): void {
    this.#single = true;
  }

  /** Share of the next step that has passed, 0 to 1. */
  get share(): number {
    return this.paused ? 1 : Math.min(this.#left / this.dt, 1);
  }
}

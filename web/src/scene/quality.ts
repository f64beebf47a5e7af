/** Quality of the picture: begins with a guess and follows the measured time of frames. */

/**
 * 0: for software rendering, few pixels; 1: soft discs in place of shadows; 2: shadow maps; 3: all pixels of the screen.
 */
export type Level = 0 | 1 | 2 | 3;

/** Largest number of device pixels per CSS pixel. */
const PIXELS: Record<Level, number> = { 0: 0.6, 1: 1, 2: 1.5, 3: 2 };
/** Mean time of a frame beyond which the quality is lowered, and below which it is raised, ms. */
const SLOW = 26;
const FAST = 12;
/** Frames per measurement. */
const FRAMES = 45;
/** Frames longer than this say nothing about the speed, ms: the tab was hidden, or something loaded. */
const INTERRUPTION = 400;

export function pixelRatio(level: Level): number {
  return Math.min(PIXELS[level], level === 0 ? 1 : devicePixelRatio);
}

export class QualityControl {
  level: Level;
  #sum = 0;
  #count = 0;
  /** Levels from here on were too slow. */
  #ceiling = 4;
  /** Measurements in a row that were fast. */
  #fast = 0;

  readonly #fixed: boolean;

  /** A `fixed` level stays, whatever it costs. */
  constructor(software: boolean, fixed: Level | null) {
    this.level = fixed ?? (software ? 0 : 2);
    this.#fixed = fixed !== null;
    if (software) this.#ceiling = 1;
  }

  /** Takes in the time of a frame, ms. Returns whether the level changed. */
  frame(milliseconds: number): boolean {
    if (this.#fixed || milliseconds > INTERRUPTION) return false;
    this.#sum += milliseconds;
    if (++this.#count < FRAMES) return false;
    const mean = this.#sum / this.#count;
    this.#sum = this.#count = 0;
    this.#fast = mean < FAST ? this.#fast + 1 : 0;
    if (mean > SLOW && this.level > 0) {
      this.#ceiling = this.level;
      return this.#set(this.level - 1);
    }
    // screens with 60 frames/s never show a mean below 16 ms: a level that holds them is kept
    if (this.#fast >= 3 && this.level + 1 < this.#ceiling) return this.#set(this.level + 1);
    return false;
  }

  #set(level: number): boolean {
    this.level = Math.min(Math.max(level, 0), 3) as Level;
    this.#fast = 0;
    return true;
  }
}

/** The level of a link, such as `?quality=3`. */
export function fixedLevel(params: URLSearchParams): Level | null {
  const level = [0, 1, 2, 3].find((level) => String(level) === params.get("quality"));
  return level === undefined ? null : (level as Level);
}

/** Whether a processor renders in place of a graphics card. */
export function rendersInSoftware(): boolean {
  const context = document.createElement("canvas").getContext("webgl2");
  if (context === null) throw new Error("this browser has no WebGL 2, which draws the picture");
  const info = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : context.RENDERER));
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

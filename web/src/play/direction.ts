/**
 * Turns a direction of the world into a command: the character turns there by itself. The same rules as `MoveDirection` of the
 * Bevy plugin.
 */
import type { CommandRange } from "marathon-rl";

/** Turn per angle to the direction, 1/s. */
const TURN_GAIN = 3;
/** Part of the character's turn rate that is taken off, against overshoot. */
const TURN_DAMPING = 0.2;
/** Rate at which the aim moves against the angle between direction and velocity, 1/s. Few characters walk exactly where they face. */
const DRIFT_GAIN = 2;
/** Largest shift of the aim, rad. */
const DRIFT_MAX = 0.5;
/** Speed below which the direction of a velocity is noise, m/s. */
const DRIFT_SPEED = 0.5;
/** Cosine of the angle to the direction at which a character stands still while it turns. */
const STOP_COS = -0.5;
/** Share of the speed ahead that a character must reach sideways to go in any direction without turning. */
const SIDEWAYS_SHARE = 0.5;

/** State of the character at a decision. */
export interface Motion {
  /** Angle of its forward axis along the ground, rad. */
  readonly heading: number;
  /** Change of the heading, rad/s. */
  readonly turn: number;
  /** Velocity along the ground, m/s. */
  readonly velocity: readonly [number, number];
}

/** Speed ahead, speed to the left and turn, in m/s and rad/s. */
export interface Course {
  readonly ahead: number;
  readonly left: number;
  readonly turn: number;
}

const REST: Course = { ahead: 0, left: 0, turn: 0 };
const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

/** The same angle within half a turn. */
export function wrapAngle(angle: number): number {
  return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
}

/** The numbers of a command that move a character. */
export class Steered {
  readonly ahead: CommandRange;
  readonly turn: CommandRange;
  /** The range to the left of a character that goes in any direction without turning. */
  readonly sideways: CommandRange | null;

  private constructor(ahead: CommandRange, turn: CommandRange, left: CommandRange | undefined) {
    this.ahead = ahead;
    this.turn = turn;
    const enough = SIDEWAYS_SHARE * ahead.high;
    const any = left !== undefined && ahead.low <= -enough && left.high >= enough && left.low <= -enough;
    this.sideways = any ? left : null;
  }

  /** The first speed, the turn, and the second speed; null for characters that do not turn. */
  static of(ranges: readonly CommandRange[]): Steered | null {
    const [ahead, left] = ranges.filter((range) => range.unit === "m/s");
    const turn = ranges.find((range) => range.unit === "rad/s");
    return ahead && turn ? new Steered(ahead, turn, left) : null;
  }

  /** The numbers of a command. */
  command({ ahead, left, turn }: Course): Record<string, number> {
    const values = { [this.ahead.name]: ahead, [this.turn.name]: turn };
    return this.sideways ? { ...values, [this.sideways.name]: left } : values;
  }
}

/** Where a character aims. */
export class Aim {
  readonly #steered: Steered;
  /** Shift against drift, rad. */
  #shift = 0;
  #last: number | null = null;

  constructor(steered: Steered) {
    this.#steered = steered;
  }

  /** A new episode has begun. */
  restart(): void {
    this.#shift = 0;
    this.#last = null;
  }

  /** The course for a decision. `x` and `y` are a direction of the world, whose length, up to 1, is the share of the largest speed. */
  decide(x: number, y: number, heading: number, velocity: readonly [number, number], dt: number): Course {
    const turn = this.#last === null ? 0 : wrapAngle(heading - this.#last) / dt;
    this.#last = heading;
    const pace = Math.min(Math.hypot(x, y), 1);
    return pace > 1e-3 ? this.course(Math.atan2(y, x), pace, { heading, turn, velocity }, dt) : REST;
  }

  /** The course towards an angle along the ground, rad, at a share of the speed, 0 to 1. */
  course(angle: number, pace: number, { heading, turn, velocity: [x, y] }: Motion, dt: number): Course {
    const { ahead, sideways, turn: range } = this.#steered;
    const error = wrapAngle(angle + this.#shift - heading);
    const straight = sideways !== null || Math.abs(error) < DRIFT_MAX;
    if (straight && Math.hypot(x, y) > DRIFT_SPEED) {
      const drift = wrapAngle(angle - Math.atan2(y, x));
      this.#shift = clamp(this.#shift + DRIFT_GAIN * drift * dt, -DRIFT_MAX, DRIFT_MAX);
    }
    if (sideways) {
      const [sin, cos] = [Math.sin(error), Math.cos(error)];
      const end = ({ low, high }: CommandRange, share: number): number => (share > 0 ? high : -low);
      return { ahead: pace * end(ahead, cos) * cos, left: pace * end(sideways, sin) * sin, turn: 0 };
    }
    const slower = clamp((Math.cos(error) - STOP_COS) / (1 - STOP_COS), 0, 1);
    const wanted = TURN_GAIN * error - TURN_DAMPING * turn;
    return { ahead: pace * ahead.high * slower, left: 0, turn: clamp(wanted, range.low, range.high) };
  }
}

/** A camera that follows a character, with the time constants of the game. z is up. */
import { type PerspectiveCamera, Vector3 } from "three";

/** Half-lives of the point that it looks at, level and upward, s. The upward one is longer: the bounce of a gait must not shake it. */
const PIVOT: readonly [number, number] = [0.06, 0.25];
/** The upward half-life for users who ask for little motion, s. */
const CALM = 1;
/** Half-life of turns, s. */
const TURN = 0.04;
/** Half-life of the target's velocity, s. */
const VELOCITY = 0.3;
/** Largest rate at which it gets behind its target, rad/s. It is that at a right angle. */
const DRIFT = Math.PI / 4;
/** Speeds between which the drift grows from nothing, m/s. */
const DRIFT_FROM: readonly [number, number] = [1, 1.4];
/** Seconds without a turn by the user until it drifts. */
const DRIFT_PAUSE = 1.5;
/** Distance in one frame beyond which it jumps, m. */
const CUT = 2.5;
/** Lowest and highest angle above the ground, rad. */
const PITCH: readonly [number, number] = [-0.12, 1.35];
const DISTANCE: readonly [number, number] = [0.8, 60];
/** Lowest height of the camera, m. */
const LOWEST = 0.12;

export type Angle = "side" | "chase" | "orbit";

/** Share of a way that is done after some time. */
const done = (halfLife: number, dt: number): number => 1 - Math.exp((-Math.LN2 * dt) / halfLife);
const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

export class FollowCamera {
  readonly focus = new Vector3(0, 0, 0.9);
  /** Direction from the focus to the camera: angle about the vertical and above the ground, rad; distance, m. */
  yaw = -Math.PI / 2 + 0.42;
  pitch = 0.2;
  distance = 5;
  angle: Angle = "side";
  /** Whether it never turns by itself, and hardly moves up and down. */
  calm = false;
  readonly #goal = { yaw: this.yaw, pitch: this.pitch, distance: this.distance };
  readonly #velocity = new Vector3();
  #last: Vector3 | null = null;
  #pause = 0;

  /** Looks from an angle at a distance, at once. */
  set(angle: Angle, distance: number, heading = 0): void {
    this.angle = angle;
    this.yaw = this.#goal.yaw = angle === "side" ? -Math.PI / 2 + 0.42 : heading + Math.PI;
    this.pitch = this.#goal.pitch = angle === "side" ? 0.16 : 0.27;
    this.distance = this.#goal.distance = distance;
    this.#pause = 0;
    this.cut();
  }

  next(): Angle {
    const order: readonly Angle[] = ["side", "chase", "orbit"];
    this.angle = order[(order.indexOf(this.angle) + 1) % order.length] ?? "side";
    if (this.angle === "side") this.#goal.yaw = -Math.PI / 2 + 0.42;
    this.#pause = 0;
    return this.angle;
  }

  /** The next frame jumps to the target. */
  cut(): void {
    this.#last = null;
  }

  /** A turn by the user, rad. */
  turn(yaw: number, pitch: number): void {
    this.#goal.yaw += yaw;
    this.#goal.pitch = clamp(this.#goal.pitch + pitch, ...PITCH);
    this.#pause = DRIFT_PAUSE;
  }

  zoom(factor: number): void {
    this.#goal.distance = clamp(this.#goal.distance * factor, ...DISTANCE);
  }

  /** Moves for a frame. `target` is the point to look at. */
  update(camera: PerspectiveCamera, target: Vector3, dt: number): void {
    if (this.#last === null || this.#last.distanceTo(target) > CUT) {
      this.focus.copy(target);
      this.#velocity.set(0, 0, 0);
      this.#last = target.clone();
    } else if (dt > 0) {
      const velocity = target.clone().sub(this.#last).divideScalar(dt).setZ(0);
      this.#velocity.lerp(velocity, done(VELOCITY, dt));
      const [level, up] = [done(PIVOT[0], dt), done(this.calm ? CALM : PIVOT[1], dt)];
      this.focus.x += (target.x - this.focus.x) * level;
      this.focus.y += (target.y - this.focus.y) * level;
      this.focus.z += (target.z - this.focus.z) * up;
      this.#last.copy(target);
    }
    this.#drift(dt);
    const share = this.calm ? 1 : done(TURN, dt);
    this.yaw += (this.#goal.yaw - this.yaw) * share;
    this.pitch += (this.#goal.pitch - this.pitch) * share;
    this.distance += (this.#goal.distance - this.distance) * share;
    this.#place(camera);
  }

  #drift(dt: number): void {
    this.#pause = Math.max(this.#pause - dt, 0);
    if (this.#pause > 0 || this.calm) return;
    if (this.angle === "orbit") this.#goal.yaw += 0.25 * dt;
    if (this.angle !== "chase") return;
    const behind = Math.atan2(-this.#velocity.y, -this.#velocity.x);
    const moves = clamp((this.#velocity.length() - DRIFT_FROM[0]) / (DRIFT_FROM[1] - DRIFT_FROM[0]), 0, 1);
    this.#goal.yaw += DRIFT * moves * Math.sin(behind - this.#goal.yaw) * dt;
  }

  #place(camera: PerspectiveCamera): void {
    const level = Math.cos(this.pitch) * this.distance;
    camera.position.set(
      this.focus.x + level * Math.cos(this.yaw),
      this.focus.y + level * Math.sin(this.yaw),
      Math.max(this.focus.z + Math.sin(this.pitch) * this.distance, LOWEST),
    );
    camera.up.set(0, 0, 1);
    camera.lookAt(this.focus);
  }
}

/** A spring with a damper that pulls a point of a body to a goal. Its force is limited. The same rules as in the game. */
import { Matrix4, Vector3 } from "three";

/** Largest force, as a factor of the figure's weight: enough to lift it by a hand. */
const MOST = 1.6;
/** Length of the spring at which it has the largest force, m. */
const REACH = 0.35;
/** Damping as a share of the critical one of the whole figure. */
const DAMPING = 0.5;
/** Shares of the stiffest spring and damper that stay stable when a force holds for a whole decision. */
const STABLE: readonly [number, number] = [0.15, 0.35];
const GRAVITY = 9.81;

export class Spring {
  readonly body: number;
  readonly goal: Vector3;
  readonly held = new Vector3();
  readonly #grip: Vector3;
  readonly #matrix = new Matrix4();
  #before: Vector3 | null = null;

  /** Takes hold of a body at a point. `bodies` are its matrices, `[body][1][16]`. */
  constructor(body: number, at: Vector3, bodies: Float32Array) {
    this.body = body;
    this.goal = at.clone();
    this.#grip = at.clone().applyMatrix4(this.#matrix.fromArray(bodies, 16 * body).invert());
    this.locate(bodies);
  }

  /** Where the held point is. */
  locate(bodies: Float32Array): Vector3 {
    return this.held.copy(this.#grip).applyMatrix4(this.#matrix.fromArray(bodies, 16 * this.body));
  }

  /** The force for the next decision, N. `limb` and `whole` are masses, kg. */
  force(bodies: Float32Array, dt: number, limb: number, whole: number): Vector3 {
    const at = this.locate(bodies).clone();
    const velocity = this.#before ? at.clone().sub(this.#before).divideScalar(dt) : new Vector3();
    this.#before = at;
    const most = MOST * GRAVITY * whole;
    const stiffness = Math.min(most / REACH, (STABLE[0] * limb) / (dt * dt));
    const damping = Math.min(2 * DAMPING * Math.sqrt(stiffness * whole), (STABLE[1] * limb) / dt);
    const force = this.goal.clone().sub(at).multiplyScalar(stiffness).addScaledVector(velocity, -damping);
    return force.clampLength(0, most);
  }
}

/** Forces on bodies, from hands, balls and pushes. They are added up and last until the next decision. */
import { Vector3 } from "three";
import type { Geom, ModelInfo, Vector } from "marathon-rl";

type Push = (body: number, force: Vector, torque: Vector) => void;

interface Sum {
  readonly force: Vector3;
  readonly torque: Vector3;
}

export class Forces {
  readonly #geoms: readonly (readonly { readonly index: number; readonly volume: number }[])[];
  readonly #push: Push;
  readonly #sums = new Map<number, Sum>();
  #pushed = new Set<number>();

  constructor(model: ModelInfo, push: Push) {
    this.#push = push;
    this.#geoms = model.bodies.map((_, body) =>
      model.geoms.flatMap((geom, index) => (geom.body === body ? [{ index, volume: volumeOf(geom) }] : [])),
    );
  }

  /** A force at a point, N and m in the world. `poses` are matrices of geoms, `[geom][1][16]`. */
  add(body: number, force: Vector3, at: Vector3 | null, poses: Float32Array): void {
    let sum = this.#sums.get(body);
    if (!sum) {
      sum = { force: new Vector3(), torque: new Vector3() };
      this.#sums.set(body, sum);
    }
    sum.force.add(force);
    if (at) sum.torque.add(at.clone().sub(this.#center(body, poses)).cross(force));
  }

  /** Hands the sums to the physics, before a decision. */
  apply(): void {
    for (const body of this.#pushed) if (!this.#sums.has(body)) this.#push(body, [0, 0, 0], [0, 0, 0]);
    this.#pushed = new Set(this.#sums.keys());
    for (const [body, { force, torque }] of this.#sums) {
      this.#push(body, [force.x, force.y, force.z], [torque.x, torque.y, torque.z]);
    }
    this.#sums.clear();
  }

  /** A new episode has begun without forces. */
  forget(): void {
    this.#sums.clear();
    this.#pushed.clear();
  }

  /** The center of a body's geoms, which stands for its center of mass. */
  #center(body: number, poses: Float32Array): Vector3 {
    const center = new Vector3();
    let total = 0;
    for (const { index, volume } of this.#geoms[body] ?? []) {
      const at = new Vector3(poses[16 * index + 12], poses[16 * index + 13], poses[16 * index + 14]);
      center.addScaledVector(at, volume);
      total += volume;
    }
    return total > 0 ? center.divideScalar(total) : center;
  }
}

/** Volume of a geom up to a common factor. */
function volumeOf({ kind, size: [x, y, z] }: Geom): number {
  switch (kind) {
    case "sphere":
      return (4 / 3) * x ** 3;
    case "capsule":
      return (4 / 3) * x ** 3 + 2 * x * x * y;
    case "cylinder":
      return 2 * x * x * y;
    case "ellipsoid":
      return (4 / 3) * x * y * z;
    case "box":
    case "mesh":
      return (8 / Math.PI) * x * y * z;
    case "plane":
    case "hfield":
      return 0;
  }
}

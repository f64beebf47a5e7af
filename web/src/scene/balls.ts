/** Thrown balls. They fly in the page, bounce off the ground and off figures, and figures feel them. */
import { Color, Group, Mesh, MeshLambertMaterial, SphereGeometry, SRGBColorSpace, Vector3 } from "three";
import { type Rod, nearestOn } from "./rods";
import type { Height } from "./blobs";

const RADIUS = 0.11;
/** Mass, kg. */
const MASS = 1.5;
/** Speed relative to the target, m/s. */
const SPEED = 11;
/** Seconds that a ball exists. */
const LIFE = 6;
/** Share of the speed that is left after a bounce. */
const BOUNCE = 0.55;
const GRAVITY = 9.81;
/** Steps of a ball per decision: it must not pass through an arm. */
const STEPS = 8;

interface Ball {
  readonly mesh: Mesh;
  readonly velocity: Vector3;
  left: number;
}

/** A hit: what a ball gives to a body, N s, and where. */
export interface Hit {
  readonly body: number;
  readonly impulse: Vector3;
  readonly at: Vector3;
}

export class Balls {
  readonly group = new Group();
  readonly #balls: Ball[] = [];
  readonly #shape = new SphereGeometry(RADIUS, 20, 14);
  readonly #material = new MeshLambertMaterial({ color: new Color().setRGB(0.86, 0.12, 0.16, SRGBColorSpace) });

  get count(): number {
    return this.#balls.length;
  }

  /** Throws a ball at a target that moves. */
  throw(from: Vector3, target: Vector3, moving: Vector3): void {
    const seconds = Math.max(from.distanceTo(target) / SPEED, 1e-3);
    const velocity = target.clone().sub(from).divideScalar(seconds).add(moving);
    // aim higher from afar, so that it does not fall short
    velocity.z += 0.5 * GRAVITY * seconds;
    const mesh = new Mesh(this.#shape, this.#material);
    mesh.castShadow = true;
    mesh.position.copy(from);
    this.#balls.push({ mesh, velocity, left: LIFE });
    this.group.add(mesh);
  }

  /** Flies for a decision, and returns what was hit. `mass` is that of the whole figure. */
  step(dt: number, rods: readonly Rod[], poses: Float32Array, moving: Vector3, mass: (body: number) => number, ground: Height): Hit[] {
    const hits: Hit[] = [];
    for (const ball of [...this.#balls]) {
      ball.left -= dt;
      if (ball.left <= 0) {
        this.#remove(ball);
        continue;
      }
      for (let i = 0; i < STEPS; i++) this.#advance(ball, dt / STEPS, rods, poses, moving, mass, ground, hits);
    }
    return hits;
  }

  clear(): void {
    for (const ball of [...this.#balls]) this.#remove(ball);
  }

  dispose(): void {
    this.clear();
    this.#shape.dispose();
    this.#material.dispose();
  }

  #advance(
    { mesh: { position }, velocity }: Ball,
    dt: number,
    rods: readonly Rod[],
    poses: Float32Array,
    moving: Vector3,
    mass: (body: number) => number,
    ground: Height,
    hits: Hit[],
  ): void {
    velocity.z -= GRAVITY * dt;
    position.addScaledVector(velocity, dt);
    const floor = ground(position.x, position.y) + RADIUS;
    if (position.z < floor && velocity.z < 0) {
      position.z = floor;
      velocity.z *= -BOUNCE;
      velocity.x *= 0.96;
      velocity.y *= 0.96;
    }
    const near = new Vector3();
    for (const rod of rods) {
      const normal = position.clone().sub(nearestOn(rod, poses, position, near));
      const depth = rod.radius + RADIUS - normal.length();
      if (depth <= 0 || normal.lengthSq() === 0) continue;
      normal.normalize();
      position.addScaledVector(normal, depth);
      // a limb moves about as the whole figure does
      const closing = velocity.clone().sub(moving).dot(normal);
      if (closing >= 0) continue;
      const impulse = (-(1 + BOUNCE) * closing) / (1 / MASS + 1 / mass(rod.body));
      velocity.addScaledVector(normal, impulse / MASS);
      hits.push({ body: rod.body, impulse: normal.clone().multiplyScalar(-impulse), at: near.clone().addScaledVector(normal, rod.radius) });
      break;
    }
  }

  #remove(ball: Ball): void {
    this.#balls.splice(this.#balls.indexOf(ball), 1);
    ball.mesh.removeFromParent();
  }
}

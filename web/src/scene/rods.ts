/** The shapes of figures as rods with a radius, which a ray or a ball meets. A sphere is a rod too. */
import { type Ray, Vector3 } from "three";
import type { Geom, ModelInfo } from "marathon-rl";

export interface Rod {
  readonly body: number;
  readonly geom: number;
  /** Half the length of its axis, m. */
  readonly half: number;
  readonly radius: number;
}

/** Half the length of a geom's axis, and its radius. */
function rodOf({ kind, size: [x, y, z] }: Geom): readonly [number, number] | null {
  switch (kind) {
    case "sphere":
      return [0, x];
    case "capsule":
    case "cylinder":
      return [y, x];
    case "ellipsoid":
    case "box":
    case "mesh": {
      const radius = Math.max(Math.min(x, y), 0.5 * Math.max(x, y));
      return radius > 0 ? [Math.max(z - radius, 0), radius] : null;
    }
    case "plane":
    case "hfield":
      return null;
  }
}

/** Rods of all geoms that move. */
export function rodsOf(model: ModelInfo): Rod[] {
  return model.geoms.flatMap((geom, index) => {
    const rod = geom.body === 0 ? null : rodOf(geom);
    return rod ? [{ body: geom.body, geom: index, half: rod[0], radius: rod[1] }] : [];
  });
}

/** Center of a rod's geom, in matrices `[geom][1][16]`. */
export function centerOf({ geom }: Rod, poses: Float32Array, to: Vector3): Vector3 {
  return to.set(poses[16 * geom + 12] ?? 0, poses[16 * geom + 13] ?? 0, poses[16 * geom + 14] ?? 0);
}

/** Direction of a rod's axis. */
export function axisOf({ geom }: Rod, poses: Float32Array, to: Vector3): Vector3 {
  return to.set(poses[16 * geom + 8] ?? 0, poses[16 * geom + 9] ?? 0, poses[16 * geom + 10] ?? 0);
}

const [center, axis] = [new Vector3(), new Vector3()];

/** The point of a rod's axis that is nearest to a point. */
export function nearestOn(rod: Rod, poses: Float32Array, point: Vector3, to: Vector3): Vector3 {
  centerOf(rod, poses, center);
  axisOf(rod, poses, axis);
  const along = to.copy(point).sub(center).dot(axis);
  return to.copy(center).addScaledVector(axis, Math.min(Math.max(along, -rod.half), rod.half));
}

export interface Picked {
  readonly rod: Rod;
  readonly at: Vector3;
}

/** The first rod that a ray meets. */
export function pick(rods: readonly Rod[], poses: Float32Array, ray: Ray, slack: number): Picked | null {
  let best: (Picked & { reach: number }) | null = null;
  const [at, point] = [new Vector3(), new Vector3()];
  for (const rod of rods) {
    let reach = 0;
    point.copy(ray.origin);
    // the closest approach of two lines, by turns: they are near each other after a few
    for (let turn = 0; turn < 8; turn++) {
      nearestOn(rod, poses, point, at);
      reach = Math.max(at.clone().sub(ray.origin).dot(ray.direction), 0);
      ray.at(reach, point);
    }
    // a finger is thicker than a ray
    if (point.distanceTo(at) < rod.radius * 1.15 + slack && (best === null || reach < best.reach)) {
      best = { rod, at: ray.at(Math.max(reach - rod.radius, 0), new Vector3()), reach };
    }
  }
  return best;
}

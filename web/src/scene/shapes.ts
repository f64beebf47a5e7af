/** Meshes of geoms. What lies along an axis of a model lies along z, as in MJCF. */
import { BoxGeometry, type BufferGeometry, CapsuleGeometry, CylinderGeometry, SphereGeometry } from "three";
import type { Geom, GeomKind } from "marathon-rl";

const cache = new Map<string, BufferGeometry>();

/** The mesh of a shape, or null for shapes that have none. Figures of the same model share it. */
export function shapeOf(kind: GeomKind, size: Geom["size"]): BufferGeometry | null {
  const key = `${kind} ${size.join(" ")}`;
  let shape = cache.get(key) ?? null;
  if (shape === null) {
    shape = make(kind, size);
    if (shape !== null) cache.set(key, shape);
  }
  return shape;
}

function make(kind: GeomKind, [x, y, z]: Geom["size"]): BufferGeometry | null {
  switch (kind) {
    case "sphere":
      return new SphereGeometry(x, 24, 16);
    case "capsule":
      return new CapsuleGeometry(x, 2 * y, 8, 20).rotateX(Math.PI / 2);
    case "cylinder":
      return new CylinderGeometry(x, x, 2 * y, 28).rotateX(Math.PI / 2);
    case "ellipsoid":
      return new SphereGeometry(1, 24, 16).scale(x, y, z);
    case "box":
      return new BoxGeometry(2 * x, 2 * y, 2 * z);
    case "mesh":
      // its triangles stay in the module: the box around it stands for it
      return x > 0 && y > 0 && z > 0 ? new BoxGeometry(2 * x, 2 * y, 2 * z) : null;
    case "plane":
    case "hfield":
      return null;
  }
}

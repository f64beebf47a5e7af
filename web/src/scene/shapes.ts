/** Meshes of geoms. What lies along an axis of a model lies along z, as in MJCF. */
import { BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, CylinderGeometry, SphereGeometry } from "three";
import type { Geom, GeomKind, MeshData } from "marathon-rl";

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

/** The mesh of triangles, with flat faces. */
export function meshOf({ vertices, faces }: MeshData): BufferGeometry {
  const shared = new BufferGeometry();
  shared.setAttribute("position", new BufferAttribute(vertices, 3));
  shared.setIndex(new BufferAttribute(faces, 1));
  const flat = shared.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
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
      // without its file, the box around it stands for it
      return x > 0 && y > 0 && z > 0 ? new BoxGeometry(2 * x, 2 * y, 2 * z) : null;
    case "plane":
    case "hfield":
      return null;
  }
}

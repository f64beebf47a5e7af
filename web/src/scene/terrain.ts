/** The ground of courses: a height field with the checker, dark at the edges of steps. */
import { BufferAttribute, BufferGeometry, Mesh, MeshLambertMaterial, type Texture } from "three";
import type { Field } from "marathon-rl";

/** Depth of the sides, m. */
const SIDE = 0.5;
/** Bend of the ground at a point from which on it is the edge of a step, m. */
const EDGE = 0.018;
/** Brightness of edges and sides. */
const DARK = 0.42;
/** Meters of the checker's texture. */
const PERIOD = 8;

export class Terrain {
  readonly mesh: Mesh<BufferGeometry, MeshLambertMaterial>;
  readonly #field: Field;
  readonly #heights: Float32Array;

  constructor(field: Field, heights: Float32Array, checker: Texture) {
    this.#field = field;
    this.#heights = heights;
    const material = new MeshLambertMaterial({ map: checker, vertexColors: true, flatShading: true });
    this.mesh = new Mesh(geometryOf(field, heights), material);
    this.mesh.position.set(...field.pos);
    this.mesh.receiveShadow = true;
    this.mesh.frustumCulled = false;
  }

  /** Height at a place, m. */
  height(x: number, y: number): number {
    const { rows, cols, radius, pos } = this.#field;
    const along = (at: number, half: number, n: number): number => Math.min(Math.max(((at + half) / (2 * half)) * (n - 1), 0), n - 1);
    const column = along(x - pos[0], radius[0], cols);
    const row = Math.round(along(y - pos[1], radius[1], rows));
    const first = Math.floor(column);
    const at = (c: number): number => this.#heights[row * cols + Math.min(c, cols - 1)] ?? 0;
    return pos[2] + at(first) + (at(first + 1) - at(first)) * (column - first);
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}

function geometryOf({ rows, cols, radius, pos }: Field, heights: Float32Array): BufferGeometry {
  const [positions, uvs, colors, indices]: [number[], number[], number[], number[]] = [[], [], [], []];
  const along = (i: number, n: number, half: number): number => half * ((2 * i) / (Math.max(n, 2) - 1) - 1);
  const add = (row: number, column: number, down: number, shade: number): number => {
    const [x, y] = [along(column, cols, radius[0]), along(row, rows, radius[1])];
    positions.push(x, y, (heights[row * cols + column] ?? 0) - down);
    uvs.push((x + pos[0]) / PERIOD, (y + pos[1] + down) / PERIOD);
    colors.push(shade, shade, shade);
    return positions.length / 3 - 1;
  };
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < cols; column++) add(row, column, 0, shadeOf(heights, row * cols, column, cols));
  }
  for (let row = 1; row < rows; row++) {
    for (let column = 1; column < cols; column++) {
      const [a, b] = [(row - 1) * cols + column - 1, row * cols + column - 1];
      indices.push(a, a + 1, b + 1, a, b + 1, b);
    }
  }
  // the sides show where a narrow track is high
  for (const [row, front] of [[0, true], [rows - 1, false]] as const) {
    for (let column = 1; column < cols; column++) {
      const [a, b] = [add(row, column - 1, 0, DARK), add(row, column, 0, DARK)];
      const [c, d] = [add(row, column - 1, SIDE, DARK), add(row, column, SIDE, DARK)];
      indices.push(...(front ? [a, c, d, a, d, b] : [a, d, c, a, b, d]));
    }
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute("uv", new BufferAttribute(new Float32Array(uvs), 2));
  geometry.setAttribute("color", new BufferAttribute(new Float32Array(colors), 3));
  geometry.setIndex(indices);
  geometry.computeVertexNormals();
  return geometry;
}

function shadeOf(heights: Float32Array, start: number, column: number, cols: number): number {
  const at = (c: number): number => heights[start + Math.min(Math.max(c, 0), cols - 1)] ?? 0;
  const bend = Math.abs(at(column - 1) - 2 * at(column) + at(column + 1));
  return bend >= EDGE ? DARK : 1;
}

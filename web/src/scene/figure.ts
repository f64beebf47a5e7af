/** Figures made of the geoms of a model: one instanced mesh per geom, with an instance for each agent. */
import {
  type BufferGeometry,
  Color,
  Group,
  InstancedMesh,
  type Material,
  MeshLambertMaterial,
  MeshStandardMaterial,
  SRGBColorSpace,
  SphereGeometry,
} from "three";
import type { MeshData, ModelInfo } from "marathon-rl";
import { METAL, type Stuff, TINTS, stuffOf, visibleGeoms } from "./colors";
import type { Level } from "./quality";
import { meshOf, shapeOf } from "./shapes";

interface Part {
  readonly mesh: InstancedMesh;
  readonly stuff: Stuff;
  readonly metal: boolean;
  /** Index of the geom, or of the body for balls at joints. */
  readonly index: number;
}

export interface FigureOptions {
  readonly agents: number;
  /** Balls where bodies are joined, as the game shows them. */
  readonly joints?: boolean;
  /** A color for each agent. */
  readonly tinted?: boolean;
  /** The triangles of a mesh of the model. */
  readonly mesh?: (index: number) => MeshData;
  readonly level: Level;
}

export class Figure {
  readonly group = new Group();
  readonly #parts: Part[] = [];
  readonly #balls: Part[] = [];
  readonly #agents: number;
  /** Meshes of the model's own, which no other figure has. */
  readonly #own: BufferGeometry[] = [];
  /** Shift of each agent, m: x, y. */
  readonly #shifts: Float32Array;

  constructor(model: ModelInfo, { agents, joints, tinted, mesh: data, level }: FigureOptions) {
    this.#agents = agents;
    this.#shifts = new Float32Array(2 * agents);
    for (const index of visibleGeoms(model)) {
      const geom = model.geoms[index];
      const own = geom && geom.mesh !== null && data ? meshOf(data(geom.mesh)) : null;
      if (own) this.#own.push(own);
      const shape = own ?? (geom && shapeOf(geom.kind, geom.size));
      if (!geom || !shape) continue;
      const stuff = stuffOf(model, geom);
      const mesh = new InstancedMesh(shape, materialOf(stuff, false, level, tinted === true), agents);
      if (tinted) {
        for (let agent = 0; agent < agents; agent++) mesh.setColorAt(agent, tintOf(agent, index));
      }
      this.#add(this.#parts, { mesh, stuff, metal: false, index });
    }
    if (joints) this.#addJoints(model, level);
  }

  /** Puts agents side by side. */
  spread(shift: (agent: number) => readonly [number, number]): void {
    for (let agent = 0; agent < this.#agents; agent++) this.#shifts.set(shift(agent), 2 * agent);
  }

  /** Shows matrices of geoms and of bodies, `[geom][agent][16]`. */
  show(geoms: Float32Array, bodies: Float32Array | null): void {
    for (const part of this.#parts) this.#place(part, geoms);
    if (bodies) for (const part of this.#balls) this.#place(part, bodies);
  }

  setQuality(level: Level): void {
    for (const { mesh, stuff, metal } of [...this.#parts, ...this.#balls]) {
      const old = mesh.material as Material;
      mesh.material = materialOf(stuff, metal, level, mesh.instanceColor !== null);
      old.dispose();
    }
  }

  dispose(): void {
    for (const { mesh } of [...this.#parts, ...this.#balls]) {
      (mesh.material as Material).dispose();
      mesh.dispose();
    }
    for (const shape of this.#own) shape.dispose();
    this.group.removeFromParent();
  }

  #add(list: Part[], part: Part): void {
    const { mesh } = part;
    mesh.castShadow = mesh.receiveShadow = part.stuff.alpha >= 1;
    // its bounds move with every decision
    mesh.frustumCulled = false;
    list.push(part);
    this.group.add(mesh);
  }

  #place({ mesh, index }: Part, from: Float32Array): void {
    const to = mesh.instanceMatrix.array;
    const length = 16 * this.#agents;
    to.set(from.subarray(index * length, (index + 1) * length));
    for (let agent = 0; agent < this.#agents; agent++) {
      to[16 * agent + 12] = (to[16 * agent + 12] ?? 0) + (this.#shifts[2 * agent] ?? 0);
      to[16 * agent + 13] = (to[16 * agent + 13] ?? 0) + (this.#shifts[2 * agent + 1] ?? 0);
    }
    mesh.instanceMatrix.needsUpdate = true;
  }

  /** A metal ball at the origin of each body that hangs from another one. */
  #addJoints(model: ModelInfo, level: Level): void {
    const thickness = (body: number): number => {
      const round = model.geoms.filter((geom) => geom.body === body && /^(capsule|sphere|cylinder)$/.test(geom.kind));
      return Math.max(0, ...round.map((geom) => geom.size[0]));
    };
    for (const [index, { parent }] of model.bodies.entries()) {
      const [own, other] = [thickness(index), thickness(parent)];
      if (index === 0 || parent === 0 || own === 0 || other === 0) continue;
      const stuff: Stuff = { color: METAL, roughness: 0.4, alpha: 1 };
      const shape = new SphereGeometry(1.08 * Math.min(own, other), 20, 14);
      const mesh = new InstancedMesh(shape, materialOf(stuff, true, level, false), this.#agents);
      this.#add(this.#balls, { mesh, stuff, metal: true, index });
    }
  }
}

function materialOf({ color, roughness, alpha }: Stuff, metal: boolean, level: Level, tinted: boolean): Material {
  const common = {
    color: tinted ? new Color(1, 1, 1) : new Color().setRGB(...color, SRGBColorSpace),
    transparent: alpha < 1,
    opacity: alpha,
  };
  // without an environment to mirror, metal is black: it is rough instead
  return level < 2
    ? new MeshLambertMaterial(common)
    : new MeshStandardMaterial({ ...common, roughness: metal ? 0.5 : roughness, metalness: metal ? 0.35 : 0 });
}

/** The color of an agent. Parts differ a little, so that limbs can be told apart. */
function tintOf(agent: number, part: number): Color {
  const [r, g, b] = TINTS[agent % TINTS.length] ?? METAL;
  const shade = 1 - 0.1 * (part % 3);
  return new Color().setRGB(r * shade, g * shade, b * shade, SRGBColorSpace);
}

/** Soft dark discs on the ground below the bodies: shadows for pictures without shadow maps. */
import {
  CanvasTexture,
  DynamicDrawUsage,
  InstancedBufferAttribute,
  InstancedMesh,
  Matrix4,
  MeshBasicMaterial,
  PlaneGeometry,
  Vector3,
} from "three";
import type { ModelInfo } from "marathon-rl";
import type { Level } from "./quality";
import { type Rod, axisOf, rodsOf } from "./rods";

/** Darkness below a body that touches the ground. */
const DARKEST = 0.42;
/** Height at which a disc is half as dark, m. */
const HALF_HEIGHT = 0.75;
/** Growth of a disc's radius with the height of its body. */
const SPREAD = 0.25;
/** Distance between a disc and the ground, m. */
const LIFT = 0.012;
/** Radius of a disc relative to its body: its edge is soft. */
const SOFT = 2.4;
/** Most discs of an agent. */
const MOST = 24;

export type Height = (x: number, y: number) => number;

export class Blobs {
  readonly mesh: InstancedMesh;
  readonly #rods: Rod[];
  readonly #agents: number;
  readonly #alpha: InstancedBufferAttribute;
  readonly #shift: (agent: number) => readonly [number, number];

  constructor(model: ModelInfo, agents: number, shift: (agent: number) => readonly [number, number] = () => [0, 0]) {
    this.#rods = rodsOf(model)
      .sort((a, b) => b.half + b.radius - a.half - a.radius)
      .slice(0, MOST);
    this.#agents = agents;
    this.#shift = shift;
    const shape = new PlaneGeometry(2, 2);
    const count = Math.max(this.#rods.length * agents, 1);
    this.#alpha = new InstancedBufferAttribute(new Float32Array(count), 1);
    this.#alpha.setUsage(DynamicDrawUsage);
    shape.setAttribute("shade", this.#alpha);
    const material = new MeshBasicMaterial({ color: 0x0d0d12, map: softDisc(), transparent: true, depthWrite: false });
    // each disc has a darkness of its own
    material.onBeforeCompile = (shader) => {
      shader.vertexShader = `attribute float shade;\nvarying float vShade;\n${shader.vertexShader}`.replace(
        "#include <begin_vertex>",
        "#include <begin_vertex>\nvShade = shade;",
      );
      shader.fragmentShader = `varying float vShade;\n${shader.fragmentShader}`.replace(
        "#include <map_fragment>",
        "#include <map_fragment>\ndiffuseColor.a *= vShade;",
      );
    };
    this.mesh = new InstancedMesh(shape, material, count);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 1;
  }

  /** Hides the discs where there are shadow maps. */
  setQuality(level: Level): void {
    this.mesh.visible = level < 2;
  }

  /** Puts the discs below bodies. `poses` are matrices of geoms, `[geom][agent][16]`. */
  show(poses: Float32Array, height: Height = () => 0): void {
    if (!this.mesh.visible) return;
    const [axis, matrix] = [new Vector3(), new Matrix4()];
    let at = 0;
    for (const rod of this.#rods) {
      for (let agent = 0; agent < this.#agents; agent++, at++) {
        const own = poses.subarray(16 * (rod.geom * this.#agents + agent), 16 * (rod.geom * this.#agents + agent + 1));
        const [x = 0, y = 0, z = 0] = own.subarray(12, 15);
        axisOf({ ...rod, geom: 0 }, own, axis).multiplyScalar(rod.half);
        const ground = height(x, y);
        const gap = Math.max(z - Math.abs(axis.z) - rod.radius - ground, 0);
        const shade = z > ground - rod.radius ? DARKEST / (1 + (gap / HALF_HEIGHT) ** 2) : 0;
        this.#alpha.setX(at, shade);
        const radius = SOFT * rod.radius * Math.min(1 + (SPREAD * gap) / Math.max(rod.radius, 0.05), 4);
        const level = Math.hypot(axis.x, axis.y);
        const [cos, sin] = level > 1e-6 ? [axis.x / level, axis.y / level] : [1, 0];
        const [sx, sy] = this.#shift(agent);
        matrix.set(
          cos * (radius + level), -sin * radius, 0, x + sx,
          sin * (radius + level), cos * radius, 0, y + sy,
          0, 0, 1, ground + LIFT,
          0, 0, 0, 1,
        );
        this.mesh.setMatrixAt(at, matrix);
      }
    }
    this.#alpha.needsUpdate = true;
    this.mesh.instanceMatrix.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    (this.mesh.material as MeshBasicMaterial).dispose();
    this.mesh.dispose();
  }
}

let disc: CanvasTexture | null = null;

/** White, opaque in the middle and clear at the edge. */
function softDisc(): CanvasTexture {
  if (disc) return disc;
  const canvas = document.createElement("canvas");
  canvas.width = canvas.height = 64;
  const context = canvas.getContext("2d");
  if (context) {
    const fade = context.createRadialGradient(32, 32, 0, 32, 32, 32);
    for (let i = 0; i <= 8; i++) {
      const inside = 1 - i / 8;
      fade.addColorStop(i / 8, `rgba(255,255,255,${inside * inside * (3 - 2 * inside)})`);
    }
    context.fillStyle = fade;
    context.fillRect(0, 0, 64, 64);
  }
  disc = new CanvasTexture(canvas);
  return disc;
}

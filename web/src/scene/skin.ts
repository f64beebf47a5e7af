/**
 * Skins: surfaces whose bones are fixed to bodies, by their names or by `extras.body` (skins/make.mjs). The loader of glTF files is
 * large, so it is loaded after the first picture.
 */
import { Bone, Matrix4, Mesh, MeshLambertMaterial, MeshStandardMaterial, Skeleton, SkinnedMesh } from "three";
import type { ModelInfo } from "marathon-rl";
import { pageUrl } from "../app/engine";
import type { Level } from "./quality";

/** From the axes of a glTF file, y up and z ahead, to those of the physics, z up and x ahead. */
const AXES = new Matrix4().set(0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1);

interface Follower {
  readonly bone: Bone;
  /** Index of its body. */
  readonly body: number;
}

export class Skin {
  readonly mesh: SkinnedMesh;
  readonly #followers: readonly Follower[];

  private constructor(mesh: SkinnedMesh, followers: readonly Follower[]) {
    this.mesh = mesh;
    this.#followers = followers;
  }

  /** Loads a skin, or returns null if its bones are not the bodies of the model. */
  static async load(name: string, model: ModelInfo, level: Level): Promise<Skin | null> {
    const { GLTFLoader } = await import("three/examples/jsm/loaders/GLTFLoader.js");
    const { scene } = await new GLTFLoader().loadAsync(pageUrl(`skins/${name}.glb`).href);
    let source: SkinnedMesh | null = null;
    scene.traverse((node) => {
      if ((node as SkinnedMesh).isSkinnedMesh) source = node as SkinnedMesh;
    });
    if (source === null) return null;
    const { skeleton, geometry } = source as SkinnedMesh;
    // bones of its own outside the scene: bodies place them, not their parents
    const bones = skeleton.bones.map(({ name: bone, userData }) => {
      const own = new Bone();
      own.name = String(userData["body"] ?? bone);
      own.matrixWorldAutoUpdate = false;
      return own;
    });
    const followers = bones.map((bone) => ({ bone, body: model.bodies.findIndex(({ name: body }) => body === bone.name) }));
    if (followers.some(({ body }) => body < 0)) return null;
    const mesh = new SkinnedMesh(geometry, materialOf(level));
    mesh.bind(new Skeleton(bones, skeleton.boneInverses), new Matrix4());
    mesh.castShadow = mesh.receiveShadow = true;
    mesh.frustumCulled = false;
    return new Skin(mesh, followers);
  }

  /** Follows matrices of bodies, `[body][1][16]`. Bodies of these models are not turned at rest. */
  show(bodies: Float32Array): void {
    for (const { bone, body } of this.#followers) {
      bone.matrixWorld.fromArray(bodies, 16 * body).multiply(AXES);
    }
  }

  setQuality(level: Level): void {
    (this.mesh.material as MeshStandardMaterial).dispose();
    this.mesh.material = materialOf(level);
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.skeleton.dispose();
    (this.mesh.material as MeshStandardMaterial).dispose();
  }
}

function materialOf(level: Level): Mesh["material"] {
  return level < 2
    ? new MeshLambertMaterial({ vertexColors: true })
    : new MeshStandardMaterial({ vertexColors: true, roughness: 0.7, metalness: 0 });
}

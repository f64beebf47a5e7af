/** One figure that the page simulates: its shapes or skin, the hand that pulls it, the balls that hit it. */
import { BufferGeometry, Line, LineBasicMaterial, type Ray, Vector3 } from "three";
import type { MeshData, ModelInfo, Vector } from "marathon-rl";
import type { Hands } from "../input/pointer";
import { Forces } from "../physics/forces";
import { Spring } from "../physics/spring";
import { Balls } from "./balls";
import { Blobs, type Height } from "./blobs";
import { Figure } from "./figure";
import { PoseTrack } from "./poses";
import type { Level } from "./quality";
import { type Picked, type Rod, pick, rodsOf } from "./rods";
import { Skin } from "./skin";
import type { Stage } from "./stage";

/** The simulation behind a figure. */
export interface Body {
  readonly model: ModelInfo;
  poses(): Float32Array;
  bodyPoses(): Float32Array;
  push(body: number, force: Vector, torque: Vector): void;
  /** The triangles of a mesh. */
  mesh?(index: number): MeshData;
}

/** Change of speed that a push gives the whole figure, m/s, and how long it lasts, s. */
const PUSH_SPEED = 0.6;
const PUSH_SECONDS = 0.1;
/** Mass of a limb for a ball: its own and this share of the rest, kg. */
const REST_SHARE = 0.1;

export class Puppet implements Hands {
  readonly mass: number;
  /** Seconds of a decision. */
  readonly dt: number;
  /** Height of the ground. */
  ground: Height = () => 0;
  /** Center of mass and its velocity. */
  readonly center = new Vector3();
  readonly velocity = new Vector3();
  readonly #body: Body;
  readonly #stage: Stage;
  readonly #figure: Figure;
  readonly #rods: readonly Rod[];
  readonly #forces: Forces;
  readonly #balls = new Balls();
  readonly #geoms: PoseTrack;
  readonly #bodies: PoseTrack;
  readonly #line = new Line(new BufferGeometry().setFromPoints([new Vector3(), new Vector3()]), new LineBasicMaterial({ color: 0xed6b29 }));
  readonly #blobs: Blobs;
  #skin: Skin | null = null;
  #spring: Spring | null = null;
  #pushes: { body: number; force: Vector3; at: Vector3 | null; left: number }[] = [];
  #forwards = false;
  #disposed = false;

  constructor(stage: Stage, body: Body, dt: number, joints: boolean) {
    this.#stage = stage;
    this.#body = body;
    this.dt = dt;
    const { model } = body;
    this.mass = model.bodies.reduce((sum, { mass }) => sum + mass, 0);
    this.#figure = new Figure(model, {
      agents: 1,
      joints,
      level: stage.level,
      ...(body.mesh ? { mesh: (index: number) => body.mesh!(index) } : {}),
    });
    this.#rods = rodsOf(model);
    this.#forces = new Forces(model, (...push) => body.push(...push));
    this.#geoms = new PoseTrack(16 * model.geoms.length);
    this.#bodies = new PoseTrack(16 * model.bodies.length);
    this.#line.visible = false;
    this.#line.frustumCulled = false;
    this.#blobs = new Blobs(model, 1);
    stage.world.add(this.#figure.group, this.#blobs.mesh, this.#balls.group, this.#line);
    this.setQuality(stage.level);
    this.takePoses(true);
    this.show(1);
  }

  /** Puts on a skin when it has loaded. Without one the figure keeps its shapes. */
  async wear(name: string): Promise<void> {
    const skin = await Skin.load(name, this.#body.model, this.#stage.level).catch(() => null);
    if (skin === null) return;
    if (this.#disposed) {
      skin.dispose();
      return;
    }
    this.#skin = skin;
    this.#stage.world.add(skin.mesh);
    skin.show(this.#bodies.now);
    this.#figure.group.visible = false;
  }

  /** Whether the skin is shown, if there is one. */
  set skinned(on: boolean) {
    if (!this.#skin) return;
    this.#skin.mesh.visible = on;
    this.#figure.group.visible = !on;
  }

  get balls(): number {
    return this.#balls.count;
  }

  /** Forces of hands, pushes and balls for the next decision. */
  beforeStep(): void {
    const { model } = this.#body;
    const [geoms, bodies] = [this.#geoms.mix(1), this.#bodies.mix(1)];
    if (this.#spring) {
      const limb = model.bodies[this.#spring.body]?.mass ?? 1;
      const force = this.#spring.force(bodies, this.dt, Math.max(limb, 1e-3), this.mass);
      this.#forces.add(this.#spring.body, force, this.#spring.held, geoms);
    }
    for (const push of this.#pushes) {
      this.#forces.add(push.body, push.force, push.at, geoms);
      push.left -= this.dt;
    }
    this.#pushes = this.#pushes.filter(({ left }) => left > 1e-9);
    if (this.#balls.count > 0) {
      const mass = (body: number): number => {
        const own = model.bodies[body]?.mass ?? 0;
        return Math.max(own + REST_SHARE * (this.mass - own), 1e-3);
      };
      for (const { body, impulse, at } of this.#balls.step(this.dt, this.#rods, geoms, this.velocity, mass, this.ground)) {
        this.#forces.add(body, impulse.divideScalar(this.dt), at, geoms);
      }
    }
    this.#forces.apply();
  }

  /** Takes in the poses after a decision. `cut`: they have nothing to do with the ones before. */
  takePoses(cut: boolean): void {
    this.#geoms.push(this.#body.poses());
    this.#bodies.push(this.#body.bodyPoses());
    if (cut) {
      this.#geoms.cut();
      this.#bodies.cut();
      this.#forces.forget();
      this.#pushes = [];
      this.#balls.clear();
      this.letGo();
    }
    const before = this.center.clone();
    this.#findCenter();
    if (cut) this.velocity.set(0, 0, 0);
    else this.velocity.lerp(this.center.clone().sub(before).divideScalar(this.dt), 0.3);
  }

  /** Shows the figure between the last two decisions. Returns the point to look at. */
  show(share: number): Vector3 {
    const [geoms, bodies] = [this.#geoms.mix(share), this.#bodies.mix(share)];
    this.#figure.show(geoms, bodies);
    this.#skin?.show(bodies);
    this.#blobs.show(geoms, this.ground);
    this.#line.visible = this.#spring !== null;
    if (this.#spring) {
      const position = this.#line.geometry.getAttribute("position");
      for (const [i, { x, y, z }] of [this.#spring.locate(bodies), this.#spring.goal].entries()) position.setXYZ(i, x, y, z);
      position.needsUpdate = true;
    }
    return this.center.clone().addScaledVector(this.velocity, -(1 - share) * this.dt);
  }

  setQuality(level: Level): void {
    this.#figure.setQuality(level);
    this.#skin?.setQuality(level);
    this.#blobs.setQuality(level);
  }

  /** Throws a ball from the camera. */
  throwBall(): void {
    const { camera } = this.#stage;
    camera.updateMatrixWorld();
    const from = new Vector3(0.25, -0.15, -0.4).applyMatrix4(camera.matrixWorld);
    this.#balls.throw(from, this.center, this.velocity);
  }

  /** Pushes the trunk along the ground, forwards and backwards by turns. */
  pushTrunk(heading: number): void {
    this.#forwards = !this.#forwards;
    const way = new Vector3(Math.cos(heading), Math.sin(heading), 0).multiplyScalar(this.#forwards ? 1 : -1);
    this.#pushBody(1, way, null);
  }

  pick(ray: Ray, slack: number): Picked | null {
    return pick(this.#rods, this.#geoms.now, ray, slack);
  }

  grab({ rod, at }: Picked): void {
    this.#spring = new Spring(rod.body, at, this.#bodies.now);
  }

  pull(goal: Vector3): void {
    this.#spring?.goal.copy(goal);
  }

  letGo(): void {
    this.#spring = null;
  }

  push({ rod, at }: Picked, direction: Vector3): void {
    this.#pushBody(rod.body, direction, at);
  }

  dispose(): void {
    this.#disposed = true;
    this.#figure.dispose();
    this.#skin?.dispose();
    this.#blobs.dispose();
    this.#balls.dispose();
    this.#balls.group.removeFromParent();
    this.#line.removeFromParent();
    this.#line.geometry.dispose();
  }

  #pushBody(body: number, way: Vector3, at: Vector3 | null): void {
    const force = way.clone().multiplyScalar((this.mass * PUSH_SPEED) / PUSH_SECONDS);
    this.#pushes.push({ body, force, at, left: PUSH_SECONDS });
  }

  #findCenter(): void {
    const bodies = this.#bodies.mix(1);
    this.center.set(0, 0, 0);
    let total = 0;
    for (const [i, { mass }] of this.#body.model.bodies.entries()) {
      this.center.x += mass * (bodies[16 * i + 12] ?? 0);
      this.center.y += mass * (bodies[16 * i + 13] ?? 0);
      this.center.z += mass * (bodies[16 * i + 14] ?? 0);
      total += mass;
    }
    if (total > 0) this.center.divideScalar(total);
  }
}

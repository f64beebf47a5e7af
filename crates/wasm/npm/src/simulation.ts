import { type Bridge, Handle, joinState, splitState } from "./bridge.js";
import { count, files as checked, index, numbers, text } from "./check.js";
import type { Vector } from "./env.js";
import { ARRAY, MATRIX } from "./exports.js";
import type { MeshData, ModelInfo, State } from "./types.js";

/** A model by itself, without a task. */
export class Simulation extends Handle {
  readonly model: ModelInfo;

  /** @internal Use `Marathon.simulation`. */
  static create(bridge: Bridge, xml: string, files: Readonly<Record<string, Uint8Array>>, name?: string): Simulation {
    const request = { xml: text("the model", xml), name: name ?? null };
    const object = bridge.call((exports) => exports.simulation_new(), request, checked("files", files));
    return new Simulation(bridge, object);
  }

  private constructor(bridge: Bridge, object: number) {
    super(bridge, object);
    this.model = bridge.json<ModelInfo>();
  }

  /** The controls, `[actuator]`. Write to it before a step. The view is valid until the next call. */
  get ctrl(): Float64Array {
    return this.bridge.doubles(this.#place(ARRAY.actions), this.model.actuators.length);
  }

  /** Back to the first keyframe; without keyframes, to the reference configuration. */
  reset(): void {
    this.bridge.call((exports) => exports.simulation_reset(this.object));
  }

  /** Advances by physics steps. Returns false if the state became infinite; the model is then back at its start. */
  step(steps = 1): boolean {
    count("steps", steps);
    const ctrl = this.ctrl;
    numbers("ctrl", ctrl, ctrl.length);
    this.bridge.call((exports) => exports.simulation_step(this.object, steps));
    return this.bridge.bytes().length === 0;
  }

  /** Pushes a body until changed: force, N, and torque, N m, in world axes at its center of mass. */
  push(body: number, force: Vector, torque: Vector = [0, 0, 0]): void {
    index("body", body, this.model.bodies.length);
    numbers("force", force, 3);
    numbers("torque", torque, 3);
    this.bridge.call((exports) => exports.simulation_push(this.object, body, ...force, ...torque));
  }

  /** Matrices of the geoms, `[geom][16]`: four columns, m, z up. The view is valid until the next call. */
  poses(): Float32Array {
    return this.bridge.floats(this.#place(ARRAY.geoms), this.model.geoms.length * MATRIX);
  }

  /** Matrices of the bodies, `[body][16]`. The view is valid until the next call. */
  bodyPoses(): Float32Array {
    return this.bridge.floats(this.#place(ARRAY.bodies), this.model.bodies.length * MATRIX);
  }

  /** The state. */
  state(): State {
    this.bridge.call((exports) => exports.simulation_state(this.object));
    return splitState(this.bridge.bytes(), this.model.nq);
  }

  /** Sets the state. */
  setState(qpos: ArrayLike<number>, qvel: ArrayLike<number>): void {
    numbers("qpos", qpos, this.model.nq);
    numbers("qvel", qvel, this.model.nv);
    this.bridge.call((exports) => exports.simulation_set_state(this.object), {}, { state: joinState(qpos, qvel) });
  }

  /** Heights of a height field, m, `[row][column]`. */
  ground(field: number): Float32Array {
    index("field", field, this.model.fields.length);
    this.bridge.call((exports) => exports.simulation_ground(this.object, field));
    return new Float32Array(this.bridge.bytes().buffer);
  }

  /** A mesh, to draw it. */
  mesh(mesh: number): MeshData {
    index("mesh", mesh, this.model.meshes.length);
    this.bridge.call((exports) => exports.simulation_mesh(this.object, mesh));
    const { buffer } = this.bridge.bytes();
    const points = 3 * (this.model.meshes[mesh]?.vertices ?? 0);
    return { vertices: new Float32Array(buffer, 0, points), faces: new Uint32Array(buffer, 4 * points) };
  }

  /** 16 hexadecimal digits over the bits of the state. They are the same in all browsers and in the native program. */
  hash(): string {
    this.bridge.call((exports) => exports.simulation_hash(this.object));
    return this.bridge.text();
  }

  #place(which: number): number {
    return this.bridge.place((exports) => exports.simulation_array(this.object, which));
  }
}

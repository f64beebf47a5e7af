/** Name and range of a number of the command. */
export interface CommandRange {
  readonly name: string;
  readonly low: number;
  readonly high: number;
  /** Such as `m/s`; empty for a pure number. A button has no unit and the range 0 to 1. */
  readonly unit: string;
}

/** Shape of a geom. Sizes are those of MJCF: half extents, or radius and half length. */
export type GeomKind = "plane" | "hfield" | "sphere" | "capsule" | "ellipsoid" | "cylinder" | "box" | "mesh";

/** A geom of a model. */
export interface Geom {
  readonly name: string;
  readonly kind: GeomKind;
  /** Index of its body; 0 is the world. */
  readonly body: number;
  readonly size: readonly [number, number, number];
  readonly rgba: readonly [number, number, number, number];
  /** Index of its height field, for `hfield`. */
  readonly field: number | null;
  /** Index of its mesh, for `mesh` whose file was given. */
  readonly mesh: number | null;
  /** Group for viewers; by custom, viewers hide 3 and above. */
  readonly group: number;
}

/** A body of a model. */
export interface Body {
  readonly name: string;
  /** Index of its parent. */
  readonly parent: number;
  /** kg */
  readonly mass: number;
}

/** A height field of a model. */
export interface Field {
  readonly rows: number;
  readonly cols: number;
  /** Half extents along x and y, m. */
  readonly radius: readonly [number, number];
  /** Place of its center and of its zero, m. */
  readonly pos: readonly [number, number, number];
}

/** A triangle mesh in the frame of its geoms. */
export interface MeshData {
  /** Points, m, `[vertex][3]`. */
  readonly vertices: Float32Array;
  /** Three points of each triangle, counterclockwise from outside. */
  readonly faces: Uint32Array;
}

/** The parts of a model. */
export interface ModelInfo {
  readonly nq: number;
  readonly nv: number;
  /** Names of the actuators, and the range of each control. */
  readonly actuators: readonly { readonly name: string; readonly low: number; readonly high: number }[];
  readonly bodies: readonly Body[];
  readonly geoms: readonly Geom[];
  readonly fields: readonly Field[];
  /** Numbers of points and triangles of each mesh. */
  readonly meshes: readonly { readonly vertices: number; readonly faces: number }[];
  /** Seconds of a physics step. */
  readonly timestep: number;
}

/** Constant facts of a task. */
export interface Spec {
  readonly id: string;
  /** Length of the observation and of the action. */
  readonly obs: number;
  readonly act: number;
  readonly action_names: readonly string[];
  readonly action_low: readonly number[];
  readonly action_high: readonly number[];
  /** Seconds between decisions. */
  readonly dt: number;
  readonly frame_skip: number;
  readonly max_episode_steps: number;
  readonly reward_terms: readonly string[];
  readonly info: readonly string[];
  readonly command: readonly CommandRange[];
  readonly nq: number;
  readonly nv: number;
}

/** Value of an option of a task, as `--option NAME=VALUE` has it. */
export type OptionValue = number | boolean | string;

/** Options of an environment. */
export interface EnvOptions {
  /** Default 1. */
  readonly agents?: number;
  /** Default 0. */
  readonly seed?: number;
  /** Options of the task. */
  readonly options?: Readonly<Record<string, OptionValue>>;
  /** At the end of an episode, a new one starts at once, or the agent stays as it is. Default `same_step`. */
  readonly autoreset?: "same_step" | "disabled";
  /** Decisions after which an episode is truncated; 0 for no end by time. Default: the task's. */
  readonly max_episode_steps?: number;
  /** MJCF that replaces the model of the task. */
  readonly model?: string;
  /** The policy that acts: the bytes of a file. The task then has the options of its training. */
  readonly policy?: Uint8Array;
  /** The clip to follow: the bytes of a `.motion` file. */
  readonly clip?: Uint8Array;
}

/** Results of a step, one entry per agent. The arrays are views of the module's memory until the next call. */
export interface Step {
  /** `[agent][obs]` */
  readonly obs: Float32Array;
  readonly reward: Float32Array;
  /** 1 where the episode ended by the task, such as a fall. */
  readonly terminated: Uint8Array;
  /** 1 where the episode ended by time. */
  readonly truncated: Uint8Array;
}

/** State of one agent. */
export interface State {
  readonly qpos: Float64Array;
  readonly qvel: Float64Array;
}

/** Settings of a training, by the keys of a configuration file: `{ run: { total_steps: 1e6 }, ppo: { lr: 3e-4 } }`. */
export interface Config {
  readonly [section: string]: unknown;
}

/** Numbers of one iteration of a training. `null` where no episode has ended yet. */
export interface Iteration {
  /** Decisions so far, of all agents together. */
  readonly steps: number;
  readonly total_steps: number;
  readonly iteration: number;
  readonly return_mean: number | null;
  /** m/s along +x */
  readonly speed_mean: number | null;
  /** Decisions per episode. */
  readonly length_mean: number | null;
  /** Share of episodes that ended in a fall. */
  readonly fall_fraction: number | null;
}

/** Description of a policy. */
export interface PolicyInfo {
  /** Task that it was trained for. */
  readonly agent: string;
  readonly obs: number;
  readonly act: number;
  /** Options of the task in training. */
  readonly options: Readonly<Record<string, OptionValue>>;
}

/** A motion clip. */
export interface ClipInfo {
  readonly name: string;
  /** s */
  readonly duration: number;
  readonly frames: number;
  readonly loop: boolean;
}

/** Messages of a running program: a length of four bytes, a kind of one byte, and the content (crates/viewer). */
import type { ModelInfo } from "marathon-rl";

/** What the next frames show. */
export interface Scene {
  readonly type: "scene";
  readonly title: string;
  readonly model: ModelInfo;
  readonly agents: number;
  /** Seconds between two frames. */
  readonly dt: number;
}

/** Poses of all agents. */
export interface Frame {
  readonly type: "frame";
  /** Seconds since the start. */
  readonly time: number;
  /** Number of the episode of each agent. */
  readonly episodes: Uint32Array;
  /** Matrices, `[geom][agent][16]` and `[body][agent][16]`. */
  readonly geoms: Float32Array;
  readonly bodies: Float32Array;
}

/** Progress of a run: numbers over decisions. */
export interface Curve {
  readonly type: "curve";
  readonly total: number;
  readonly steps: readonly number[];
  readonly return_mean: readonly (number | null)[];
  readonly speed_mean: readonly (number | null)[];
}

/** Elevations of a height field of an agent. */
export interface Ground {
  readonly type: "ground";
  readonly agent: number;
  readonly field: number;
  readonly heights: Float32Array;
}

export type Message = Scene | Frame | Curve | Ground;

const [SCENE, FRAME, CURVE, GROUND] = [1, 2, 3, 4];
/** Bytes before the content. */
const HEAD = 5;
/** Longest content, bytes. */
const MOST = 256 * 2 ** 20;

/** Cuts a stream of bytes into messages. */
export class Parser {
  #rest = new Uint8Array(0);
  #scene: Scene | null = null;

  /** Takes bytes and returns the messages that they complete. */
  push(bytes: Uint8Array): Message[] {
    const all = new Uint8Array(this.#rest.length + bytes.length);
    all.set(this.#rest);
    all.set(bytes, this.#rest.length);
    const messages: Message[] = [];
    let at = 0;
    while (all.length - at >= HEAD) {
      const length = new DataView(all.buffer, at).getUint32(0, true);
      if (length > MOST) throw new Error(`a message has ${length} bytes, expected at most ${MOST}`);
      if (all.length - at - HEAD < length) break;
      const kind = all[at + 4] ?? 0;
      // a copy begins at a place where numbers can be read
      const message = this.#parse(kind, all.slice(at + HEAD, at + HEAD + length));
      if (message) messages.push(message);
      at += HEAD + length;
    }
    this.#rest = all.slice(at);
    return messages;
  }

  #parse(kind: number, content: Uint8Array<ArrayBuffer>): Message | null {
    const view = new DataView(content.buffer);
    switch (kind) {
      case SCENE:
        this.#scene = { type: "scene", ...(JSON.parse(new TextDecoder().decode(content)) as Omit<Scene, "type">) };
        return this.#scene;
      case CURVE:
        return { type: "curve", ...(JSON.parse(new TextDecoder().decode(content)) as Omit<Curve, "type">) };
      case GROUND:
        return { type: "ground", agent: view.getUint32(0, true), field: view.getUint32(4, true), heights: new Float32Array(content.buffer, 8) };
      case FRAME: {
        if (!this.#scene) return null;
        const { agents, model } = this.#scene;
        const [geoms, bodies] = [16 * agents * model.geoms.length, 16 * agents * model.bodies.length];
        const start = 8 + 4 * agents;
        if (content.length !== start + 4 * (geoms + bodies)) throw new Error(`a frame has ${content.length} bytes, expected ${start + 4 * (geoms + bodies)}`);
        return {
          type: "frame",
          time: view.getFloat64(0, true),
          episodes: new Uint32Array(content.buffer, 8, agents),
          geoms: new Float32Array(content.buffer, start, geoms),
          bodies: new Float32Array(content.buffer, start + 4 * geoms, bodies),
        };
      }
      default:
        // the program is still there
        return null;
    }
  }
}

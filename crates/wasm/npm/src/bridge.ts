import { MarathonError } from "./error.js";
import type { Exports } from "./exports.js";

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** Files of a request, by name. */
export type Files = Readonly<Record<string, Uint8Array>>;

/** Requests to an instance of the module, and their answers. */
export class Bridge {
  readonly exports: Exports;
  #stopped: string | null = null;

  constructor(instance: WebAssembly.Instance) {
    this.exports = instance.exports as unknown as Exports;
    this.exports.start();
  }

  /** Calls a function of the module, and turns a panic or an error into an exception. Returns the number of the object. */
  call(work: (exports: Exports) => number, request?: object, files: Files = {}): number {
    if (this.#stopped !== null) throw new MarathonError(`the module has stopped: ${this.#stopped}`);
    let code: number;
    try {
      this.#send(request, files);
      code = work(this.exports);
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      throw this.#stop(error);
    }
    if (code >= 0) return code;
    const { message, missing } = JSON.parse(this.text()) as { message: string; missing: string[] };
    throw new MarathonError(message, missing);
  }

  /** A copy of the last answer. */
  bytes(): Uint8Array {
    const { memory, output, output_length } = this.exports;
    return new Uint8Array(memory.buffer, output(), output_length()).slice();
  }

  /** The last answer as text. */
  text(): string {
    return decoder.decode(this.bytes());
  }

  /** The last answer as JSON. */
  json<T>(): T {
    return JSON.parse(this.text()) as T;
  }

  /** Single-precision numbers in the module's memory. The view is valid until the next call. */
  floats(place: number, length: number): Float32Array {
    return new Float32Array(this.exports.memory.buffer, place, length);
  }

  /** Double-precision numbers in the module's memory. */
  doubles(place: number, length: number): Float64Array {
    return new Float64Array(this.exports.memory.buffer, place, length);
  }

  /** Bytes in the module's memory. */
  octets(place: number, length: number): Uint8Array {
    return new Uint8Array(this.exports.memory.buffer, place, length);
  }

  /** Place of an array. A panic or a freed object is an exception. */
  place(work: (exports: Exports) => number): number {
    const place = this.call(work);
    if (place === 0) throw new MarathonError("this object has been freed");
    return place;
  }

  /** Frees an object. It goes with the module if that has stopped. */
  free(object: number): void {
    if (this.#stopped !== null) return;
    try {
      this.exports.free_object(object);
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      this.#stop(error);
    }
  }

  #send(request: object | undefined, files: Files): void {
    const names = Object.keys(files);
    if (request === undefined && names.length === 0) {
      this.exports.input(0);
      return;
    }
    const entries = names.map((name) => [name, files[name]?.length ?? 0]);
    const json = encoder.encode(JSON.stringify({ ...request, files: entries }));
    const total = 4 + json.length + names.reduce((sum, name) => sum + (files[name]?.length ?? 0), 0);
    const place = this.exports.input(total);
    // a view is made after the call, which may have moved the memory
    const { buffer } = this.exports.memory;
    new DataView(buffer).setUint32(place, json.length, true);
    const room = new Uint8Array(buffer, place, total);
    room.set(json, 4);
    let at = 4 + json.length;
    for (const name of names) {
      const file = files[name];
      if (file === undefined) continue;
      room.set(file, at);
      at += file.length;
    }
  }

  #stop(error: WebAssembly.RuntimeError): MarathonError {
    let message = "";
    try {
      this.exports.panicked();
      message = this.text();
    } catch {
      // memory ran out, or the stack did
    }
    this.#stopped = message || error.message;
    return new MarathonError(`the module has stopped: ${this.#stopped}`);
  }
}

/** Frees objects that nothing refers to any more. */
const registry = new FinalizationRegistry<() => void>((free) => free());

/** An object of the module. */
export abstract class Handle {
  protected readonly bridge: Bridge;
  readonly #object: number;
  #freed = false;

  protected constructor(bridge: Bridge, object: number) {
    this.bridge = bridge;
    this.#object = object;
    registry.register(this, () => bridge.free(object), this);
  }

  /** The object's number. The module gives that of a freed object to another one. */
  protected get object(): number {
    if (this.#freed) throw new MarathonError("this object has been freed");
    return this.#object;
  }

  /** Frees the memory of the object. Without this call, it is freed some time after the last use. */
  free(): void {
    if (this.#freed) return;
    this.#freed = true;
    registry.unregister(this);
    this.bridge.free(this.#object);
  }
}

/** Splits a state into `qpos` and `qvel`. */
export function splitState(bytes: Uint8Array, nq: number): { qpos: Float64Array; qvel: Float64Array } {
  const numbers = new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8);
  return { qpos: numbers.slice(0, nq), qvel: numbers.slice(nq) };
}

/** Joins `qpos` and `qvel`. */
export function joinState(qpos: ArrayLike<number>, qvel: ArrayLike<number>): Uint8Array {
  const numbers = new Float64Array(qpos.length + qvel.length);
  numbers.set(qpos, 0);
  numbers.set(qvel, qpos.length);
  return new Uint8Array(numbers.buffer);
}

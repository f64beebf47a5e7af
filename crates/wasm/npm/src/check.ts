/** Checks of what JavaScript passes: the module takes whole numbers of 32 bits, and would read others as something else. */
import { MarathonError } from "./error.js";

/** A whole number from `least` to `most`. */
export function count(what: string, value: number, least = 0, most = 2 ** 31 - 1): void {
  if (Number.isInteger(value) && value >= least && value <= most) return;
  throw new MarathonError(`${what} is ${String(value)}, expected a whole number from ${least} to ${most}`);
}

/** An index below `length`. */
export function index(what: string, value: number, length: number): void {
  if (length === 0) throw new MarathonError(`${what} is ${String(value)}, expected none: there is none`);
  count(what, value, 0, length - 1);
}

/** A finite number. */
export function finite(what: string, value: number | undefined): void {
  if (!Number.isFinite(value)) throw new MarathonError(`${what} is ${String(value)}, expected a finite number`);
}

/** Numbers of a length, all of them finite. */
export function numbers(what: string, values: ArrayLike<number>, length: number): void {
  if (typeof values?.length !== "number") throw new MarathonError(`${what} is ${String(values)}, expected ${length} numbers`);
  if (values.length !== length) throw new MarathonError(`${what} has ${values.length} numbers, expected ${length}`);
  // the name is made for a message only: a step checks thousands of numbers
  for (let i = 0; i < length; i++) if (!Number.isFinite(values[i])) finite(`${what}[${i}]`, values[i]);
}

/** The bytes of a file. */
export function bytes(what: string, value: Uint8Array | ArrayBuffer): Uint8Array {
  if (value instanceof Uint8Array) return value;
  if (value instanceof ArrayBuffer) return new Uint8Array(value);
  throw new MarathonError(`${what} is ${describe(value)}, expected the bytes of a file in a Uint8Array`);
}

/** Files by name. */
export function files(what: string, values: Readonly<Record<string, Uint8Array | ArrayBuffer>>): Record<string, Uint8Array> {
  return Object.fromEntries(Object.entries(values).map(([name, value]) => [name, bytes(`${what}['${name}']`, value)]));
}

/** A text. */
export function text(what: string, value: string): string {
  if (typeof value === "string") return value;
  throw new MarathonError(`${what} is ${describe(value)}, expected a string`);
}

/** Options among known ones. */
export function known(what: string, options: object, names: readonly string[]): void {
  const found = Object.keys(options).find((name) => !names.includes(name));
  if (found !== undefined) throw new MarathonError(`${what} has '${found}', expected some of ${names.join(", ")}`);
}

/** One of several words, or none. */
export function one(what: string, value: string | undefined, words: readonly string[]): void {
  if (value !== undefined && !words.includes(value)) throw new MarathonError(`${what} is '${String(value)}', expected ${words.join(" or ")}`);
}

function describe(value: unknown): string {
  return value === null || typeof value !== "object" ? String(value) : `a ${value.constructor?.name ?? "object"}`;
}

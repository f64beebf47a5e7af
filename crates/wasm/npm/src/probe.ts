/**
 * A module of one function: `relaxed_madd` of its three arguments. It does not validate in engines without relaxed SIMD, and
 * shows in the others whether products and sums are rounded once.
 */
const PROBE = new Uint8Array([
  0x00, 0x61, 0x73, 0x6d, 0x01, 0x00, 0x00, 0x00, // magic, version
  0x01, 0x08, 0x01, 0x60, 0x03, 0x7d, 0x7d, 0x7d, 0x01, 0x7d, // type: (f32, f32, f32) -> f32
  0x03, 0x02, 0x01, 0x00, // function 0 has type 0
  0x07, 0x05, 0x01, 0x01, 0x66, 0x00, 0x00, // export "f"
  0x0a, 0x16, 0x01, 0x14, 0x00, // code
  0x20, 0x00, 0xfd, 0x13, 0x20, 0x01, 0xfd, 0x13, 0x20, 0x02, 0xfd, 0x13, // three f32x4.splat
  0xfd, 0x85, 0x02, 0xfd, 0x1f, 0x00, 0x0b, // f32x4.relaxed_madd, f32x4.extract_lane 0
]);

/** Products whose exact sum differs from the rounded one. */
const SAMPLES: readonly (readonly [number, number, number, number])[] = [
  [1 + 2 ** -12, 1 + 2 ** -12, -1, 2 ** -11 + 2 ** -24],
  [1 + 2 ** -23, 1 - 2 ** -23, -1, -(2 ** -46)],
  [3, 1 / 3 + 2 ** -26, -1, Math.fround(3 * Math.fround(1 / 3 + 2 ** -26) - 1)],
];

/** Whether this engine has relaxed SIMD whose multiply-adds round once. */
export async function relaxedFuses(): Promise<boolean> {
  if (!WebAssembly.validate(PROBE)) return false;
  const { instance } = await WebAssembly.instantiate(PROBE);
  const fused = instance.exports["f"] as (a: number, b: number, c: number) => number;
  return SAMPLES.every(([a, b, c, expected]) => fused(a, b, c) === expected);
}

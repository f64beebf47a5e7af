// Checks the modules after a build: their size, and that the relaxed one has no relaxed instructions but those that the lanes ask for.
import { readFile } from "node:fs/promises";
import { brotliCompressSync, constants } from "node:zlib";
import wabt from "wabt";

/** Largest size in Brotli, bytes: 5 % above the size of the last release. */
const MOST = { relaxed: 1_500_000, exact: 1_800_000 };
/** Relaxed instructions: those of the lanes, and how many others the compiler may add in physics kernels. */
const ALLOWED = new Map([
  ["f32x4.relaxed_madd", Infinity],
  ["f32x4.relaxed_nmadd", Infinity],
  ["i32x4.relaxed_laneselect", Infinity],
]);

const { readWasm } = await wabt();
let failed = false;
for (const [name, most] of Object.entries(MOST)) {
  const bytes = await readFile(new URL(`dist/${name}.wasm`, import.meta.url)).catch(() => null);
  if (bytes === null) continue;
  const quality = { [constants.BROTLI_PARAM_QUALITY]: 9, [constants.BROTLI_PARAM_LGWIN]: 24 };
  const size = brotliCompressSync(bytes, { params: quality }).length;
  console.log(`${name}.wasm: ${bytes.length} bytes, ${size} in Brotli`);
  if (size > most) {
    console.error(`${name}.wasm has ${size} bytes in Brotli, expected at most ${most}`);
    failed = true;
  }
  const module = readWasm(bytes, { simd: true, relaxed_simd: true });
  const counts = new Map();
  for (const [instruction] of module.toText({}).matchAll(/\b\w+\.relaxed_\w+/g)) {
    counts.set(instruction, (counts.get(instruction) ?? 0) + 1);
  }
  for (const [instruction, count] of counts) {
    const allowed = name === "relaxed" ? (ALLOWED.get(instruction) ?? 0) : 0;
    if (count <= allowed) continue;
    console.error(`${name}.wasm has ${count} of ${instruction}, expected at most ${allowed}`);
    failed = true;
  }
}
process.exit(failed ? 1 : 0);

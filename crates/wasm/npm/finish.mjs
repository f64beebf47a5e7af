// Finishes the modules after a build. It replaces the relaxed minima and maxima that LLVM makes of comparisons: their results for NaN
// and -0 differ between processors. Then it checks that no other relaxed instructions are left but those that the lanes ask for, and
// the sizes.
import { readFile, writeFile } from "node:fs/promises";
import { brotliCompressSync, constants } from "node:zlib";
import wabt from "wabt";

/** Largest size in Brotli, quality 11, bytes: about 5 % above that of November 2026, with attached models, implicit integrators and media. */
const MOST = { relaxed: 1_492_000, exact: 1_655_000, "relaxed-play": 1_137_000, "exact-play": 1_295_000 };
/** Relaxed instructions that the lanes ask for. */
const ASKED = new Set(["f32x4.relaxed_madd", "f32x4.relaxed_nmadd", "i32x4.relaxed_laneselect"]);
const FEATURES = { simd: true, relaxed_simd: true };
/** Bytes of `f32x4.relaxed_min` and `f32x4.relaxed_max`, and those of `f32x4.pmin` and `f32x4.pmax`. */
const REPLACED = [
  [Buffer.from([0xfd, 0x8d, 0x02]), Buffer.from([0xfd, 0xea, 0x01])],
  [Buffer.from([0xfd, 0x8e, 0x02]), Buffer.from([0xfd, 0xeb, 0x01])],
];

const { readWasm } = await wabt();
let failed = false;
function complain(message) {
  console.error(`crates/wasm: ${message}`);
  failed = true;
}

for (const [name, most] of Object.entries(MOST)) {
  const file = new URL(`dist/${name}.wasm`, import.meta.url);
  const built = await readFile(file).catch(() => null);
  if (built === null) continue;
  const text = readWasm(built, FEATURES)
    .toText({})
    .replace(/\bf32x4\.relaxed_(min|max)\b/g, "f32x4.p$1");
  const relaxed = new Set(text.match(/\b\w+\.relaxed_\w+/g) ?? []);
  const unasked = [...relaxed].filter((instruction) => name.startsWith("exact") || !ASKED.has(instruction));
  if (unasked.length > 0) complain(`${name}.wasm contains ${unasked.join(", ")}`);
  // replaced in place, because deeply nested text is more than the parser can take
  const patched = Buffer.from(built);
  for (const [from, to] of REPLACED) {
    for (let at = patched.indexOf(from); at >= 0; at = patched.indexOf(from, at + to.length)) patched.set(to, at);
  }
  const module = readWasm(patched, FEATURES);
  if (module.toText({}) !== text) complain(`${name}.wasm: bytes other than those of relaxed minima and maxima were replaced`);
  const bytes = module.toBinary({}).buffer;
  await writeFile(file, bytes);
  const size = brotliCompressSync(bytes, {
    params: { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_LGWIN]: 24 },
  }).length;
  console.log(`${name}.wasm: ${bytes.length} bytes, ${size} in Brotli`);
  if (size > most) complain(`${name}.wasm has ${size} bytes in Brotli, expected at most ${most}`);
}
process.exit(failed ? 1 : 0);

#!/usr/bin/env bash
# Builds the npm package and tests it in Node: the bits of the native program, policies, errors, memory; and whether its
# reference is up to date.
#
#   crates/wasm/test.sh           the module with relaxed SIMD
#   crates/wasm/test.sh --both    the exact one as well
#
# Needs rustup and Node 20 with npm; installs Rust's wasm target.
set -euo pipefail
cd "$(dirname "$0")"
modules=(relaxed)
[ "${1:-}" != --both ] || modules+=(exact)
./build.sh "${modules[@]}" "${modules[@]/%/-play}"
cd npm
. ../node.sh
for lanes in "${modules[@]}"; do
  MARATHON_LANES="$lanes" NODE_OPTIONS="" node $relaxed_flag --test --test-reporter=spec tests/
done
node reference.mjs --check

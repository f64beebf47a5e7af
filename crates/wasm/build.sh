#!/usr/bin/env bash
# Builds the npm package in npm/dist: the modules and the TypeScript wrapper.
#
#   crates/wasm/build.sh [MODULE ...]    relaxed, exact, relaxed-play or exact-play; default: all four
#
# Modules for play have neither training nor the import of recordings.
#
# Needs rustup and Node 20 with npm; installs Rust's wasm target.
set -euo pipefail
cd "$(dirname "$0")"
[ -z "${CARGO_TARGET_DIR:-}" ] || CARGO_TARGET_DIR="$(realpath -m "$CARGO_TARGET_DIR")"
target="${CARGO_TARGET_DIR:-$PWD/../../target}/wasm"
for tool in rustup node npm; do
  if ! command -v "$tool" > /dev/null; then
    echo "crates/wasm/build.sh: $tool is missing; install Rust by rustup and Node 20 or later" >&2
    exit 1
  fi
done
rustup --quiet target add wasm32-unknown-unknown
# modules do not contain the paths of this computer
root="$(cd ../.. && pwd)"
paths=("--remap-path-prefix=$root=marathon" "--remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=cargo")

mkdir -p npm/dist
for module in "${@:-relaxed exact relaxed-play exact-play}"; do
  for name in $module; do
    lanes="${name%-play}" features='+simd128' options=()
    [ "$lanes" = exact ] || features+=',+relaxed-simd'
    [ "$lanes" = "$name" ] || options=(--no-default-features)
    echo "crates/wasm/build.sh: $name.wasm" >&2
    # LLVM's vectorizers would add relaxed instructions of their own, whose results differ between processors
    flags=("-Ctarget-feature=$features" -Cno-vectorize-loops -Cno-vectorize-slp "${paths[@]}")
    # of all forms of flags, cargo takes this one first
    env -u RUSTC_WORKSPACE_WRAPPER CARGO_TARGET_DIR="$target/$lanes" \
      CARGO_ENCODED_RUSTFLAGS="$(IFS=$'\x1f' && echo -n "${flags[*]}")" \
      cargo build --quiet --locked --profile web --target wasm32-unknown-unknown -p marathon-wasm "${options[@]}"
    cp "$target/$lanes/wasm32-unknown-unknown/web/marathon_wasm.wasm" "npm/dist/$name.wasm"
  done
done
cp ../../LICENSE-* npm/
cd npm
[ -d node_modules ] || npm ci --no-audit --no-fund --silent
npx tsc
node finish.mjs

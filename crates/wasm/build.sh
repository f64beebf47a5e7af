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

mkdir -p npm/dist
for module in "${@:-relaxed exact relaxed-play exact-play}"; do
  for name in $module; do
    lanes="${name%-play}" features='+simd128' options=()
    [ "$lanes" = exact ] || features+=',+relaxed-simd'
    [ "$lanes" = "$name" ] || options=(--no-default-features)
    echo "crates/wasm/build.sh: $name.wasm" >&2
    # LLVM's vectorizers would add relaxed instructions of their own, whose results differ between processors
    env -u RUSTC_WORKSPACE_WRAPPER CARGO_TARGET_DIR="$target/$lanes" \
      RUSTFLAGS="-C target-feature=$features -C no-vectorize-loops -C no-vectorize-slp" \
      cargo build --quiet --locked --profile web --target wasm32-unknown-unknown -p marathon-wasm "${options[@]}"
    cp "$target/$lanes/wasm32-unknown-unknown/web/marathon_wasm.wasm" "npm/dist/$name.wasm"
  done
done
cd npm
[ -d node_modules ] || npm ci --no-audit --no-fund --silent
npx tsc
node finish.mjs

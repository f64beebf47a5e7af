#!/usr/bin/env bash
# Tests the lanes on all processors: SSE2, AVX2 and AVX-512 here, NEON under qemu, WebAssembly with exact and with relaxed vectors
# and without vectors in Node. Each backend must have the bits of plain numbers.
#
# Needs rustup, qemu-user-static and Node 20; installs them on Debian and Ubuntu if it may.
set -euo pipefail
cd "$(dirname "$0")"
missing=()
command -v qemu-aarch64-static > /dev/null || missing+=(qemu-user-static)
command -v node > /dev/null || missing+=(nodejs)
if [ "${#missing[@]}" != 0 ]; then
  if [ "$(id -u)" != 0 ] || ! command -v apt-get > /dev/null; then
    echo "tests/lanes/run.sh: install ${missing[*]}" >&2
    exit 1
  fi
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
fi
rustup --quiet target add aarch64-unknown-linux-musl wasm32-wasip1
CARGO_TARGET_DIR="$(realpath -m "${CARGO_TARGET_DIR:-../../target}")/lanes"
export CARGO_TARGET_DIR
unset RUSTC_WORKSPACE_WRAPPER

suite() {
  echo "lanes: $1" >&2
  RUSTFLAGS="$3" cargo test --quiet --target "$2" --lib
}
suite 'this processor' "$(rustc --print host-tuple)" ''
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=rust-lld
export CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUNNER=qemu-aarch64-static
suite 'NEON' aarch64-unknown-linux-musl '-C link-self-contained=yes'
# Node 20 has relaxed vectors behind a flag that later ones do not know
flag=--experimental-wasm-relaxed-simd
node "$flag" --eval '' 2> /dev/null || flag=''
export CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings $flag $PWD/wasi.mjs"
suite 'WebAssembly' wasm32-wasip1 '-C target-feature=+simd128'
suite 'WebAssembly, relaxed' wasm32-wasip1 '-C target-feature=+simd128,+relaxed-simd'
suite 'WebAssembly without vectors' wasm32-wasip1 ''

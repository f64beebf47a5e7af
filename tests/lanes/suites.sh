#!/usr/bin/env bash
# Runs whole Rust test suites on other processors than this one; takes hours.
#
#   tests/lanes/suites.sh wasm      physics, motion, environments and learner as WebAssembly in Node
#   tests/lanes/suites.sh aarch64   the same, configurations and modules with NEON, under qemu
#   tests/lanes/suites.sh           both
#
# Words after -- go to each test program, such as names of tests. Needs what tests/lanes/run.sh needs, and .venv (./test.sh makes it):
# Python runs on this computer, outside of the emulation.
set -euo pipefail
cd "$(dirname "$0")/../.."
suites=()
while [ $# != 0 ] && [ "$1" != -- ]; do
  suites+=("$1")
  shift
done
[ "${#suites[@]}" != 0 ] || suites=(wasm aarch64)
CARGO_TARGET_DIR="$(realpath -m "${CARGO_TARGET_DIR:-target}")/suites"
MARATHON_PYTHON="${MARATHON_PYTHON:-$PWD/.venv/bin/python}"
export CARGO_TARGET_DIR MARATHON_PYTHON
unset RUSTC_WORKSPACE_WRAPPER
packages=(-p marathon-physics -p marathon-motion -p marathon-envs -p marathon-learn)
for suite in "${suites[@]}"; do
  case "$suite" in
    wasm)
      rustup --quiet target add wasm32-wasip1
      CARGO_TARGET_WASM32_WASIP1_RUNNER="node --no-warnings $PWD/tests/lanes/wasi.mjs" RUSTFLAGS='-C target-feature=+simd128' \
        cargo test --release --no-fail-fast --target wasm32-wasip1 --lib --tests "${packages[@]}" "$@"
      ;;
    aarch64)
      rustup --quiet target add aarch64-unknown-linux-musl
      CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=rust-lld \
        CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUNNER=qemu-aarch64-static RUSTFLAGS='-C link-self-contained=yes' \
        cargo test --release --no-fail-fast --target aarch64-unknown-linux-musl --lib --tests "${packages[@]}" -p marathon-config \
        -p marathon-wasm "$@"
      ;;
    *) echo "tests/lanes/suites.sh: no suite '$suite'; there are wasm and aarch64" >&2 && exit 2 ;;
  esac
done

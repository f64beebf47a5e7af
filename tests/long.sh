#!/usr/bin/env bash
# Checks that take hours; ./test.sh --long runs them after those of --all. tests/long.sh PART ... runs some:
#
#   fuzz      every reader for ten minutes of processor time (fuzz/run.py)
#   release   wheels, programs and archives of all platforms that this system can build, tried as a user would
#   aarch64   the Python tests with the wheel for Arm, under qemu
#   suites    the Rust tests of physics, motion, environments and learner with NEON under qemu and as WebAssembly in Node
#   bits      states and weights with SSE2, under qemu with NEON, and with both WebAssembly modules
#   web       the page in Chromium and Firefox, with five minutes of play
#   soak      ten million steps of each agent, three hundred models with random meshes
#   crates    packs and compiles the published crates
#   avian     the example that lets characters touch the bodies of another physics engine
#   player    twenty random players in the game, and four with a camera in each of five worlds, ten minutes of its time each
set -euo pipefail
cd "$(dirname "$0")/.."
parts=("$@")
if [ $# = 0 ]; then
  parts=(fuzz release aarch64 suites bits web soak crates avian player)
fi
for part in "${parts[@]}"; do
  echo "tests/long.sh: $part" >&2
  case "$part" in
    fuzz) fuzz/run.py ;;
    release)
      release/build.sh
      PLATFORM='x86_64-unknown-linux-musl x86_64-unknown-linux-gnu' release/smoke.sh release/dist
      ;;
    aarch64)
      release/build.sh wheel-aarch64
      tests/aarch64.sh release/dist/marathon_rl-*manylinux*aarch64*.whl
      ;;
    suites) tests/lanes/suites.sh ;;
    bits)
      cargo test --release -p marathon-wasm --features baseline --test bits
      rustup --quiet target add aarch64-unknown-linux-musl
      CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER=rust-lld \
        CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_RUNNER=qemu-aarch64-static RUSTFLAGS='-C link-self-contained=yes' \
        cargo test --release -p marathon-wasm --test bits --target aarch64-unknown-linux-musl
      crates/wasm/test.sh --both
      ;;
    web) web/test.sh --long ;;
    soak)
      MARATHON_TEST_LONG=yes cargo test --release -p marathon-physics --test contracts -- --nocapture \
        ten_million_steps_stay_finite:: meshes_agree_with_mujoco::
      ;;
    crates) release/publish.sh --dry-run ;;
    avian) cargo test --release --workspace --bin avian_props ;;
    player)
      cargo test --release --workspace --test contracts -- --ignored --nocapture a_stranger_plays::
      MARATHON_TEST_LONG=yes cargo test --release --workspace --test contracts -- --nocapture the_camera_stays_outside::
      ;;
    *) echo "tests/long.sh: no part '$part'; there are fuzz, release, aarch64, suites, bits, web, soak, crates, avian and player" >&2 && exit 2 ;;
  esac
done

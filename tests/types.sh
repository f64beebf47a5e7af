#!/usr/bin/env bash
# Checks the types of what the tests do not build: the fuzzers, for browsers the crates that compute without files, threads and
# clocks, and the command and the studies for macOS and Windows. Part of ./test.sh --all. Needs rustup, or a toolchain that has
# these targets.
set -euo pipefail
cd "$(dirname "$0")/.."
target="${CARGO_TARGET_DIR:-target}"
cargo check --quiet --release --manifest-path fuzz/Cargo.toml --no-default-features --target-dir "$target"
systems=(aarch64-apple-darwin x86_64-pc-windows-gnu)
if command -v rustup > /dev/null; then
  rustup --quiet target add wasm32-unknown-unknown "${systems[@]}"
fi
core=(-p marathon-physics -p marathon-motion -p marathon-envs -p marathon-learn -p marathon-config)
cargo check --quiet --release --target wasm32-unknown-unknown "${core[@]}"
for system in "${systems[@]}"; do
  cargo check --quiet --release --target "$system" -p marathon-cli -p marathon-studies
done

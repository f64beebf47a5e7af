#!/usr/bin/env bash
# Checks the types of what the tests do not build: the fuzzers, and the command and the studies for macOS and Windows. Part of
# ./test.sh --all. Needs rustup, or a toolchain that has these targets.
set -euo pipefail
cd "$(dirname "$0")/.."
target="${CARGO_TARGET_DIR:-target}"
cargo check --quiet --release --manifest-path fuzz/Cargo.toml --no-default-features --target-dir "$target"
systems=(aarch64-apple-darwin x86_64-pc-windows-gnu)
if command -v rustup > /dev/null; then
  rustup --quiet target add "${systems[@]}"
fi
for system in "${systems[@]}"; do
  cargo check --quiet --release --target "$system" -p marathon-cli -p marathon-studies
done

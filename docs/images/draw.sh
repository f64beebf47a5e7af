#!/usr/bin/env bash
# Draws the pictures of the documentation: a strip of each policy in assets/policies and, where a folder of training runs
# is given, their learning curves.
#
#     docs/images/draw.sh [folder with the run folders hopper, walker2d, ant, humanoid [agents]]
set -euo pipefail
cd "$(dirname "$0")/../.."
cargo build --release
marathon="${CARGO_TARGET_DIR:-target}/release/marathon"
agents=("${@:2}")
if [ "${#agents[@]}" = 0 ]; then
  agents=(hopper walker2d ant humanoid)
fi
for agent in "${agents[@]}"; do
  "$marathon" render "assets/policies/$agent.safetensors" --out "docs/images/$agent-gait.png" \
    --start 4 --seconds 1 --frames 8 --width 200 --height 200
  if [ $# -ge 1 ]; then
    cp "$1/$agent/curve.png" "docs/images/$agent-curve.png"
  fi
done

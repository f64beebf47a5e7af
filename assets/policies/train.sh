#!/usr/bin/env bash
# Trains the policies of this folder again, by the README's commands, with one thread, and draws their pictures for the
# documentation. Prints the rows of the table in docs/research/benchmarks.md. Needs python3 for the rows.
#
#     assets/policies/train.sh [hopper walker2d ant humanoid]
set -euo pipefail
cd "$(dirname "$0")/../.."
agents=("$@")
if [ $# = 0 ]; then
  agents=(hopper walker2d ant humanoid)
fi
cargo build --release
marathon="${CARGO_TARGET_DIR:-target}/release/marathon"
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT
for agent in "${agents[@]}"; do
  "$marathon" --json train "$agent" --threads 1 --out "$runs/$agent" > "$runs/$agent.json"
  cp "$runs/$agent/policy.safetensors" "assets/policies/$agent.safetensors"
  python3 - "$runs/$agent.json" << 'ROW'
import json, sys

run = json.load(open(sys.argv[1]))
e = run["eval"]
print(
    f"| {run['agent']} | {e['return_mean']:.1f} ± {e['return_std']:.1f} | {e['speed_mean']:.2f} | {e['falls']} "
    f"| {run['steps'] / 1e6:.1f} M | {run['wall_seconds']:.1f} | {run['cpu_seconds']:.1f} |"
)
ROW
done
docs/images/draw.sh "$runs" "${agents[@]}"

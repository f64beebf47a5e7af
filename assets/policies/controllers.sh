#!/usr/bin/env bash
# Makes the policies of this folder that obey a player in a plane, HopperController and WalkerController. Each learns to go from the
# policy of its figure that runs, and then not to fall. About seven minutes of processor time in all.
#
#     assets/policies/controllers.sh [HopperController] [WalkerController]
set -euo pipefail
cd "$(dirname "$0")/../.."
wanted=("$@")
if [ $# = 0 ]; then
  wanted=(HopperController WalkerController)
fi
cargo build --release
marathon="${CARGO_TARGET_DIR:-target}/release/marathon"
shipped=assets/policies
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

for agent in "${wanted[@]}"; do
  case "$agent" in
    HopperController) runner=hopper ;;
    WalkerController) runner=walker2d ;;
    *)
      echo "no policy $agent is made here: HopperController, WalkerController" >&2
      exit 2
      ;;
  esac
  "$marathon" train "$agent" --initialize-from "$shipped/$runner.safetensors" --seed 1 --threads 1 --out "$runs/$agent-goes"
  "$marathon" train "$agent" --config assets/configs/controller-steady.yaml --initialize-from "$runs/$agent-goes" \
    --seed 1 --threads 1 --out "$runs/$agent"
  cp "$runs/$agent/policy.safetensors" "$shipped/$agent.safetensors"
done

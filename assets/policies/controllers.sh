#!/usr/bin/env bash
# Makes the policies of this folder that obey a player in a plane: HopperController and WalkerController, by buttons and, as
# ...ControllerStick, by a stick. Each learns to go from the policy of its figure that runs, and then not to fall. About quarter of
# an hour of processor time in all.
#
#     assets/policies/controllers.sh [HopperController] [WalkerController]
set -euo pipefail
cd "$(dirname "$0")/../.."
wanted=("$@")
if [ $# = 0 ]; then
  wanted=(HopperController WalkerController)
fi
cargo build --release
marathon="${MARATHON:-${CARGO_TARGET_DIR:-target}/release/marathon}"
shipped=assets/policies
runs="${RUNS:-$(mktemp -d)}"

for agent in "${wanted[@]}"; do
  case "$agent" in
    HopperController) runner=hopper ;;
    WalkerController) runner=walker2d ;;
    *)
      echo "unknown controller '$agent'; known: HopperController, WalkerController" >&2
      exit 1
      ;;
  esac
  # what a player has in hand, the commands of the second run, what the policy is called
  while read -r input schedule name; do
    goes="$runs/$name-goes" steady="$runs/$name"
    common=("$agent" --seed "${SEED:-1}" --threads 1 --option "input=$input")
    "$marathon" train "${common[@]}" --initialize-from "$shipped/$runner.safetensors" --out "$goes"
    "$marathon" train "${common[@]}" --config assets/configs/controller-steady.yaml --option "schedule=$schedule" \
      --initialize-from "$goes" --out "$steady"
    cp "$steady/policy.safetensors" "$shipped/$name.safetensors"
  done << EOF
discrete repeats $agent
continuous uniform ${agent}Stick
EOF
done

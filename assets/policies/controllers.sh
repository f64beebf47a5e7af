#!/usr/bin/env bash
# Makes the policies of this folder that obey a player in two runs each, two of them in three: HopperController and WalkerController learn to
# go from the policy of their figure that runs, and then not to fall; AntController learns to go from nothing, and then to stand still;
# MarathonManSteer the same, and not to fall, in three runs. About an hour and a half of processor time in all. Needs python3.
#
#     assets/policies/controllers.sh [HopperController] [WalkerController] [AntController] [MarathonManSteer]
set -euo pipefail
cd "$(dirname "$0")/../.."
wanted=("$@")
if [ $# = 0 ]; then
  wanted=(HopperController WalkerController AntController MarathonManSteer)
fi
cargo build --release
marathon="${CARGO_TARGET_DIR:-target}/release/marathon"
shipped=assets/policies
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

for agent in "${wanted[@]}"; do
  from=() more=''
  case "$agent" in
    HopperController) from=(--initialize-from "$shipped/hopper.safetensors") steady=controller ;;
    WalkerController) from=(--initialize-from "$shipped/walker2d.safetensors") steady=controller ;;
    AntController) steady=ant_controller more=50M ;;
    MarathonManSteer) steady=marathon_man_steer ;;
    *)
      echo "no policy $agent is made here: HopperController, WalkerController, AntController, MarathonManSteer" >&2
      exit 2
      ;;
  esac
  learn() { "$marathon" train "$agent" --threads 1 "$@"; }
  steadily=(--config "assets/configs/$steady-steady.yaml" --initialize-from)
  last="$runs/$agent"
  learn "${from[@]}" --seed 1 --out "$last-goes"
  if [ "$agent" = MarathonManSteer ]; then
    # to stand still, with less noise; then not to fall
    learn "${steadily[@]}" "$last-goes" --option relive=0 --option seconds=20 --seed 1 --out "$last-stands"
    learn "${steadily[@]}" "$last-stands"/policies/policy-80*.safetensors --seed 2 --out "$last"
    assets/policies/average.py "$last-mean.safetensors" "$last"/policies/*.safetensors
    # who plays starts from a stand, and is not asked for extremes half of the time
    "$marathon" export "$last-mean.safetensors" --out "$last-mean.onnx"
    "$marathon" import "$last-mean.onnx" --agent "$agent" --option start=first --option commands=even --option price=20 \
      --option seconds=20 --out "$last-shipped.safetensors"
    cp "$last-shipped.safetensors" "$shipped/$agent.safetensors"
    continue
  fi
  learn "${steadily[@]}" "$last-goes" --seed 1 --out "$last"
  if [ -n "$more" ]; then
    learn "${steadily[@]}" "$last" --steps "$more" --seed 2 --out "$last-more"
    last="$last-more"
  fi
  cp "$last/policy.safetensors" "$shipped/$agent.safetensors"
done

#!/usr/bin/env bash
# Makes the policies of this folder that obey a player in two runs each, two of them in three. HopperController and WalkerController learn
# to go from the policy of their figure that runs, and then not to fall. AntController learns to go from nothing, and then to stand still;
# MarathonManSteer the same, and not to fall, in three runs. All but the Ant's are means of the policies that the
# last run keeps. About an hour and a half of processor time in all.
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
  from=() seed=1
  case "$agent" in
    HopperController) from=(--initialize-from "$shipped/hopper.safetensors") steady=controller ;;
    # the seed of five that turns round without a fall
    WalkerController) from=(--initialize-from "$shipped/walker2d.safetensors") steady=controller seed=2 ;;
    AntController) steady=ant_controller ;;
    MarathonManSteer) steady=marathon_man_steer ;;
    *)
      echo "no policy $agent is made here: HopperController, WalkerController, AntController, MarathonManSteer" >&2
      exit 2
      ;;
  esac
  learn() { "$marathon" train "$agent" --threads 1 "$@"; }
  steadily=(--config "assets/configs/$steady-steady.yaml" --initialize-from)
  last="$runs/$agent"
  # of the policies that the last run has kept, as what is shipped
  mean() {
    policy="$last-shipped.safetensors"
    "$marathon" average "$last" "$@" --out "$policy"
  }
  learn "${from[@]}" --seed "$seed" --out "$last-goes"
  case "$agent" in
    AntController)
      learn "${steadily[@]}" "$last-goes" --seed 1 --out "$last"
      learn "${steadily[@]}" "$last" --steps 50M --seed 2 --out "$last-more"
      policy="$last-more/policy.safetensors"
      ;;
    MarathonManSteer)
      # to stand still, with less noise; then not to fall
      learn "${steadily[@]}" "$last-goes" --option replay_falls_prob=0 --option seconds=20 --seed 1 --out "$last-stands"
      learn "${steadily[@]}" "$last-stands"/policies/policy-80*.safetensors --seed 2 --out "$last"
      # who plays starts from a stand, and is not asked for extremes half of the time
      mean --option start=first --option commands=even --option fall_penalty=20 --option seconds=20
      ;;
    *)
      learn "${steadily[@]}" "$last-goes" --seed "$seed" --out "$last"
      mean --option fall_penalty=40 --option replay_falls_prob=0
      ;;
  esac
  cp "$policy" "$shipped/$agent.safetensors"
done

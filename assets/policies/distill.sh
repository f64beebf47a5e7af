#!/usr/bin/env bash
# Makes the policies of this folder that are learned from others: MarathonMan (one for sixteen clips) and
# MarathonManController. What they are learned from is trained before, but for the policies that are here; more than eight hours
# of processor time in all.
#
#     assets/policies/distill.sh [MarathonMan] [MarathonManController]
set -euo pipefail
cd "$(dirname "$0")/../.."
wanted=("$@")
if [ $# = 0 ]; then
  wanted=(MarathonMan MarathonManController)
fi
cargo build --release
marathon="${CARGO_TARGET_DIR:-target}/release/marathon"
shipped=assets/policies
runs=$(mktemp -d)
trap 'rm -rf "$runs"' EXIT

# A policy of one clip, trained if it is not here.
teacher() {
  if [ -f "$shipped/MarathonMan$1.safetensors" ]; then
    echo "--teacher=$shipped/MarathonMan$1.safetensors"
    return
  fi
  if [ ! -d "$runs/$1" ]; then
    "$marathon" train "MarathonMan$1" "${@:2}" --seed 1 --threads 1 --out "$runs/$1" >&2
  fi
  echo "--teacher=$runs/$1"
}

for policy in "${wanted[@]}"; do
  case "$policy" in
    MarathonMan)
      teachers=()
      for clip in Walk WalkLeft WalkRight Run Backflip SpinKick Jump Kick Punch Crawl GetUpFaceDown GetUpFaceUp; do
        teachers+=("$(teacher "$clip")")
      done
      # good enough after less than its usual 60 million
      teachers+=("$(teacher Cartwheel --steps 23M)")
      left=$(teacher WalkLeft) right=$(teacher WalkRight) flip=$(teacher Backflip) wheel=$(teacher Cartwheel)
      learn() {
        "$marathon" distill MarathonMan --option future=3 --option start=adaptive --hidden 256,256 "${teachers[@]}" "$@"
      }
      learn --steps 30M --seed 1 --out "$runs/one.safetensors"
      # then what it does worst
      learn "$left" "$flip" "$flip" "$wheel" --steps 9M --lr 5e-4 --seed 2 --initialize-from "$runs/one.safetensors" \
        --out "$runs/two.safetensors"
      learn "$flip" "$flip" "$flip" "$flip" "$wheel" --steps 9M --lr 5e-4 --seed 3 --initialize-from "$runs/two.safetensors" \
        --out "$runs/three.safetensors"
      learn "$left" "$left" "$right" "$flip" "$flip" "$flip" "$wheel" --steps 6M --lr 4e-4 --seed 4 \
        --initialize-from "$runs/three.safetensors" --out "$runs/four.safetensors"
      # the run that the policy here comes from was stopped after 4.3 million
      learn "$left" "$left" "$right" "$flip" "$flip" "$flip" "$flip" "$flip" "$wheel" --steps 8M --lr 3e-4 --seed 5 \
        --initialize-from "$runs/four.safetensors" --out "$runs/five.safetensors"
      # then three that are harder; of the others it is its own teacher, of all of them or of some
      of_itself() {
        "$marathon" import "$runs/five.safetensors" --option "clip=$2" --out "$runs/$1.safetensors" >&2
        echo "--teacher=$runs/$1.safetensors"
      }
      walk=$(teacher Walk) run=$(teacher Run) roll=$(teacher Roll --steps 80M) spin=$(teacher Spin) dance=$(teacher Dance)
      known="--teacher=$runs/five.safetensors"
      teachers=("$known" "$known" "$known" "$known")
      learn "$known" "$known" "$known" "$roll" "$roll" "$spin" "$spin" "$spin" "$dance" "$dance" \
        --steps 14M --lr 5e-4 --seed 6 --initialize-from "$runs/five.safetensors" --out "$runs/six.safetensors"
      turns=$(of_itself turns walk_left,walk_right,jump) wheel=$(of_itself wheel cartwheel)
      learn "$flip" "$flip" "$flip" "$flip" "$flip" "$walk" "$run" "$run" "$run" "$turns" "$turns" "$turns" "$wheel" "$wheel" \
        "$roll" "$spin" "$spin" "$spin" "$dance" --steps 16M --lr 5e-4 --seed 7 --initialize-from "$runs/six.safetensors" \
        --out "$shipped/MarathonMan.safetensors"
      ;;
    MarathonManController)
      skills=()
      for clip in Backflip GetUpFaceDown GetUpFaceUp; do
        skills+=("$(teacher "$clip")")
      done
      steer=$(teacher Steer) jump=$(teacher Jump)
      learn() {
        "$marathon" distill MarathonManController --option commands=sharp --option start=adaptive --hidden 128,128 \
          "${skills[@]}" "$@"
      }
      # who goes falls most easily, and so is shown twice
      learn "$steer" "$steer" "$jump" --steps 10M --seed 1 --out "$runs/start.safetensors"
      "$marathon" train MarathonManController --option end_on_fall_prob=0.7 --option start_pushed_prob=0 --steps 47M \
        --initialize-from "$runs/start.safetensors" --seed 1 --threads 1 --out "$runs/goes"
      # what he forgot meanwhile; the network of the run, as one that goes and jumps only
      "$marathon" import "$runs/goes" --option clip=walk,walk_left,walk_right,run,stand,jump --out "$runs/goes.safetensors"
      goes="--teacher=$runs/goes.safetensors"
      learn "$goes" "$goes" "$goes" "${skills[0]}" --steps 8M --lr 5e-4 --seed 2 --initialize-from "$runs/goes" \
        --out "$runs/knows.safetensors"
      "$marathon" train MarathonManController --option start_pushed_prob=0 --steps 20M --initialize-from "$runs/knows.safetensors" --seed 1 \
        --threads 1 --out "$runs/run"
      # and on: to stand still, to jump higher, to get up
      "$marathon" train MarathonManController --option start_pushed_prob=0 --steps 36M --initialize-from "$runs/run" --seed 2 --threads 1 \
        --out "$runs/still"
      "$marathon" train MarathonManController --option end_on_fall_prob=0.3 --option start_pushed_prob=0 --steps 40M --initialize-from "$runs/still" \
        --seed 3 --threads 1 --out "$runs/rises"
      # falls as pushes cause them, then starts from a stand
      "$marathon" train MarathonManController --option end_on_fall_prob=0.3 --option start_pushed_prob=0.2 --steps 40M --initialize-from "$runs/rises" \
        --seed 4 --threads 1 --out "$runs/knocked"
      "$marathon" train MarathonManController --option start=first --option end_on_fall_prob=0.5 --option start_pushed_prob=0.1 --steps 18M \
        --initialize-from "$runs/knocked" --seed 7 --threads 1 --out "$runs/stands"
      # all of it, for long; two runs of 130 million that were stopped after 30 and 40, and one that was not
      "$marathon" train MarathonManController --steps 70M --initialize-from "$runs/stands" --seed 1 --threads 1 --out "$runs/all"
      "$marathon" train MarathonManController --initialize-from "$runs/all" --seed 1 --threads 1 --out "$runs/last"
      # with leaps and faster rises; the first of the two was stopped
      "$marathon" train MarathonManController --steps 20M --initialize-from "$runs/last" --seed 2 --threads 1 --out "$runs/up"
      "$marathon" train MarathonManController --initialize-from "$runs/up" --seed 3 --threads 1 --out "$runs/leaps"
      # to fall less; the best of its policies is not the last
      "$marathon" train MarathonManController --config assets/configs/marathon_man_controller-steady.yaml --initialize-from "$runs/leaps" \
        --seed 5 --threads 1 --out "$runs/steady"
      # noise that stays leaves him something to spare; what he loses by it, the other of the mean has
      noisy() {
        "$marathon" train MarathonManController --config assets/configs/marathon_man_controller-steady.yaml \
          --set ppo.action_std.init_log=-2.3 --set ppo.action_std.min=0.1 --threads 1 "$@"
      }
      # who plays starts from a stand, and is not asked for extremes half of the time
      mean() {
        "$marathon" average "${@:2}" --option start=first --option commands=even --option end_on_fall_prob=0 --option start_pushed_prob=0 \
          --option fall_penalty=20 --option replay_falls_prob=0 --out "$1"
      }
      first=("$runs"/steady/policies/policy-50*.safetensors)
      noisy --initialize-from "${first[0]}" --seed 1 --out "$runs/n1"
      noisy --option commands=even --initialize-from "$runs/n1" --seed 2 --out "$runs/n2"
      several=("${first[0]}" "$runs/n1/policy.safetensors" "$runs/n2/policy.safetensors")
      mean "$runs/three.safetensors" "${several[@]}"
      noisy --option replay_falls_prob=0.3 --initialize-from "$runs/three.safetensors" --seed 3 --out "$runs/n3"
      several+=("$runs/n3/policy.safetensors")
      mean "$runs/four.safetensors" "${several[@]}"
      # to get up in time
      noisy --option end_on_fall_prob=0.4 --option start_pushed_prob=0.25 --steps 40M --initialize-from "$runs/four.safetensors" --seed 5 --out "$runs/n4"
      mean "$shipped/MarathonManController.safetensors" "$runs/n4/policy.safetensors" "$runs/four.safetensors"
      ;;
    *)
      echo "no policy $policy is learned from others here: MarathonMan, MarathonManController" >&2
      exit 2
      ;;
  esac
done

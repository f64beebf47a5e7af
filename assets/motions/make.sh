#!/usr/bin/env bash
# Makes all clips again from the motions in the wheel of pybullet 3.2.7. Needs pip, unzip and the marathon command.
# Clips with a `balance` of 0 are older than the law of balance: the policies of assets/policies have learned them as they are.
set -euo pipefail
cd "$(dirname "$0")"
marathon="${MARATHON:-marathon}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
pip download --quiet pybullet==3.2.7 --no-deps --only-binary :all: --python-version 3.11 --platform manylinux2014_x86_64 --dest "$work"
unzip -q "$work"/pybullet-*.whl 'pybullet_data/data/motions/*' -d "$work"
from="$work/pybullet_data/data/motions"
source="DeepMimic (Peng et al., 2018), from pybullet 3.2.7; retargeted by Marathon"

make() { # character, clip, file, further options
  "$marathon" motion import "$from/$3.txt" --model "../agents/$1.xml" --out "$1/$2.motion" \
    --source "$source" --license Zlib --smooth "${smooth:-0.03}" --balance "${balance:-0}" "${@:4}"
}
for clip in walk backflip cartwheel jump crawl; do
  make marathon_man "$clip" "humanoid3d_$clip"
done
for clip in roll spin; do
  balance=1 make marathon_man "$clip" "humanoid3d_$clip"
done
balance=1 make marathon_man dance humanoid3d_dance_b
for clip in kick punch; do
  smooth=0 make marathon_man "$clip" "humanoid3d_$clip"
done
smooth=0.05 make marathon_man getup_faceup humanoid3d_getup_faceup
# the recording's halves are mirror images, with a seam between them
smooth=0.05 make marathon_man run humanoid3d_run
make marathon_man spinkick humanoid3d_spinkick --loop none
# in the first quarter of a second the arms are where no arm can be
smooth=0.05 make marathon_man getup_facedown humanoid3d_getup_facedown --trim 0.25 3.03
# the end of getting up: he stands
make marathon_man stand humanoid3d_getup_facedown --trim 2.9 3.03 --loop wrap --forward
make marathon_man walk_left walker/turn_left1
make marathon_man walk_right walker/turn_right1
for character in humanoid walker2d; do
  make "$character" walk humanoid3d_walk
  smooth=0.05 make "$character" run humanoid3d_run
done

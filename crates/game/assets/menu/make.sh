#!/usr/bin/env bash
# Makes the pictures of the main menu with the recorder of the game, cut to the characters: make.sh [MARATHON_GAME]
# Needs ImageMagick.
set -euo pipefail
cd "$(dirname "$0")"
game="${1:-marathon-game}"
whole=$(mktemp --suffix=.png)
trap 'rm -f "$whole"' EXIT
# shot NAME LEFT,TOP WIDTH ARGS: the part of a picture of 1280 x 720
shot() {
  local name="$1" left="${2%,*}" top="${2#*,}" width="$3"
  shift 3
  "$game" "$@" --no-hud --quality high --size 1280x720 --seconds 0.1 --fps 10 --record "$whole"
  convert "$whole" -crop "${width}x$((width * 9 / 16))+$left+$top" +repage -resize '208x117!' "$name.png"
}
shot play 330,270 700 MarathonManController --skin marathon_man --input 0.2-9:pad:left-y=1 --start 2.4
shot courses 200,170 800 TerrainMarathonMan --mode course --course stairs --skin marathon_man --start 6
shot learn 300,200 700 hopper --agents 4 --start 1.2
shot motion 320,190 640 MarathonManBackflip --mode imitate --action 0:ghost --start 1
shot testbed 300,260 700 humanoid --joints --start 0.6
shot replays 200,190 800 MarathonManRun --agents 3 --skin marathon_man --start 1.5

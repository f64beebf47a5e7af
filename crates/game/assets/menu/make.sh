#!/usr/bin/env bash
# Makes the pictures of the main menu with the recorder of the game: make.sh [MARATHON_GAME]
set -euo pipefail
cd "$(dirname "$0")"
game="${1:-marathon-game}"
shot() {
  local name="$1"
  shift
  "$game" "$@" --no-hud --quality high --size 208x117 --seconds 0.1 --fps 10 --record "$name.png"
}
shot play MarathonManController --skin marathon_man --input 0.2-9:pad:left-y=1 --start 2.4
shot courses TerrainMarathonMan --mode course --course stairs --skin marathon_man --start 6
shot learn hopper --agents 4 --start 1.2
shot motion MarathonManBackflip --mode imitate --action 0:ghost --start 1
shot testbed humanoid --joints --start 0.6
shot replays MarathonManRun --agents 3 --skin marathon_man --start 1.5

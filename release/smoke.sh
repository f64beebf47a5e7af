#!/usr/bin/env bash
# Tries products of a release as a user would: release/smoke.sh FOLDER. Installs the wheel that suits this computer into a clean
# environment. Starts the programs of each archive for a platform that PLATFORM lists, such as x86_64-unknown-linux-musl.
set -euo pipefail
[ "$#" = 1 ] && [ -d "$1" ] || { echo 'usage: [PLATFORM=TARGET ...] release/smoke.sh FOLDER' >&2 && exit 2; }
folder=$(cd "$1" && pwd) scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
python=$(command -v python3 || command -v python)

baseline=(bench physics --agent hopper --isa baseline --seconds 0.05 --agents 4 --warmup 0)

wheel=("$folder"/marathon_rl-*.whl)
version=$(basename "${wheel[0]}" | cut -d - -f 2)
echo "marathon-rl $version" >&2
"$python" -m venv "$scratch/env"
bin="$scratch/env/bin"
[ -d "$bin" ] || bin="$scratch/env/Scripts"
"$bin/python" -m pip install --quiet --disable-pip-version-check --only-binary marathon-rl --find-links "$folder" \
  "marathon-rl==$version"
(
  cd "$scratch"
  "$bin/python" -c 'import marathon_rl; marathon_rl.VecEnv("hopper", 2).reset()'
  "$bin/marathon" --json list > list.json
  "$bin/marathon" "${baseline[@]}"
  "$bin/python" -c 'import marathon_rl; marathon_rl.VecEnv("hopper", 2).show().close()'
)

for platform in ${PLATFORM:-}; do
  for archive in "$folder"/marathon-*"-$platform".*; do
    basename "$archive" >&2
    "$python" -c 'import shutil, sys; shutil.unpack_archive(*sys.argv[1:])' "$archive" "$scratch/programs"
  done
done
for program in "$scratch"/programs/*/marathon*; do
  case "$(basename "$program" .exe)" in
    marathon)
      "$program" --version
      "$program" --json list > "$scratch/list.json"
      "$program" "${baseline[@]}"
      ;;
    marathon-game | marathon-player) "$program" --version ;;
  esac
done

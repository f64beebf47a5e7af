#!/usr/bin/env bash
# Tests `marathon-player` and the game's door with the unmodified ML-Agents 1.1.0 of PyPI. Part of ./test.sh. Makes
# .venv-mlagents for it, unless MARATHON_MLAGENTS_PYTHON names a Python that has it; needs Python 3.11 with venv, gcc and
# readelf. MARATHON_TEST_GAME=1 tests the game, too. Arguments go to pytest.
set -euo pipefail
cd "$(dirname "$0")/../.."
python="${MARATHON_MLAGENTS_PYTHON:-$PWD/.venv-mlagents/bin/python}"
if [ -z "${MARATHON_MLAGENTS_PYTHON:-}" ] && [ ! -e .venv-mlagents/complete ]; then
  # mlagents 1.1.0 has no version for Python 3.12, and its requirements have no wheels for it
  base=$(command -v python3.11 || command -v python3)
  "$base" -c 'import sys; sys.version_info[:2] == (3, 11) or sys.exit(f"ML-Agents needs Python 3.11, found {sys.version}")'
  rm -rf .venv-mlagents
  "$base" -m venv .venv-mlagents
  tests/oracle/install.sh "$python" --requirement tests/mlagents/requirements.txt
  # uv cannot be told to ignore what Python a package asks for
  pip=("$python" -m pip --quiet --disable-pip-version-check install --no-compile)
  "${pip[@]}" --no-deps --ignore-requires-python --requirement tests/mlagents/requirements-no-deps.txt
  "$python" tests/oracle/install_torch.py torch==2.1.2
  touch .venv-mlagents/complete
fi
# `--workspace` and a test among the targets keep the features of dependencies, and with them what ./test.sh has built
targets=(--bin marathon-player --bin own_player --bin marathon --test imports_lead_down_the_stairs)
. tests/packages.sh
if [ -n "${MARATHON_TEST_GAME:-}" ]; then
  targets+=(--bin marathon-game)
fi
cargo build --release "${packages[@]}" "${targets[@]}"
bin="$(cargo metadata --format-version 1 --no-deps | "$python" -c 'import json, sys; print(json.load(sys.stdin)["target_directory"])')/release"
export MARATHON_PLAYER="$bin/marathon-player" OWN_PLAYER="$bin/own_player" MARATHON="$bin/marathon" MARATHON_GAME="$bin/marathon-game"
exec "$python" -m pytest --quiet -c tests/mlagents/pytest.ini tests/mlagents "$@"

#!/usr/bin/env bash
# Tests everything but the game, the packing of the wheel, the npm package and the page, and whether the fuzzers compile. `./test.sh
# --all` tests those as well, and compiles Bevy once. `./test.sh --long` adds what takes hours: tests/long.sh lists it.
#
# Sets up by itself what the tests need: Python environments with the oracles (MuJoCo, Gymnasium, dm_control, PyTorch) in
# .venv and with ML-Agents in .venv-mlagents; with --all and as root the Debian packages of the game. Needs a Rust toolchain
# with clippy and rustfmt, Python 3.11 with venv, and a C compiler.
set -euo pipefail
cd "$(dirname "$0")"
long=''
case "${1:-}" in
  '') game='' ;;
  --all) game=yes ;;
  --long) game=yes long=yes ;;
  *) echo "usage: ./test.sh [--all | --long], found '$1'" >&2 && exit 2 ;;
esac
if [ -n "$game" ]; then
  crates/game/tests/packages.sh
fi
export MARATHON_TEST_GAME="$game" MARATHON_TEST_WHEEL="$game"
. tests/packages.sh
if [ -z "${MARATHON_PYTHON:-}" ]; then
  if [ ! -x .venv/bin/python ]; then
    python3 -m venv .venv
  fi
  install=(tests/oracle/install.sh .venv/bin/python)
  "${install[@]}" --requirement tests/oracle/requirements.txt --requirement python/tests/requirements.txt
  .venv/bin/python tests/oracle/install_torch.py
  "${install[@]}" --no-deps --requirement python/tests/requirements-no-deps.txt
  .venv/bin/python tests/oracle/foreign_models.py --install
  export MARATHON_PYTHON="$PWD/.venv/bin/python"
fi
cargo fmt --all --check
"$MARATHON_PYTHON" tests/prose/check.py
if [ -n "$game" ]; then
  tests/types.sh
  tests/lanes/run.sh
  crates/wasm/test.sh
  web/test.sh --quick
fi
# lints and checks documentation while it compiles
export RUSTC_WORKSPACE_WRAPPER="$PWD/tests/lint.sh"
cargo build --release "${packages[@]}" "${all_targets[@]}"
cargo test --release "${packages[@]}" --tests
cargo test --release "${packages[@]}" --doc
# ML-Agents waits for its trainers most of the time, and so is tested beside the Python package
mlagents=$(mktemp)
tests/mlagents/run.sh > "$mlagents" 2>&1 &
beside=$!
trap 'kill "$beside" 2> /dev/null || true; rm -f "$mlagents"' EXIT
python/tests/run.sh
if [ -n "$game" ]; then
  MARATHON_PROGRAM="${CARGO_TARGET_DIR:-target}/release/marathon" web/test.sh --live
fi
passed=yes
wait "$beside" || passed=''
cat "$mlagents"
[ -n "$passed" ]
if [ -n "$long" ]; then
  unset RUSTC_WORKSPACE_WRAPPER
  tests/long.sh
fi

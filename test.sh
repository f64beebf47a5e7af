#!/usr/bin/env bash
# Runs all tests. Sets up what they need: a Python environment with the oracles (MuJoCo, Gymnasium, dm_control) in .venv.
set -euo pipefail
cd "$(dirname "$0")"
if [ -z "${MARATHON_PYTHON:-}" ]; then
  if [ ! -x .venv/bin/python ]; then
    python3 -m venv .venv
  fi
  .venv/bin/python -m pip install --quiet --requirement tests/oracle/requirements.txt
  export MARATHON_PYTHON="$PWD/.venv/bin/python"
fi
cargo fmt --all --check || echo "note: formatting differs"
cargo test --release --package marathon-physics

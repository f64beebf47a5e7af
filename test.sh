#!/usr/bin/env bash
# Runs every test. Sets up what they need by itself: a Python environment in .venv with the oracles (MuJoCo, Gymnasium,
# dm_control, PyTorch) and what tests the Python package, and one in .venv-mlagents with ML-Agents. Needs a Rust toolchain,
# Python 3.11 with venv, and a C compiler.
set -euo pipefail
cd "$(dirname "$0")"
if [ -z "${MARATHON_PYTHON:-}" ]; then
  if [ ! -x .venv/bin/python ]; then
    python3 -m venv .venv
  fi
  pip=(.venv/bin/python -m pip install --quiet --disable-pip-version-check)
  "${pip[@]}" --requirement tests/oracle/requirements.txt --requirement python/tests/requirements.txt
  .venv/bin/python tests/oracle/install_torch.py
  "${pip[@]}" --no-deps --requirement python/tests/requirements-no-deps.txt
  .venv/bin/python tests/oracle/foreign_models.py --install
  export MARATHON_PYTHON="$PWD/.venv/bin/python"
fi
cargo fmt --all --check
cargo clippy --release --workspace --all-targets -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --release --workspace --no-deps --quiet
cargo test --release --workspace
python/tests/run.sh
tests/mlagents/run.sh

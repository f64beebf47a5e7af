#!/usr/bin/env bash
# Runs every test. Sets up what they need by itself: a Python environment in .venv with the oracles (MuJoCo, Gymnasium,
# dm_control, PyTorch) and what tests the Python package, one in .venv-mlagents with ML-Agents, and as root the Debian packages
# of the game. Needs a Rust toolchain, Python 3.11 with venv, and a C compiler. MARATHON_NO_GAME=1 leaves the game and with it
# Bevy out.
set -euo pipefail
cd "$(dirname "$0")"
crates=(--workspace)
if [ -n "${MARATHON_NO_GAME:-}" ]; then
  crates+=(--exclude marathon-game)
else
  crates/game/tests/packages.sh
fi
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
# one pass over everything: a second one with other features compiles the physics again
cargo clippy --release "${crates[@]}" --all-targets -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --release "${crates[@]}" --no-deps --quiet
cargo test --release "${crates[@]}"
if [ -z "${MARATHON_NO_GAME:-}" ]; then
  # a workspace of its own, see its Cargo.toml
  props=crates/game/examples/avian_props/Cargo.toml
  cargo fmt --manifest-path "$props" --check
  cargo test --release --no-default-features --manifest-path "$props" --target-dir "${CARGO_TARGET_DIR:-target}"
fi
python/tests/run.sh
tests/mlagents/run.sh

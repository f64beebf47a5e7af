#!/usr/bin/env bash
# Builds the wheel, installs it into a clean environment as a user would, and tests it. Part of ./test.sh; the Python of
# MARATHON_PYTHON (or .venv) needs python/tests/requirements*.txt. Arguments go to pytest.
set -euo pipefail
cd "$(dirname "$0")/../.."
python="${MARATHON_PYTHON:-$PWD/.venv/bin/python}"
if ! "$python" -c "import maturin, mypy, pytest"; then
  echo "$python lacks what tests the package; run ./test.sh, which sets up .venv" >&2
  exit 1
fi
target="${CARGO_TARGET_DIR:-$PWD/target}"
wheels="$target/wheels" clean="$target/clean-venv" site="$target/python-site"

"$python" -m ruff check python examples/python
"$python" -m ruff format --check python examples/python
rm -rf "$wheels" "$clean" "$site"
"$python" -m maturin build --quiet --release --out "$wheels"

# a user's environment: the wheel and what it asks for
python3 -m venv "$clean"
"$clean/bin/pip" install --quiet --disable-pip-version-check "$wheels"/*.whl
(cd "$clean" && bin/python -c "import marathon_envs; marathon_envs.VecEnv('hopper', 2).reset()")
"$clean/bin/marathon" --json list > /dev/null

# the tests' environment stays as it is: the wheel is unpacked beside it
"$python" -m pip install --quiet --disable-pip-version-check --no-deps --target "$site" "$wheels"/*.whl
export PYTHONPATH="$site"
"$python" -m mypy python/marathon_envs
(cd "$site" && "$python" -m mypy.stubtest marathon_envs._native)
"$python" -m pytest --quiet "$@"

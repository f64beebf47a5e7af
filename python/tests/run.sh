#!/usr/bin/env bash
# Tests the Python package. Part of ./test.sh; the Python of MARATHON_PYTHON (or .venv) needs python/tests/requirements*.txt.
# MARATHON_TEST_WHEEL=1 builds the wheel as well and installs it into a clean environment, as a user would. Arguments go to
# pytest.
set -euo pipefail
cd "$(dirname "$0")/../.."
python="${MARATHON_PYTHON:-$PWD/.venv/bin/python}"
if ! "$python" -c "import maturin, mypy, pytest"; then
  echo "$python lacks what tests the package; run ./test.sh, which sets up .venv" >&2
  exit 1
fi
target="${CARGO_TARGET_DIR:-$PWD/target}"
wheels="$target/wheels" clean="$target/clean-venv" site="$target/python-site"

scripts=(python examples/python docs/*.py docs/generator tests/docs)
"$python" -m ruff check "${scripts[@]}"
"$python" -m ruff format --check "${scripts[@]}"

# the native module that ./test.sh has built: `--workspace` and a test among the targets keep the features of dependencies
. tests/packages.sh
cargo build --release "${packages[@]}" --lib --test imports_lead_down_the_stairs
rm -rf "$site"
mkdir -p "$site"
cp -R python/marathon_rl "$site"
cp "$target/release/libmarathon_python.so" "$site/marathon_rl/_native.abi3.so"
export PYTHONPATH="$site"
"$python" -m mypy python/marathon_rl
(cd docs && "$python" -m mypy --config-file ../pyproject.toml generate.py preprocess.py check_links.py)
(cd tests/docs && "$python" -m mypy --config-file ../../pyproject.toml ./*.py)
(cd "$site" && "$python" -m mypy.stubtest marathon_rl._native)
"$python" -m pytest --quiet "$@"
# the code blocks of all pages, and the generated pages
tests/docs/run.py --program "$target/release/marathon" --python "$python"
docs/generate.py --program "$target/release/marathon" --check

if [ -n "${MARATHON_TEST_WHEEL:-}" ]; then
  unset PYTHONPATH
  rm -rf "$wheels" "$clean"
  # the compiler has not seen this package alone: without optimization that costs a quarter
  "$python" -m maturin build --quiet --profile packing --out "$wheels"
  python3 -m venv "$clean"
  "$clean/bin/pip" install --quiet --disable-pip-version-check "$wheels"/*.whl
  (cd "$clean" && bin/python -c "import marathon_rl; marathon_rl.VecEnv('hopper', 2).reset()")
  "$clean/bin/marathon" --json list > /dev/null
fi

#!/usr/bin/env bash
# Installs Python packages: `tests/oracle/install.sh PYTHON ARGUMENTS`, with arguments that `pip install` knows. uv does it in a
# tenth of pip's processor time. pip does it where uv fails, since pip has settings that uv does not read.
set -euo pipefail
python="$1"
shift
pip=("$python" -m pip --quiet --disable-pip-version-check install)
if ! "$python" -m uv --version > /dev/null 2>&1; then
  "${pip[@]}" uv==0.13.9 || true
fi
# most of what is installed is never imported: no byte code
"$python" -m uv pip install --quiet --python "$python" "$@" || "${pip[@]}" --no-compile "$@"

#!/usr/bin/env bash
# Builds the page in dist/: static files that work from any folder of any host.
#
#   web/build.sh
#
# Needs Node 20.19 or later with npm. If the npm package of the physics has not been built, crates/wasm/build.sh builds it first,
# which needs Rust.
set -euo pipefail
cd "$(dirname "$0")"
for tool in node npm; do
  if ! command -v "$tool" > /dev/null; then
    echo "web/build.sh: $tool is missing; install Node 20.19 or later" >&2
    exit 1
  fi
done
package=../crates/wasm/npm/dist
for file in relaxed.wasm exact.wasm index.js; do
  if [ ! -e "$package/$file" ]; then
    ../crates/wasm/build.sh
    break
  fi
done
[ -d node_modules ] && [ node_modules -nt package-lock.json ] || npm ci --no-audit --no-fund --silent
npx vite build --logLevel warn
echo "web/build.sh: the page is in $PWD/dist" >&2

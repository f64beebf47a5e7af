#!/usr/bin/env bash
# Builds the page in dist/: static files that work from any folder of any host.
#
#   web/build.sh
#
# Needs Node 20.19 or later with npm. If the npm package of the physics has not been built, crates/wasm/build.sh builds it first,
# which needs Rust. MARATHON_MODULES=relaxed leaves out the module for browsers without relaxed SIMD.
set -euo pipefail
cd "$(dirname "$0")"
for tool in node npm; do
  if ! command -v "$tool" > /dev/null; then
    echo "web/build.sh: $tool is missing; install Node 20.19 or later" >&2
    exit 1
  fi
done
package=../crates/wasm/npm/dist
read -ra modules <<< "${MARATHON_MODULES:-relaxed exact}"
modules+=("${modules[@]/%/-play}")
for file in "${modules[@]/%/.wasm}" index.js; do
  if [ ! -e "$package/$file" ]; then
    ../crates/wasm/build.sh "${modules[@]}"
    break
  fi
done
if [ ! -d node_modules ] || [ node_modules -ot package-lock.json ]; then
  # npm 10 does not find the parts of Vite 8 for this system
  if [ "$(npm --version | cut -d. -f1)" -lt 11 ]; then
    npx --yes npm@11 ci --no-audit --no-fund --silent
  else
    npm ci --no-audit --no-fund --silent
  fi
fi
npx vite build --logLevel warn
echo "web/build.sh: the page is in $PWD/dist" >&2

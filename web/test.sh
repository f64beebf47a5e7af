#!/usr/bin/env bash
# Checks and tests the page: types, build, and browsers. Takes about 4 minutes.
#
#   web/test.sh            Chromium and Firefox
#   web/test.sh --quick    a part of the tests in Chromium, without the module for browsers without relaxed SIMD
#   web/test.sh --long     5 minutes of play in the memory test
#   MARATHON_PROGRAM=target/release/marathon web/test.sh --live    what `marathon serve` shows in Chromium
#
# Chromium is /usr/bin/chromium or $CHROMIUM, Firefox is /usr/bin/firefox-esr or $FIREFOX (and Xvfb, for WebGL). On Debian, root
# gets those that are missing. Tests of a browser that is missing are skipped. Pictures of every view are in test-pictures/.
set -euo pipefail
cd "$(dirname "$0")"
files=(tests/*.test.mjs)
names=()
packages=(chromium firefox-esr xvfb)
case "${1:-}" in
  '') ;;
  --quick)
    export MARATHON_MODULES=relaxed
    files=(tests/units.test.mjs tests/page.test.mjs)
    names=(--test-name-pattern='units|walker|aim|sideways|links|time|loads|bits|make no sense')
    packages=(chromium)
    ;;
  --live)
    MARATHON_PROGRAM="$(realpath "$OLDPWD/$MARATHON_PROGRAM" 2> /dev/null || realpath "$MARATHON_PROGRAM")"
    export MARATHON_PROGRAM MARATHON_MODULES=relaxed
    files=(tests/live.test.mjs)
    packages=(chromium)
    ;;
  --long) export MARATHON_LONG=1 ;;
  *) echo "usage: web/test.sh [--quick | --live | --long], found '$1'" >&2 && exit 2 ;;
esac
missing=()
for package in "${packages[@]}"; do
  command -v "${package/xvfb/Xvfb}" > /dev/null || missing+=("$package")
done
if [ "${#missing[@]}" != 0 ] && [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
  apt-get update -qq
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
fi
./build.sh
npx tsc --noEmit
. ../crates/wasm/node.sh
node $relaxed_flag --test --test-concurrency=1 --test-reporter=spec "${names[@]}" "${files[@]}"

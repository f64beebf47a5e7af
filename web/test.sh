#!/usr/bin/env bash
# Checks and tests the page: types, build, and browsers. Takes about 4 minutes.
#
#   web/test.sh [--long]    --long: 5 minutes of play in the memory test
#
# Chromium is /usr/bin/chromium or $CHROMIUM, Firefox is /usr/bin/firefox-esr or $FIREFOX (and Xvfb, for WebGL). Tests of a browser
# that is missing are skipped. Pictures of every view are in test-pictures/.
set -euo pipefail
cd "$(dirname "$0")"
[ "${1:-}" != --long ] || export MARATHON_LONG=1
./build.sh
npx tsc --noEmit
node --test --test-concurrency=1 --test-reporter=spec tests/

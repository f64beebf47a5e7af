#!/usr/bin/env bash
# Builds the site in target/site: the book, below api the pages of all crates but those for Bevy, and below play the web page.
set -euo pipefail
cd "$(dirname "$0")/.."
site=target/site
docs/serve.sh --build
crates=(marathon-physics marathon-motion marathon-envs marathon-learn marathon-render marathon-skin marathon-viewer marathon-config marathon-mlagents
  marathon-runs marathon-rl)
# pages of crates that are gone would stay
rm -rf "$site" target/api
RUSTDOCFLAGS='-D warnings' cargo doc --locked --no-deps --lib --target-dir target/api "${crates[@]/#/--package=}"
mkdir -p "$site"
cp -R target/book/. "$site/"
cp -R target/api/doc "$site/api"
rm -f "$site/api/.lock"
web/build.sh
rm -rf "$site/play"
cp -R web/dist "$site/play"
echo '<!DOCTYPE html><meta http-equiv="refresh" content="0; url=marathon_rl/index.html"><title>Marathon</title>' > "$site/api/index.html"
echo "$site" >&2

#!/usr/bin/env bash
# Checks that Cargo.toml, Cargo.lock, the npm package and CHANGELOG.md agree about the version, or sets it: release/version.sh [VERSION].
# MARATHON_TAG=v1.2.3 checks a tag as well.
set -euo pipefail
cd "$(dirname "$0")/.."
current=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
fail() { echo "release/version.sh: $*" >&2 && exit 1; }

if [ "$#" != 0 ]; then
  new="$1"
  [[ "$new" =~ ^[0-9]+\.[0-9]+\.[0-9]+(-[a-z0-9.]+)?$ ]] || fail "'$new' is no version; expected one like 0.2.0"
  # the version of the workspace, and those of the crates that it lists by path
  sed -i.old -e "s/^version = \"$current\"$/version = \"$new\"/" -e "/path = /s/version = \"$current\"/version = \"$new\"/" Cargo.toml
  rm Cargo.toml.old
  (cd crates/wasm/npm && npm version --no-git-tag-version --allow-same-version "$new" > /dev/null)
  cargo update --quiet --offline --workspace
  current="$new"
fi

wrong=$(grep -n 'path = ".*version = ' Cargo.toml | grep -v "version = \"$current\"" || true)
[ -z "$wrong" ] || fail "Cargo.toml has dependencies of another version than $current:"$'\n'"$wrong"
npm=$(sed -n 's/^  "version": "\(.*\)",$/\1/p' crates/wasm/npm/package.json)
[ "$npm" = "$current" ] || fail "crates/wasm/npm/package.json has version $npm, expected $current"
cargo metadata --locked --format-version 1 > /dev/null || fail 'Cargo.lock is out of date: cargo update --workspace'
if [ -n "${MARATHON_TAG:-}" ]; then
  [ "$MARATHON_TAG" = "v$current" ] || fail "the tag is $MARATHON_TAG, but the version $current"
  grep -qF "## [$current]" CHANGELOG.md || fail "CHANGELOG.md has no heading '## [$current] - DATE'"
fi
echo "version $current"

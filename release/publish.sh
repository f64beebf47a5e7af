#!/usr/bin/env bash
# Publishes the crates on crates.io, each after those that it needs: release/publish.sh [--dry-run].
#
# --dry-run packs and compiles all crates, and uploads nothing. Without it, crates of this version that are already published
# are skipped, so an interrupted run continues. Needs `cargo login` or CARGO_REGISTRY_TOKEN.
set -euo pipefail
cd "$(dirname "$0")/.."
crates=(marathon-assets marathon-configs marathon-policies marathon-physics marathon-motion marathon-envs marathon-learn marathon-render marathon-skin marathon-viewer marathon-config marathon-mlagents
  marathon-runs marathon-rl marathon-cli bevy_marathon marathon-game)
case "${1:-}" in
  '') dry='' ;;
  --dry-run) dry=yes ;;
  *) echo "usage: release/publish.sh [--dry-run], found '$1'" >&2 && exit 2 ;;
esac
python3 release/includes.py
release/version.sh
if [ -n "$dry" ]; then
  # together, so that crates find those that are not published yet
  exec cargo publish --dry-run --locked "${crates[@]/#/--package=}"
fi

version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
log=$(mktemp)
trap 'rm -f "$log"' EXIT
for crate in "${crates[@]}"; do
  if cargo info --quiet --registry crates-io "$crate@$version" > /dev/null 2>&1; then
    echo "$crate $version: already published" >&2
    continue
  fi
  # --dry-run has compiled it
  until cargo publish --locked --no-verify --package "$crate" 2>&1 | tee "$log"; do
    # crates.io takes five new names at once, and then one every ten minutes
    grep -q '429 Too Many Requests' "$log" || exit 1
    echo "$crate: crates.io asks for a pause; next try in ten minutes" >&2
    sleep 600
  done
done

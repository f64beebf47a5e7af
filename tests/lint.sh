#!/usr/bin/env bash
# Compiles a crate of the workspace, then lints it and checks its documentation against the metadata at hand. Cargo calls it
# in place of rustc where RUSTC_WORKSPACE_WRAPPER names it. `cargo clippy` and `cargo doc` want metadata of their own: they
# would compile every dependency a second time, Bevy among them.
set -euo pipefail
"$@"
crate='' kind='' test=''
for ((i = 2; i <= $#; i++)); do
  case "${!i}" in
    --crate-name) ((i++)) && crate="${!i}" ;;
    --crate-type) ((i++)) && kind="${!i}" ;;
    --test) test=yes ;;
  esac
done
# questions of Cargo's about the compiler
if [ -z "$crate" ] || [ "$crate" = ___ ]; then
  exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# the same arguments, but the products go elsewhere and are not announced
arguments=()
skip=''
for argument in "${@:2}"; do
  if [ -n "$skip" ]; then
    skip=''
    continue
  fi
  case "$argument" in
    --emit=*) ;;
    --out-dir) skip=yes ;;
    --json=*) arguments+=("--json=diagnostic-rendered-ansi") ;;
    *) arguments+=("$argument") ;;
  esac
done
clippy-driver "$1" "${arguments[@]}" --emit=metadata --out-dir "$scratch" -D warnings
if [ -z "$test" ] && [ "$kind" != bin ]; then
  rustdoc "${arguments[@]}" --out-dir "$scratch" -D warnings
fi

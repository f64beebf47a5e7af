#!/usr/bin/env bash
# Builds the documentation as a book in target/book and serves it on http://localhost:3000. `docs/serve.sh --build` builds it
# only, and fails on warnings. Installs mdBook into target/mdbook if there is none of this version. Needs Python 3.11 and, to install, Cargo.
set -euo pipefail
version=0.5.4
case "${1:-}" in
  '') action=serve ;;
  --build) action=build ;;
  *) echo "usage: docs/serve.sh [--build], found '$1'" >&2 && exit 2 ;;
esac
cd "$(dirname "$0")/.."
mkdir -p target/mdbook
mdbook=target/mdbook/bin/mdbook
if [ "$(mdbook --version 2> /dev/null)" = "mdbook v$version" ]; then
  mdbook=mdbook
elif [ "$("$mdbook" --version 2> /dev/null)" != "mdbook v$version" ]; then
  cargo install mdbook --locked --version "$version" --root target/mdbook --target-dir target/mdbook/build
fi
if [ "$action" = serve ]; then
  exec "$mdbook" serve docs
fi
"$mdbook" build docs 2>&1 | tee target/mdbook/log
# mdBook copies all files of the folder
rm -rf target/book/{book.toml,*.py,*.sh,generator,__pycache__}
if grep -q '^ *WARN' target/mdbook/log; then
  echo 'mdBook warns of pages that it cannot show as they are' >&2
  exit 1
fi

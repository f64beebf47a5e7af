#!/usr/bin/env bash
# Builds the files of a release into release/dist. `release/build.sh --help` lists the parts.
#
# A part that is already built from the same commit is skipped, so an interrupted build continues. All programs have the cargo
# feature `baseline`, the kernels for x86-64 processors without fused multiply-add.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$(pwd -W 2> /dev/null || pwd) # as C:/... on Windows
dist="$root/release/dist"
case "$(uname -s)" in
  Linux) parts=(sdist wheel-x86_64 wheel-aarch64 wheel-musl-x86_64 cli-x86_64 cli-aarch64 game-x86_64) ;;
  Darwin) parts=(wheel-macos-arm64 wheel-macos-x86_64 cli-macos-arm64 cli-macos-x86_64 game-macos-arm64 game-macos-x86_64) ;;
  *) parts=(wheel-windows-x86_64 cli-windows-x86_64 game-windows-x86_64) ;;
esac

usage() {
  cat <<TEXT
usage: release/build.sh [--force] [PART ...]

Without parts, builds all that this system can build:
  ${parts[*]}

The part checksums writes SHA256SUMS, and comes last by itself.

  --force   build parts again that are already built from this commit
TEXT
}

fail() {
  echo "release/build.sh: $*" >&2
  exit 1
}

# Platform of a part, as Rust calls it.
target() {
  case "$1" in
    wheel-x86_64 | game-x86_64) echo x86_64-unknown-linux-gnu ;;
    wheel-aarch64) echo aarch64-unknown-linux-gnu ;;
    wheel-musl-x86_64 | cli-x86_64) echo x86_64-unknown-linux-musl ;;
    cli-aarch64) echo aarch64-unknown-linux-musl ;;
    *-macos-arm64) echo aarch64-apple-darwin ;;
    *-macos-x86_64) echo x86_64-apple-darwin ;;
    *-windows-x86_64) echo x86_64-pc-windows-msvc ;;
  esac
}

force='' chosen=()
for word in "$@"; do
  case "$word" in
    -h | --help) usage && exit 0 ;;
    --force) force=yes ;;
    checksums) chosen+=("$word") ;;
    *)
      [[ " ${parts[*]} " == *" $word "* ]] || fail "no part '$word' on this system; there are: ${parts[*]} checksums"
      chosen+=("$word")
      ;;
  esac
done
if [ "${#chosen[@]}" = 0 ]; then
  chosen=("${parts[@]}")
fi

# tools, before anything is built
tools='pip install --require-hashes --requirement release/requirements.txt'
missing=()
need() { command -v "$1" > /dev/null || missing+=("$1: $2"); }
need cargo 'install Rust 1.95 with rustup'
python=$(command -v python3 || command -v python || true)
[ -n "$python" ] || missing+=('python3: install Python 3.11')
need git 'install Git'
installed=$(rustup target list --installed 2> /dev/null || true)
for part in "${chosen[@]}"; do
  case "$part" in
    wheel-* | sdist) need maturin "$tools" && need twine "$tools" ;;
  esac
  case "$part" in
    wheel-* | cli-*) [ -e web/dist/index.html ] || need npm 'install Node 20.19 or later' ;;
  esac
  case "$part" in
    cli-x86_64 | cli-aarch64) need cargo-zigbuild "$tools" ;;
  esac
  case "$part" in
    wheel-x86_64 | wheel-aarch64 | wheel-musl-* | cli-x86_64 | cli-aarch64)
      "$python" -m ziglang version > /dev/null 2>&1 || command -v zig > /dev/null || missing+=("zig: $tools")
      ;;
    game-x86_64) pkg-config --exists libudev 2> /dev/null || missing+=('libudev: sudo apt install pkg-config libudev-dev') ;;
  esac
  platform=$(target "$part")
  if [ -n "$platform" ] && [ -n "$installed" ] && ! grep -qx "$platform" <<< "$installed"; then
    missing+=("Rust for $platform: rustup target add $platform")
  fi
done
if [ "${#missing[@]}" != 0 ]; then
  printf '%s\n' "${missing[@]}" | sort -u | sed 's/^/  /' >&2
  fail 'install what is missing, and start again'
fi

version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
commit=$(git rev-parse HEAD)
if [ -n "$(git status --porcelain)" ]; then
  commit+='-changed'
  echo 'release/build.sh: the working tree has changes, so every part is built again' >&2
fi
SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)
export SOURCE_DATE_EPOCH
export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}/distribution"
export CARGO_PROFILE_RELEASE_STRIP=symbols
mkdir -p "$dist/.built"

# Programs do not contain the paths of this computer.
home="${CARGO_HOME:-$HOME/.cargo}" forbid=()
if [ "$(uname -s)" = Linux ] || [ "$(uname -s)" = Darwin ]; then
  flags="--remap-path-prefix=$root=marathon"$'\x1f'"--remap-path-prefix=$home=cargo"
  export CARGO_ENCODED_RUSTFLAGS="${CARGO_ENCODED_RUSTFLAGS:+$CARGO_ENCODED_RUSTFLAGS$'\x1f'}$flags"
  unset RUSTFLAGS
  export CFLAGS="${CFLAGS:-} -ffile-prefix-map=$root=marathon -ffile-prefix-map=$home=cargo"
  forbid=(--forbid "$root/" --forbid "$home/")
fi

notice=python/marathon_rl/THIRD-PARTY-LICENSES.txt page=python/marathon_rl/page
trap 'rm -rf "$notice" "$page"' EXIT

made=()
licenses() {
  "$python" release/licenses.py "$1" "$2" baseline > "$3"
}

# Builds the page that `marathon serve` shows, unless a complete one is there.
page() {
  local modules=(web/dist/wasm/*/{relaxed,exact-play}.wasm)
  [ -e "${modules[0]}" ] && [ -e "${modules[1]}" ] || web/build.sh
}

wheel() {
  local part="$1" platform work="$CARGO_TARGET_DIR/$1" options=()
  platform=$(target "$part")
  case "$part" in
    wheel-x86_64 | wheel-aarch64) options=(--zig --compatibility manylinux_2_17) ;;
    wheel-musl-x86_64) options=(--zig --compatibility musllinux_1_2) ;;
  esac
  rm -rf "$work"
  mkdir -p "$work"
  licenses marathon-python "$platform" "$notice"
  page
  rm -rf "$page"
  cp -R web/dist "$page"
  maturin build --release --locked --features baseline --target "$platform" --out "$work" ${options[@]+"${options[@]}"}
  rm -rf "$notice" "$page"
  twine check --strict "$work"/*.whl
  "$python" release/check.py ${forbid[@]+"${forbid[@]}"} "$work"/*.whl
  made=("$work"/*.whl)
}

sdist() {
  local work="$CARGO_TARGET_DIR/sdist"
  rm -rf "$work"
  maturin sdist --out "$work"
  twine check --strict "$work"/*.tar.gz
  "$python" release/check.py ${forbid[@]+"${forbid[@]}"} "$work"/*.tar.gz
  made=("$work"/*.tar.gz)
}

# Archive of programs: name, platform, package, further entries.
archive() {
  local name="$1" platform="$2" package="$3" ending=tar.gz work
  if [[ "$platform" == *windows* ]]; then
    ending=zip
  fi
  work="$CARGO_TARGET_DIR/$name-$platform"
  mkdir -p "$work"
  licenses "$package" "$platform" "$work/THIRD-PARTY-LICENSES.txt"
  made=("$work/$name-$version-$platform.$ending")
  "$python" release/pack.py "${made[0]}" LICENSE-MIT=LICENSE-MIT LICENSE-APACHE=LICENSE-APACHE CHANGELOG.md=CHANGELOG.md \
    "$work/THIRD-PARTY-LICENSES.txt=THIRD-PARTY-LICENSES.txt" "${@:4}"
}

cli() {
  local platform build=build exe='' static=()
  platform=$(target "$1")
  case "$platform" in
    *-linux-musl) build=zigbuild static=(--static) ;;
    *windows*) exe=.exe ;;
  esac
  cargo "$build" --release --locked --target "$platform" --package marathon-cli --package marathon-mlagents --bins \
    --features marathon-cli/baseline
  local programs="$CARGO_TARGET_DIR/$platform/release" file files=()
  page
  while IFS= read -r file; do
    files+=("web/dist/$file=page/$file")
  done < <(cd web/dist && find . -type f | sed 's#^\./##' | sort)
  archive marathon "$platform" marathon-cli crates/cli/README.md=README.md \
    "$programs/marathon$exe=marathon$exe" "$programs/marathon-player$exe=marathon-player$exe" "${files[@]}"
  "$python" release/check.py ${static[@]+"${static[@]}"} ${forbid[@]+"${forbid[@]}"} "${made[0]}"
}

game() {
  local platform exe='' file files=()
  platform=$(target "$1")
  if [[ "$platform" == *windows* ]]; then
    exe=.exe
  fi
  cargo build --release --locked --target "$platform" --package marathon-game --bin marathon-game --features baseline
  while IFS= read -r file; do
    files+=("$file=$file")
  done < <(git ls-files assets ':!*.rs' ':!*Cargo.toml')
  archive marathon-game "$platform" marathon-game crates/game/README.md=README.md \
    "$CARGO_TARGET_DIR/$platform/release/marathon-game$exe=marathon-game$exe" "${files[@]}"
  "$python" release/check.py ${forbid[@]+"${forbid[@]}"} "${made[0]}"
}

checksums() {
  local sum=(sha256sum) stamp
  for stamp in "$dist"/.built/*; do
    if [ -e "$stamp" ] && [ "$(head -n 1 "$stamp")" != "$commit" ]; then
      echo "release/build.sh: release/dist has $(basename "$stamp") of another commit" >&2
    fi
  done
  command -v sha256sum > /dev/null || sum=(shasum -a 256)
  (
    cd "$dist"
    rm -f SHA256SUMS
    files=(*)
    [ -e "${files[0]}" ] || fail 'release/dist is empty'
    "${sum[@]}" -- "${files[@]}" > .SHA256SUMS.part
    mv .SHA256SUMS.part SHA256SUMS
  )
}

count=0
for part in "${chosen[@]}"; do
  count=$((count + 1))
  stamp="$dist/.built/$part"
  if [ "$part" = checksums ]; then
    continue
  fi
  if [ -z "$force" ] && [ "${commit%-changed}" = "$commit" ] && [ "$(head -n 1 "$stamp" 2> /dev/null)" = "$commit" ] \
    && (cd "$dist" && tail -n +2 "$stamp" | while IFS= read -r file; do [ -e "$file" ] || exit 1; done); then
    echo "[$count/${#chosen[@]}] $part: already built" >&2
    continue
  fi
  echo "[$count/${#chosen[@]}] $part ..." >&2
  begin=$SECONDS
  case "$part" in
    wheel-*) wheel "$part" ;;
    cli-*) cli "$part" ;;
    game-*) game "$part" ;;
    sdist) sdist ;;
  esac
  # what this part made of another commit goes
  if [ -e "$stamp" ]; then
    tail -n +2 "$stamp" | while IFS= read -r file; do rm -f "$dist/${file:?}"; done
  fi
  cp "${made[@]}" "$dist/"
  {
    echo "$commit"
    for file in "${made[@]}"; do basename "$file"; done
  } > "$stamp.part"
  mv "$stamp.part" "$stamp"
  echo "[$count/${#chosen[@]}] $part: $((SECONDS - begin)) s, $(basename "${made[0]}")" >&2
done
checksums
cat "$dist/SHA256SUMS"

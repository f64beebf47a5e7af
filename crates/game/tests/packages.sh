#!/usr/bin/env bash
# Installs the Debian packages that the game is made, run and tested with, where one may; says which are missing otherwise.
set -euo pipefail
packages=(pkg-config libudev-dev libasound2-dev libvulkan1 mesa-vulkan-drivers libxkbcommon-x11-0 libx11-xcb1 libxcursor1 libxi6 libxrandr2
  xvfb xdotool imagemagick ffmpeg)
if ! command -v dpkg > /dev/null; then
  echo "the game needs what Debian calls: ${packages[*]}; ./test.sh without --all leaves the game out" >&2
  exit 0
fi
missing=()
for package in "${packages[@]}"; do
  dpkg -s "$package" > /dev/null 2>&1 || missing+=("$package")
done
if [ "${#missing[@]}" = 0 ]; then
  exit 0
fi
if [ "$(id -u)" = 0 ]; then
  as_root=()
elif command -v sudo > /dev/null && sudo -n true 2> /dev/null; then
  as_root=(sudo -n)
else
  echo "the game needs: sudo apt install ${missing[*]}; ./test.sh without --all leaves the game out" >&2
  exit 1
fi
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null

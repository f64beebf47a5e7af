# Sets `packages`, the arguments that tell Cargo what is tested: everything but the game, or with MARATHON_TEST_GAME everything.
# The same in all scripts: other packages would give dependencies other features, and have them compiled again.
# shellcheck shell=bash disable=SC2034
packages=(--workspace)
if [ -z "${MARATHON_TEST_GAME:-}" ]; then
  packages+=(--exclude marathon-game --exclude bevy_marathon --exclude avian_props)
fi

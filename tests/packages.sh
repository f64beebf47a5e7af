# Sets the arguments that tell Cargo what is tested: `packages`, everything but the game, or with MARATHON_TEST_GAME everything;
# `all_targets`, all but the examples that tests contain. The packages are the same in all scripts: others would give dependencies
# other features, and have them compiled again.
# shellcheck shell=bash disable=SC2034
# Avian compiles for minutes, for one example: tests/long.sh tests that
packages=(--workspace --exclude avian_props)
# not `--benches`, which compiles every library once more
all_targets=(--lib --bins --tests --bench '*' --example generate)
if [ -z "${MARATHON_TEST_GAME:-}" ]; then
  packages+=(--exclude marathon-game --exclude bevy_marathon)
else
  all_targets+=(--example headless_png --example cost_of_a_frame)
fi

#!/usr/bin/env bash
# Runs the Python tests with a wheel for 64-bit Arm on another processor, under qemu: tests/aarch64.sh WHEEL [pytest options].
#
# Needs Debian or Ubuntu with Python 3.11 packages, qemu-user-static, and .venv (./test.sh makes it). Packages for Arm are only
# unpacked, into target/aarch64. Tests that need PyTorch, ONNX Runtime, dm_control, Ray or a window are left out: their packages are not
# Marathon's, and qemu is about twenty times slower than a processor.
set -euo pipefail
cd "$(dirname "$0")/.."
[ $# -ge 1 ] && [ -f "$1" ] || { echo 'usage: tests/aarch64.sh WHEEL [pytest options]' >&2 && exit 2; }
wheel=$(realpath "$1")
shift
python="${MARATHON_PYTHON:-$PWD/.venv/bin/python}"
place="$(realpath "${CARGO_TARGET_DIR:-target}")/aarch64"
root="$place/root" site="$place/site"
command -v qemu-aarch64-static > /dev/null || { echo 'qemu-aarch64-static is missing: apt install qemu-user-static' >&2 && exit 1; }

# an Arm system of Python alone
if [ ! -x "$root/usr/bin/python3.11" ]; then
  mkdir -p "$place"/{lists,cache/archives}/partial "$place/debs"
  apt=(apt-get --quiet=2 -o APT::Architectures::=arm64 -o "Dir::State::Lists=$place/lists" -o "Dir::Cache=$place/cache"
    -o APT::Sandbox::User=root)
  "${apt[@]}" update
  packages=(python3.11-minimal libpython3.11-minimal libpython3.11-stdlib libc6 libexpat1 zlib1g libssl3 libffi8 libbz2-1.0
    liblzma5 libsqlite3-0 libgcc-s1 libstdc++6 libuuid1)
  (cd "$place/debs" && "${apt[@]}" download "${packages[@]/%/:arm64}")
  for file in "$place"/debs/*.deb; do
    dpkg -x "$file" "$root.part"
  done
  mv "$root.part" "$root"
fi

platforms=()
for glibc in 2_17 2_27 2_28; do
  platforms+=(--platform "manylinux_${glibc}_aarch64")
done
rm -rf "$site"
"$python" -m pip install --quiet --disable-pip-version-check --target "$site" --only-binary :all: --python-version 3.11 \
  --implementation cp --abi cp311 --abi abi3 --abi none "${platforms[@]}" --platform manylinux2014_aarch64 \
  "$wheel" pytest mujoco pettingzoo
# without MUJOCO_GL, MuJoCo starts a program to look for a window system, which qemu cannot
run=(qemu-aarch64-static -L "$root" -E "PYTHONPATH=$site" -E MUJOCO_GL=disable -E MARATHON_TEST_EMULATED=yes
  "$root/usr/bin/python3.11")
"${run[@]}" -c 'import marathon_rl, platform; print(platform.machine(), marathon_rl.__version__)'
left_out=()
for file in $(grep -lE '^(import|from) (torch|onnx|onnxruntime|dm_control|ray|stable_baselines3|rsl_rl|skrl)|importorskip|xdotool' python/tests/test_*.py); do
  left_out+=(--ignore "$file")
done
"${run[@]}" -m pytest --quiet -p no:cacheprovider "${left_out[@]}" "${@:-python/tests}"

# Sets `relaxed_flag`: Node 20 has relaxed SIMD behind a flag that later ones do not know.
# shellcheck shell=bash disable=SC2034
relaxed_flag=--experimental-wasm-relaxed-simd
node "$relaxed_flag" --eval '' 2> /dev/null || relaxed_flag=''

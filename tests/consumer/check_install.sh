#!/usr/bin/env bash
# Installs the build into a temporary prefix and uses it from outside: CMake and pkg-config, C and C++, shared and
# static. usage: check_install.sh BUILD_DIR
set -euo pipefail
build=$(realpath "$1")
here=$(dirname "$(realpath "$0")")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix

cmake --install "$build" --prefix "$prefix" >"$work/install.log" || { cat "$work/install.log"; exit 1; }
"$prefix/bin/hexopt-gpu" --version
grep -q -- 'max\\-deviation\\-rel' "$prefix"/share/man/man1/hexopt-gpu.1

# Completion knows the subcommands, the options of one and the names of samples.
complete_words() {
  PATH=$prefix/bin:$PATH bash -c 'source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _hexopt_gpu; echo "${COMPREPLY[*]}"' \
    "$prefix/share/bash-completion/completions/hexopt-gpu" "$@"
}
[ "$(complete_words hexopt-gpu opt)" = optimize ]
[ "$(complete_words hexopt-gpu optimize a b --max)" = --max-deviation-rel ]
[ "$(complete_words hexopt-gpu sample scr)" = scrambled-cube ]
[ "$(complete_words hexopt-gpu optimize --method "")" = "robust thesis" ]
[ "$(complete_words hexopt-gpu mesh --polyhedra y)" = yes ]
[ "$(cd "$here" && complete_words hexopt-gpu mesh main.cp)" = main.cpp ]

cmake -S "$here" -B "$work/consumer" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" >"$work/configure.log" ||
  { cat "$work/configure.log"; exit 1; }
cmake --build "$work/consumer"
for program in "$work"/consumer/c{,pp}_hexopt{,_static}; do "$program"; done

PKG_CONFIG_PATH=$(dirname "$(find "$prefix" -name hexopt.pc)")
export PKG_CONFIG_PATH
libdir=$(realpath "$PKG_CONFIG_PATH/..")
cc "$here/main.c" -o "$work/c_shared" $(pkg-config --cflags --libs hexopt) "-Wl,-rpath,$libdir"
"$work/c_shared"
leaked=$(nm -D --defined-only "$libdir/libhexopt.so" | awk '{print $3}' | grep -v '^hexopt_' || true)
[ -z "$leaked" ] || { echo "libhexopt.so shows more than its interface: $leaked"; exit 1; }
rm "$libdir"/libhexopt.so*
cc -DHEXOPT_STATIC "$here/main.c" -o "$work/c_static" $(pkg-config --static --cflags --libs hexopt)
"$work/c_static"

echo "installed and used"

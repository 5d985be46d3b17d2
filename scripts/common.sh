# shellcheck shell=bash
# Shared by the scripts of this repository: where things are, how to say things, how to start the engine.
# Sourced, never run. Every failure is one sentence with the remedy.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# The engine and the game as Debian installs them; a caller may point elsewhere.
ENGINE_DIR=${ENGINE_DIR:-/usr/lib/ioquake3}
GAME_DIR=${GAME_DIR:-/usr/lib/openarena}
GAME_DATA=${OPENARENA_DATA:-/usr/share/games/openarena/baseoa}
TARGET_DIR=${CARGO_TARGET_DIR:-$root/target}

say() { printf '%s\n' "$*"; }
step() { printf '\n== %s\n' "$*"; }
die() {
  printf '%s\n' "$*" >&2
  exit 1
}

# Machine name as ioquake3 spells it in the file names of its renderers.
engine_arch() {
  case $(uname -m) in
    x86_64) echo x86_64 ;;
    aarch64) echo arm64 ;;
    armv7l) echo arm ;;
    i?86) echo x86 ;;
    *) uname -m ;;
  esac
}

have_display() { [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; }

# A graphics processor that some Vulkan driver could drive (a render node, or NVIDIA's own device file).
have_gpu() { compgen -G '/dev/dri/renderD*' >/dev/null || [ -e /dev/nvidia0 ]; }

# Mesa's software Vulkan, whose file name carries the machine name in newer packages.
software_vulkan() {
  local icd
  for icd in /usr/share/vulkan/icd.d/lvp_icd.*json /usr/share/vulkan/icd.d/lvp_icd.json; do
    [ -e "$icd" ] && { echo "$icd"; return; }
  done
  return 1
}

# Selects Mesa's software Vulkan for what is started from here on, under the loader's new and old variable.
use_software_vulkan() {
  local icd
  icd=$(software_vulkan) || die "Mesa's software Vulkan is not installed; run scripts/setup test."
  export VK_DRIVER_FILES=$icd VK_ICD_FILENAMES=$icd
}

use_cargo() {
  command -v cargo >/dev/null 2>&1 || PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"
  command -v cargo >/dev/null 2>&1 ||
    die "Rust's cargo is not on the PATH: install it (https://rustup.rs), then run this again."
}

# engine_folder LIBRARY: a private folder in which the engine finds its own renderers and ours.
# ioquake3 looks for renderer_NAME_ARCH.so, since 2025 for renderer_NAME.so, in the folder of argv[0] before it looks
# elsewhere, so links are all it takes: no system folder is touched and nothing needs root. Prints the folder.
engine_folder() {
  local library=$1 folder=$TARGET_DIR/engine renderer
  [ -x "$ENGINE_DIR/ioquake3" ] || die "There is no ioquake3 in $ENGINE_DIR; run scripts/setup."
  mkdir -p "$folder"
  ln -sfn "$ENGINE_DIR/ioquake3" "$folder/ioquake3"
  for renderer in "$ENGINE_DIR"/renderer_*.so; do
    [ -e "$renderer" ] && ln -sfn "$renderer" "$folder/"
  done
  if [ -n "$library" ]; then
    [ -e "$library" ] || die "$library is not there; build it with: cargo build --release -p ffi"
    for renderer in vk "vk_$(engine_arch)"; do ln -sfn "$(realpath "$library")" "$folder/renderer_$renderer.so"; done
  fi
  echo "$folder"
}

# The options with which Debian's own `openarena` starts the engine.
game_options=(
  +set com_basegame baseoa
  +set fs_basepath "$GAME_DIR"
  +set com_homepath .openarena
  +set fs_homepath "$HOME/.openarena"
  +set com_legacyprotocol 71 +set com_protocol 71
  +set sv_master1 dpmaster.deathmask.net
  +set cl_motd 0
)

# map_names [PACK...]: names of the maps in packs, without any in the game's and the player's. A zip file keeps names
# uncompressed, so no unpacker is needed; what lies in a folder of another folder is not where the engine looks.
map_names() {
  [ $# -gt 0 ] || set -- "$GAME_DATA"/*.pk3 "$HOME"/.openarena/baseoa/*.pk3
  { LC_ALL=C grep -aoihE '[^/[:alnum:]_.-]maps/[a-z0-9_+.-]+\.bsp' -- "$@" 2>/dev/null || true; } |
    tr '[:upper:]' '[:lower:]' | tr -d '\0' | LC_ALL=C sed -e 's,^.*maps/,,' -e 's,\.bsp$,,' | sort -u
}

# check_pack FILE: exits with a message if a pack of the command line is unusable.
check_pack() {
  [ -e "$1" ] || die "There is no file $1; is its path right?"
  [ -f "$1" ] || die "$1 is no file; name one pack (.pk3)."
  [ -r "$1" ] || die "$1 cannot be read; use chmod +r."
  [ "$(head -c 2 -- "$1" | tr -d '\0')" = PK ] || die "$1 is no pack (a zip file named .pk3); download it again, or unpack the archive it came in."
  [ -n "$(map_names "$1")" ] || die "$1 has no maps where the game reads them, in a folder maps at its top; relight info '$1' lists its contents."
}

# game_with PACK FOLDER: makes FOLDER the game's folder for every engine that is started from here on: links to all that
# the game has, and to PACK under a name that comes last, so that its files win. Neither the game's folder nor the
# player's is touched.
game_with() {
  local pack folder=$2 file
  pack=$(realpath "$1")
  rm -rf "$folder"
  mkdir -p "$folder/baseoa"
  for file in "$GAME_DIR"/baseoa/*; do
    [ -e "$file" ] && ln -s "$file" "$folder/baseoa/"
  done
  ln -s "$pack" "$folder/baseoa/~given.pk3"
  export GAME_DIR=$folder
  game_options+=(+set fs_basepath "$folder")
}

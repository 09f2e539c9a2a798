# What scripts that build libcamera share, sourced by them after packages.sh. All of it works in the current folder.

# contents_of_libcamera SOURCE: prints what identifies a source: a folder, a git repository (its HEAD), an archive (.tar.*)
contents_of_libcamera() {
  if [ -f "$1" ]; then
    cat "$1"
  elif is_git "$1"; then
    git -C "$1" rev-parse HEAD
  else
    (cd "$1" && find . -path ./.git -prune -o -type f -print0 | LC_ALL=C sort -z | xargs -0 cat)
  fi
}
is_git() { git -C "$1" rev-parse --git-dir >/dev/null 2>&1 && [ ! -e "$1/meson.build" ]; }

# unpack_libcamera SOURCE: copies a source to the folder libcamera, and sets `version`
unpack_libcamera() {
  mkdir libcamera
  if [ -f "$1" ]; then
    tar -xf "$1" -C libcamera --strip-components=1
  elif is_git "$1"; then
    git -C "$1" archive HEAD | tar -x -C libcamera
  else
    cp -r "$1/." libcamera
  fi
  version=$(sed -n "s/^ *version *: *'\([^']*\)'.*/\1/p;T;q" libcamera/meson.build 2>/dev/null) || true
  [ -n "$version" ] || none "$1 is not libcamera's source"
  export GIT_CEILING_DIRECTORIES=$PWD  # the source is in no repository, whatever this folder is in
}

# get_libcamera_tools: makes the tools and headers that the build needs and that are not installed usable from a folder
get_libcamera_tools() {
  lacking meson ninja-build pkg-config python3-ply python3-jinja2 python3-yaml openssl \
    libyaml-dev libevent-dev libudev-dev libssl-dev >lacking
  [ -s lacking ] || return 0
  mapfile -t wanted <lacking
  fetch "${wanted[@]}"
  unpack tools
  local libraries packages
  libraries=$PWD/tools/usr/lib/$(gcc -print-multiarch)
  # Links to libraries that are installed already.
  mkdir -p "$libraries"
  find "$libraries" -xtype l | while read -r link; do
    ln -sf "/usr/lib/$(gcc -print-multiarch)/$(basename "$(readlink "$link")")" "$link"
  done
  # The build sets PYTHONPATH itself, so Python finds its packages as those of a user.
  export PATH=$PWD/tools/usr/bin:$PATH PYTHONUSERBASE=$PWD/tools/user
  packages=$(python3 -m site --user-site) || true
  mkdir -p "$(dirname "$packages")"
  ln -s "$PWD/tools/usr/lib/python3/dist-packages" "$packages"
  export CPATH=$PWD/tools/usr/include LIBRARY_PATH=$libraries PKG_CONFIG_PATH=$libraries/pkgconfig
}

# set_up_libcamera ARGUMENT...: configures the folder built with the simple pipeline and the software ISP on the CPU, and
# the arguments for meson. Options that a release does not know are left out.
set_up_libcamera() {
  local option options=() ipa=softisp
  for option in softisp-gpu=disabled lc-compliance=disabled qcam=disabled pycamera=disabled v4l2=false \
    documentation=disabled android=disabled tracing=disabled cam-output-kms=disabled cam-output-sdl2=disabled \
    cam-jpeg=disabled apps-output-dng=disabled libdw=disabled libunwind=disabled udev=enabled rpi-awb-nn=disabled; do
    ! grep -q "option('${option%=*}'" libcamera/meson*options.txt || options+=("-D$option")
  done
  [ -d libcamera/src/ipa/softisp ] || ipa=simple # up to 0.7.2
  meson setup built libcamera --prefix=/usr -Dwerror=false -Dpipelines=simple -Dipas=$ipa -Dtest=false \
    --wrap-mode=nodownload "${options[@]}" "$@" >meson.log 2>&1 || {
    echo "$(basename "$0"): meson: $(grep -E 'ERROR' meson.log | head -n 1)" >&2
    exit 1
  }
}

# build_libcamera [TARGET...]
build_libcamera() {
  ninja -C built "$@" >ninja.log 2>&1 || {
    grep -E 'error|FAILED' ninja.log | head -n 10 >&2
    exit 1
  }
}

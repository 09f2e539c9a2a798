# What fetches and builds from Debian's packages share, sourced by them. They install nothing.

# none WHY: ends the script; what it makes is not to be had here
none() {
  echo "$(basename "$0"): $1" >&2
  exit 77
}

# fetch PACKAGE[=VERSION]...: into the folder it is called in
fetch() {
  apt-get -q -o DPkg::Lock::Timeout=300 -o APT::Sandbox::User=root download "$@" >download.log 2>&1 ||
    none "apt-get download $* failed: $(tail -n 1 download.log); if the archive has moved on, apt-get update, and remove what was fetched before"
}

# lacking PACKAGE...: those of them, and of what they need, that apt would install
lacking() {
  apt-get install -s --no-install-recommends "$@" >install.log 2>&1 || none "no $*: $(tail -n 1 install.log)"
  sed -n 's/^Inst \([^ ]*\).*/\1/p' install.log
}

# unpack FOLDER: what was fetched
unpack() {
  for package in ./*.deb; do dpkg-deb -x "$package" "$1"; done
  rm ./*.deb
}

# fetch_source PACKAGE RELEASE: unpacks the source package of a release of Debian into a new folder of the one it is called
# in, whatever releases apt is configured for, from the archive that apt uses
fetch_source() {
  local archive options
  archive=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Origin: Debian' 'Label: Debian' | head -n 1)
  [ -n "$archive" ] || none "apt is configured for no archive of Debian"
  mkdir -p lists/partial
  echo "deb-src $archive $2 main" >sources.list
  options=(-q -o Dir::Etc::SourceList="$PWD/sources.list" -o Dir::Etc::SourceParts=- -o Dir::State::Lists="$PWD/lists"
    -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o APT::Sandbox::User=root)
  { apt-get "${options[@]}" update && apt-get "${options[@]}" --only-source source "$1"; } >source.log 2>&1 ||
    none "no source package $1 of $2 from $archive: $(grep -m 1 '^E:' source.log || tail -n 1 source.log)"
}

# What the scenarios share. Each is run by `sh -eu` in a folder of its own; the last line it says is why it failed.

fail() {
  echo "$*"
  exit 1
}

# unload DRIVER...: those that are loaded
unload() {
  for driver in "$@"; do if [ -e "/sys/module/$driver" ]; then rmmod "$driver"; fi; done
}

# vivid OPTION...: the kernel's test camera, anew
vivid() {
  unload vivid vimc
  modprobe vivid n_devs=1 "$@"
}

# control NAME=VALUE
control() { v4l2-ctl -d /dev/video0 -c "$1"; }

# vimc: the kernel's test camera behind the media controller, anew: video0 has what its Sensor A reads out
vimc() {
  unload vivid vimc
  modprobe vimc
  [ "$(cat /sys/class/video4linux/video0/name)" = "Raw Capture 0" ] || fail "video0 is $(cat /sys/class/video4linux/video0/name)"
}

# webcam API: video0, of the single-planar (1) or the multi-planar (2) kind; no text in its picture
webcam() {
  vivid node_types=0x1 num_inputs=1 input_types=0 multiplanar="$1"
  control osd_text_mode=2
}

# cable FOURCC SIZE FRAME: video0 sees, over HDMI, what v4l2-ctl sends to video1: that plain frame, again and again
cable() {
  vivid node_types=0x101 num_inputs=1 input_types=3 num_outputs=1 output_types=1 multiplanar=1
  # The first progressive timings of that size: kernels number them differently.
  timings=$(v4l2-ctl -d /dev/video0 --list-dv-timings | awk -v size="$2" '
    /Index:/ { number = $2 } /Active width:/ { width = $3 } /Active height:/ { height = $3 }
    /Frame format: progressive/ && !found && width "x" height == size { print number; found = 1 }')
  format="width=${2%x*},height=${2#*x},pixelformat=$1,field=none"
  v4l2-ctl -d /dev/video0 -c osd_text_mode=2 --set-dv-bt-timings index="$timings" --set-fmt-video="$format"
  v4l2-ctl -d /dev/video1 --set-dv-bt-timings index="$timings" --set-fmt-video-out="$format"
  control loop_video=1 || control hdmi_000_0_is_connected_to=2  # before and after Linux 6.11
  : >sender.log  # of an earlier cable: what is started below may empty it too late
  v4l2-ctl -d /dev/video1 --stream-out-mmap=4 --stream-count=100000 --stream-from="$3" --stream-loop >sender.log 2>&1 &
  wait_for "frames on the cable" grep -q '>>>>' sender.log
  killall -STOP v4l2-ctl  # the driver repeats the last frame it has, at less work
}

# uncable: ends what cable began
uncable() {
  killall -9 v4l2-ctl
  wait
}

# wait_for WHAT COMMAND...: until it succeeds, ten seconds at most
wait_for() {
  what=$1
  shift
  tries=0
  until "$@"; do
    tries=$((tries + 1))
    [ $tries -lt 100 ] || fail "waited 10 s for $what"
    sleep 0.1
  done
}

# capture OPTION...: the program that is tested; one that hangs is killed, which its exit code, 137, tells
capture() { timeout -s KILL 40 lowlux capture --v4l2 /dev/video0 "$@"; }

# wait_for_files FOLDER: for the first that an endless capture writes there
wait_for_files() { wait_for "frames in $1" has_files "$1"; }
has_files() { [ -n "$(ls "$1" 2>&- | grep '\.dng$')" ]; }

# whole_files FOLDER: nothing but DNGs of 640x480, all of one size, of which the last is read
whole_files() {
  sizes=$(stat -c %s "$1"/* | sort -u)
  [ "$(echo "$sizes" | wc -l)" -eq 1 ] || fail "$1: files of $(echo $sizes) bytes"
  last=$(ls -A "$1" | sort | tail -n 1)
  ls -A "$1" | grep -qv '^[^.].*\.dng$' && fail "$1: left $(ls -A "$1" | grep -v '^[^.].*\.dng$' | head -n 1)"
  /guest/frame_of_dng "$1/$last" whole.raw
  [ "$(wc -c <whole.raw)" -eq 614400 ] || fail "$1/$last holds $(wc -c <whole.raw) bytes, not 640x480 of 16 bits"
}

# frame FOURCC SIZE OUT.raw OPTION...: the samples of one captured frame
frame() {
  fourcc=$1 size=$2 out=$3
  shift 3
  rm -f frame.dng
  capture --format "$fourcc" --size "$size" --frames 1 -o frame.dng "$@" 2>frame.log || fail "$fourcc $size: $(tail -n 1 frame.log)"
  /guest/frame_of_dng frame.dng "$out"
}

# codes FRAME: each value its samples have
codes() { od -An -t u2 -w32 "$1" | tr -d '*' | tr -s ' ' '\n' | sort -u | tr -d '\n'; }

# same A B WHAT
same() { cmp -s "$1" "$2" || fail "$3"; }

# one_line_error CODE FILE WHAT: exit code 1, and one line on stderr that says why
one_line_error() {
  [ "$1" -eq 1 ] || fail "$3: exit code $1: $(tail -n 1 "$2")"
  [ "$(wc -l <"$2")" -eq 1 ] || fail "$3: $(wc -l <"$2") lines of errors, not one: $(tail -n 1 "$2")"
  echo "$3: $(cat "$2")"
}

# mark_as_set_up: devices, as udev would, for libcamera, which lists none otherwise
mark_as_set_up() {
  mkdir -p /run/udev/data
  for device in /sys/class/video4linux/*/dev /sys/bus/media/devices/*/dev; do echo I:1 >"/run/udev/data/c$(cat "$device")"; done
}

# What the scenarios of libcamera's software ISP share: the camera of make_simple_camera, cam, and what the stage reports.
stage=$(ls /usr/bin/liblowlux_stage.so*)

# simple_camera NAME=VALUE,...: the camera, loaded anew, with these controls of its sensor; $sensor is the sensor's node
simple_camera() {
  unload vivid vimc
  modprobe vimc
  mark_as_set_up
  sensor=/dev/$(basename "$(dirname "$(grep -lx 'Sensor A' /sys/class/video4linux/v4l-subdev*/name)")")
  v4l2-ctl -d "$sensor" -c "show_information=2,test_pattern=0,$1"
}

# cam_frames FOLDER FRAMES OPTION...: images and their raw frames. Rows have no padding, as 632x3 is a multiple of 8.
cam_frames() {
  folder=$1 frames=$2
  shift 2
  mkdir "$folder"
  LIBCAMERA_LOG_LEVELS=Debayer:DEBUG timeout -s KILL 50 cam -c 1 -s role=viewfinder,width=632,height=480,pixelformat=BGR888 \
    -s role=raw --capture="$frames" --metadata --file="$folder/#" "$@" >"$folder.log" 2>&1 ||
    fail "$folder: cam: exit code $?: $(tail -n 1 "$folder.log")"
  images=$(ls "$folder" | grep -c 'stream0-') || true
  [ "$images" -eq "$frames" ] || fail "$folder: $images images, not $frames"
}

# stage_log FILE: for each frame its number, time, black level of R, G and B, gains of R and B, exposure [EV]
stage_log() { sed -n 's/.*lowlux: frame \(.*\) black \(.*\) gains \(.*\) exposure \(.*\)/\1 \2 \3 \4/p' "$1"; }

# reported FOLDER: for each frame what replay_stage reads: files, then what stage_log has
reported() {
  stage_log "$1.log" |
    while read -r number rest; do
      name=$(printf '%06d' "$number")
      [ ! -e "$1/cam0-stream0-$name" ] || echo "$1/cam0-stream1-$name $1/replayed-$name $number $rest"
    done
}

# replay FOLDER: the images are, byte for byte, those that the stage makes of the raw frames
replay() {
  reported "$1" >"$1_list.log"
  [ "$(wc -l <"$1_list.log")" -eq "$frames" ] || fail "$1: the stage reported $(wc -l <"$1_list.log") frames of $frames"
  replay_stage "$stage" 640 480 632 480 1896 <"$1_list.log" 2>replay.log || fail "$1: $(cat replay.log)"
  for image in "$1"/cam0-stream0-*; do
    same "$image" "$1/replayed-${image##*-}" "$image is not what the stage makes of the raw frame"
  done
}

# metadata NAME FOLDER: the first value in each frame that has it
metadata() { sed -n "s/^\t$1 = \(\[ \)\?\([0-9.]*\).*/\2/p" "$2.log"; }

# mean_code RAW: of its upper rows, in hundredths
mean_code() {
  head -c 64000 "$1" | od -An -v -t u2 -w64 |
    awk '{ for (i = 1; i <= NF; i++) sum += $i; n += NF } END { printf "%d", 100 * sum / n }'
}

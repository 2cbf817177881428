#!/bin/sh
# Makes the pictures of the viewer in docs/viewer, on a virtual display:
#   sh scripts/pictures/viewer.sh target/release/camsim
# Needs a built camsim, Xvfb, xdotool and ImageMagick (installed with apt where they are missing), and a Vulkan driver.
set -eu
camsim=$(realpath "$1")
cd "$(dirname "$0")/../.."
repository=$PWD
. scripts/setup.sh
for pair in Xvfb:xvfb xdotool:xdotool import:imagemagick; do
    command -v "${pair%:*}" >/dev/null 2>&1 || apt_install "no ${pair%:*}" "${pair#*:}"
done
work=$(mktemp -d)
display=:$((50 + $$ % 40))
Xvfb "$display" -screen 0 1280x800x24 >/dev/null 2>&1 &
server=$!
viewer=
trap 'kill $viewer "$server"; rm -rf "$work"' EXIT
export DISPLAY="$display"
mkdir -p "$work/camsim"
sleep 1

# picture NAME SCENARIO SETTINGS [COMMAND OF XDOTOOL | sleep SECONDS]...: the window with these settings of the view, 20 s after its
# start, then after the commands.
picture() {
    name=$1
    printf '{"camsim":"(view:(%s),recent:[])"}' "$3" > "$work/camsim/app.ron"
    XDG_DATA_HOME=$work "$camsim" viewer "$2" 2>"$work/viewer.txt" &
    viewer=$!
    sleep 20
    shift 3
    for step in "$@"; do
        # Words of a command.
        # shellcheck disable=SC2086
        case $step in
        sleep*) $step ;;
        *) xdotool $step ;;
        esac
    done
    import -window root -strip +dither -colors 255 -define png:compression-level=9 "PNG8:$repository/docs/viewer/$name.png"
    kill "$viewer"
    wait "$viewer" 2>/dev/null || true
    viewer=
    say "docs/viewer/$name.png"
}

demo=$repository/assets/demo.toml
# The timeline at frame 60.
seek="mousemove 640 745"
picture wipe "$demo" 'compare:Wipe,a:Ideal,b:Photometric,tab:Pixel' "$seek" "click 1" "mousemove 700 480" "click 1" "sleep 6"
picture overlays "$demo" 'overlays:(grid:true,motion:true,rows:true),tab:Pixel' "$seek" "click 1" "mousemove 700 480" "click 1" "sleep 6"
picture errors "$demo" 'overlays:(error:true),tab:Plan' "$seek" "click 1" "sleep 8"
picture difference "$demo" 'compare:Difference,a:Photometric,b:Lens,tab:Pixel' "$seek" "click 1" "mousemove 700 480" "click 1" "sleep 6"
picture plots "$demo" 'tab:Plots' "$seek" "click 1" "sleep 4"
picture map "$demo" 'tab:Map' "$seek" "click 1" "sleep 4"
picture space "$demo" 'tab:Space' "$seek" "click 1" "sleep 4"
picture parameters "$demo" 'tab:Plan' "search --class camsim windowfocus" "mousemove 120 60" "click 1" "type coefficients" "sleep 6"
picture wide "$repository/benches/scenes/fisheye.toml" 'overlays:(grid:true,histogram:true),tab:Pixel' "mousemove 400 290" "click 1" "sleep 8"
cat > "$work/raw.toml" <<SCENARIO
[flight]
log = "$repository/assets/demo_flight.csv"
height = "msl"
window_s = [25.0, 29.0]
[camera]
size_px = [640, 480]
focal_px = [420.0, 420.0]
mount = { angles_deg = [0.0, -30.0, 0.0] }
sensor = { model = "imx250", mosaic = "rggb", white_e = 9000.0 }
shutter = { exposure_ms = 3.0, readout_ms = 20.0 }
[scene]
terrain = { dem = "$repository/assets/demo_dem.tif", ortho = "$repository/assets/demo_ortho.jpg", height = "msl" }
sky = [0.74, 0.83, 0.92]
SCENARIO
picture raw "$work/raw.toml" 'zoom:Some(8.0),centre:(0.7,0.3),overlays:(raw:true,histogram:true),tab:Pixel' "mousemove 600 380" "click 1" "sleep 6"

#!/bin/sh
# Renders the demo in eight shards on a Slurm of one node, kills one on the way, submits again, and compares the joined
# frames with those of one run. Installs Slurm and munge from Debian's packages and starts them without systemd. Needs
# root, since munge and slurmd do.
#   sh scripts/slurm-test.sh [FOLDER]     default: a temporary folder, which is removed
set -eu
cd "$(dirname "$0")/.."
. scripts/setup.sh

[ "$(id -u)" = 0 ] || { say "slurm-test: skipped, munge and slurmd must be started by root"; exit 0; }
if ! command -v slurmctld >/dev/null || ! command -v slurmd >/dev/null || ! command -v munged >/dev/null; then
    apt_install "there is no Slurm" slurmctld slurmd slurm-client munge
fi

if [ $# -gt 0 ]; then
    work=$1
    mkdir -p "$work"
    work=$(cd "$work" && pwd)
    daemons=$(mktemp -d)
    trash=$daemons
else
    work=$(mktemp -d)
    daemons=$work/slurm
    mkdir "$daemons"
    trash=$work
fi
stop() {
    for name in slurmctld slurmd munged; do
        [ ! -f "$daemons/$name.pid" ] || kill "$(cat "$daemons/$name.pid")" 2>/dev/null || true
    done
    sleep 1
    rm -rf "$trash"
}
trap stop EXIT INT TERM

# munge: a key and a socket of its own.
chmod 755 "$daemons"
dd if=/dev/urandom of="$daemons/munge.key" bs=128 count=1 2>/dev/null
chmod 400 "$daemons/munge.key"
munged --force --key-file="$daemons/munge.key" --socket="$daemons/munge.socket" --pid-file="$daemons/munged.pid" \
    --log-file="$daemons/munged.log" --seed-file="$daemons/munge.seed"

node=$(hostname -s)
mkdir "$daemons/state" "$daemons/spool"
cat > "$daemons/slurm.conf" <<CONF
ClusterName=camsim
SlurmctldHost=$node(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket=$daemons/munge.socket
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
SlurmctldPort=26817
SlurmdPort=26818
SlurmctldPidFile=$daemons/slurmctld.pid
SlurmdPidFile=$daemons/slurmd.pid
SlurmctldLogFile=$daemons/slurmctld.log
SlurmdLogFile=$daemons/slurmd.log
StateSaveLocation=$daemons/state
SlurmdSpoolDir=$daemons/spool
ProctrackType=proctrack/pgid
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=2
MinJobAge=300
NodeName=$node NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$node Default=YES MaxTime=INFINITE State=UP
CONF
SLURM_CONF=$daemons/slurm.conf
export SLURM_CONF
slurmctld
slurmd
for _ in $(seq 30); do
    sinfo -h -o %T 2>/dev/null | grep -q idle && break
    sleep 1
done
say "node $node: $(sinfo -h -o '%T, %c processors, Slurm' | head -1) $(sinfo --version | cut -d' ' -f2)"

camsim=${CAMSIM:-}
if [ -z "$camsim" ]; then
    cargo build --release
    camsim=${CARGO_TARGET_DIR:-target}/release/camsim
fi
camsim=$(realpath "$camsim")
rm -rf "$work/job" "$work/one" "$work/scene"
"$camsim" -q demo -o "$work/scene" >/dev/null
scenario=$work/scene/scene/demo.toml
"$camsim" -q cluster slurm "$scenario" -N 8 -o "$work/job" --cpus 1 --frames 0..80 -- --backend cpu --format png

"$work/job/submit.sh"
# The first task that runs is killed with all its processes while it renders.
for _ in $(seq 60); do
    first=$(find "$work/job/shards" -name 'frame_*.png' 2>/dev/null | head -1)
    [ -n "$first" ] && break
    sleep 1
done
victim=$(squeue -h -t RUNNING -o %i | head -1)
scancel --signal=KILL --full "$victim"
say "killed task $victim"
wait_for_jobs() {
    for _ in $(seq 300); do
        [ -z "$(squeue -h -o %i)" ] && return
        sleep 1
    done
    say "the jobs did not end"; squeue; exit 1
}
wait_for_jobs
[ ! -e "$work/job/frames/run.json" ] || { say "merged although a shard was killed"; exit 1; }
say "submitted again"
"$work/job/submit.sh"
wait_for_jobs
[ -f "$work/job/frames/run.json" ] || { cat "$work/job"/log-*.txt; say "not merged"; exit 1; }

"$camsim" -q render "$scenario" -o "$work/one" --backend cpu --format png --frames 0..80 >/dev/null
differences=$(cd "$work/one" && find . -type f ! -name run.json ! -name '.*' | while read -r file; do
    cmp -s "$file" "$work/job/frames/$file" || echo "$file"
done)
[ -z "$differences" ] || { say "these files differ from those of one run:" $differences; exit 1; }
files=$(cd "$work/one" && find . -type f ! -name '.*' | wc -l)
[ "$files" = "$(cd "$work/job/frames" && find . -type f ! -name '.*' | wc -l)" ] || { say "the numbers of files differ"; exit 1; }
say "8 shards, one killed: $files files, all equal to those of one run"

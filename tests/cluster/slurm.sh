#!/bin/sh
# Blind tests in chunks on a real SLURM of this machine, compared with one job without it; and an array of diagnoses that
# is cancelled and submitted again, with a command in place of `rotorstudy` that costs nothing. On request, as root:
#   apt-get install slurm-wlm munge; pip install snakemake-executor-plugin-slurm; tests/cluster/slurm.sh [PYTHON]
# PYTHON (default .venv/bin/python) has rotorstudy, Snakemake and that plugin. Daemons and files are removed at the end.
set -eu
project=$(cd "$(dirname "$0")/../.." && pwd)
python=${1:-$project/.venv/bin/python}
work=$(mktemp -d)
conf=/etc/slurm/slurm.conf # where the steps of a job seek it too
[ ! -e $conf ] || { echo "error: $conf exists; this machine has a SLURM of its own"; exit 1; }
export PYTHONPATH="$project/src"
stop() {
    rm -f $conf
    for name in slurmd slurmctld munged; do
        [ ! -f "$work/$name.pid" ] || kill "$(cat "$work/$name.pid")" || true
    done
}
trap stop EXIT

[ -f /etc/munge/munge.key ] || { head -c 1024 /dev/urandom > /etc/munge/munge.key; chown munge /etc/munge/munge.key; chmod 400 /etc/munge/munge.key; }
mkdir -p /run/munge && chown munge /run/munge && chmod 755 "$work"
touch "$work/munged.pid" && chown munge "$work/munged.pid"
runuser -u munge -- munged --force --pid-file="$work/munged.pid"
mkdir -p /etc/slurm
cat > $conf << END
ClusterName=one
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/linux
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
MpiDefault=none
ReturnToService=2
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
NodeName=$(hostname) NodeAddr=127.0.0.1 CPUs=$(nproc) RealMemory=8000 State=UNKNOWN
PartitionName=debug Nodes=$(hostname) Default=YES State=UP
END
mkdir -p "$work/state" "$work/spool"
slurmctld
slurmd
sleep 3
sinfo

mkdir "$work/bin"
cat > "$work/bin/rotorstudy" << 'END'
#!/bin/sh
echo "$3" >> "$LOG" && mkdir -p "$7" && touch "$7/verdict.nc" # --quiet diagnose RECORD --rig RIG --out FOLDER
END
chmod +x "$work/bin/rotorstudy"
seq -f run_%05g.nc 10000 > "$work/list"
LOG="$work/log" PATH="$work/bin:$PATH"
export LOG PATH
array() { sbatch --parsable --mem=10 --output=/dev/null --array=0-199 "$project/profiles/slurm/diagnose.sh" rig.yaml "$work/list" "$work/out"; }
first=$(array)
while [ "$(cat "$LOG" 2>&1 | wc -l)" -lt 3000 ]; do sleep 1; done
scancel "$first"
while [ -n "$(squeue --noheader)" ]; do sleep 1; done
echo "$(find "$work/out" -name verdict.nc | wc -l) of 10000 diagnosed when the array was cancelled"
array
while [ -n "$(squeue --noheader)" ]; do sleep 1; done
sort "$LOG" | uniq --count | awk '{ done++; twice += $1 > 1 } END { print done " records diagnosed, " twice " of them twice, as the first was cancelled"; exit done != 10000 }'

sed 's/^cases: .*/cases: 5/' "$project/workflow/config/test/blind.yaml" > "$work/blind.yaml"
for chunks in 1 3; do
    printf 'results: results\nreference: workflow/reference\nblind: %s\nchunks: {blind: %s}\n' "$work/blind.yaml" $chunks > "$work/chunks_$chunks.yaml"
done
snake() { (cd "$project" && "$python" -m snakemake --directory "$work/$1" --configfile "$work/$1.yaml" "$2" "$3" results/blind/blind.nc); }
snake chunks_1 --cores 1
snake chunks_3 --profile "$project/profiles/slurm"

"$python" - "$work" << 'END'
import json, sys
from pathlib import Path
import xarray as xr

one, three = (Path(sys.argv[1]) / f"chunks_{n}" / "results" / "blind" for n in (1, 3))
first, second = (xr.open_dataset(folder / "blind.nc").drop_vars("case_seconds") for folder in (one, three))
xr.testing.assert_equal(first, second)
for name in ("seals.json", "truths.json"):
    assert (one / name).read_text() == (three / name).read_text(), name
seconds = [case["seconds"] for case in json.loads((three / "verdicts.json").read_text())]
print(f"{len(seconds)} cases in 3 chunks on SLURM are those of one job; {sum(seconds) / len(seconds):.2f} s a case")
END
rm -r "$work/chunks_1" "$work/chunks_3"
echo "logs in $work"

#!/bin/sh
# Diagnose thousands of records by an array of SLURM, each in a folder of its own:
#   sbatch --array=0-199 profiles/slurm/diagnose.sh RIG LIST OUT
# LIST is a text file with a record in each line. Task i of n takes lines i + 1, i + 1 + n, and so on. The same command
# again goes on after scancel, an expired time limit or an error: it leaves out what has a verdict.
#SBATCH --cpus-per-task=1
#SBATCH --mem=2000
rig=$1 list=$2 out=$3
sed -n "$((SLURM_ARRAY_TASK_ID + 1))~${SLURM_ARRAY_TASK_COUNT}p" "$list" | {
    failed=0
    while IFS= read -r record; do
        folder=$out/$(basename "$record")
        [ -e "$folder/verdict.nc" ] ||
            rotorstudy --quiet diagnose "$record" --rig "$rig" --out "$folder" < /dev/null || failed=1
    done
    exit $failed
}

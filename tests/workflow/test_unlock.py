"""After a kill a plain `make` goes on; a run that is at work keeps its lock."""

import subprocess
import sys

import pytest


@pytest.mark.parametrize("name", ["snakemake", "another"])
def test_the_lock_of_a_dead_run_is_removed_and_that_of_a_living_one_kept(name, tmp_path, request):
    lock = tmp_path / ".snakemake" / "locks" / "0.output.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("results/a.nc\n")
    waiting = [sys.executable, "-c", "import time; print(flush=True); time.sleep(60)", name]
    with subprocess.Popen(waiting, cwd=tmp_path, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        call = [sys.executable, str(request.config.rootpath / "workflow" / "unlock.py")]
        said = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True).stderr
        process.kill()
    assert lock.exists() == (name == "snakemake") and said.startswith("locked" if lock.exists() else "unlocked")
    assert (str(process.pid) in said) == lock.exists()

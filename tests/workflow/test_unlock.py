"""After a kill a plain `make` goes on; a run that is at work keeps its lock."""

import os
import subprocess
import sys
import time

import pytest


@pytest.mark.parametrize("name", ["snakemake", "another"])
def test_the_lock_of_a_dead_run_is_removed_and_that_of_a_living_one_kept(name, tmp_path, request):
    lock = tmp_path / ".snakemake" / "locks" / "0.output.lock"
    lock.parent.mkdir(parents=True)
    lock.write_text("results/a.nc\n")
    waiting = [sys.executable, "-c", "import time; print(flush=True); time.sleep(600)", name]
    with subprocess.Popen(waiting, cwd=tmp_path, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        call = [sys.executable, str(request.config.rootpath / "workflow" / "unlock.py")]
        said = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True).stderr
        process.kill()
    assert lock.exists() == (name == "snakemake") and said.startswith("locked" if lock.exists() else "unlocked")
    assert (str(process.pid) in said) == lock.exists()


def test_files_from_the_future_get_the_date_of_now_and_no_others(tmp_path, request):
    (tmp_path / "results").mkdir()
    early, late = tmp_path / "results" / "early.nc", tmp_path / "results" / "late.nc"
    for path, seconds in ((early, -3600), (late, 86400)):
        path.write_text(path.name)
        os.utime(path, (time.time() + seconds,) * 2)
    before = early.stat().st_mtime
    call = [sys.executable, str(request.config.rootpath / "workflow" / "unlock.py")]
    said = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, timeout=600, check=True).stderr
    assert said.startswith("dated in the future") and ": 1 files" in said and early.stat().st_mtime == before
    assert abs(late.stat().st_mtime - time.time()) < 60

"""Mend what a killed run, or a clock that went back, left in this folder: python workflow/unlock.py

The lock of Snakemake does not say whose it is. It is left alone while a process of Snakemake works in the folder.
"""

import os
import sys
import time
from pathlib import Path

import psutil


def at_work(folder):
    """Numbers of the processes of Snakemake, the workflow or one of its jobs, in a folder."""
    found = []
    for process in psutil.process_iter(["pid", "cmdline", "cwd"]):
        names = [Path(part).name for part in (process.info["cmdline"] or [])[:4]]
        if "snakemake" in names and process.info["cwd"] == str(folder):
            found.append(process.info["pid"])
    return found


def unlock(folder):
    """Remove the lock of a folder, if nothing works there; a sentence on what was done, or "" if there is no lock."""
    locks = sorted(Path(folder, ".snakemake", "locks").glob("*.lock"))
    if not locks:
        return ""
    if running := at_work(folder):
        return f"locked: Snakemake works here (process {', '.join(map(str, running))}); wait for it, or end it"
    for lock in locks:
        lock.unlink()
    return "unlocked: the last run was killed; what it was writing is made again"


def dated_now(folder):
    """Give files from the future the time of now, else Snakemake refuses all results; what was done, or ""."""
    now, count = time.time(), 0
    for place, folders, files in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        for path in (os.path.join(place, name) for name in files):
            if os.lstat(path).st_mtime > now + 1 and not os.path.islink(path):
                os.utime(path, (now, now))
                count += 1
    said = f"dated in the future, as if the clock had gone back: {count} files; now they have the date of today"
    return said * (count > 0)


if __name__ == "__main__":
    here = Path.cwd().resolve()
    for said in filter(None, (unlock(here), dated_now(here))):
        print(said, file=sys.stderr)

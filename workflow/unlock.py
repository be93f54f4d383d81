"""Remove the lock that a killed run of the workflow left in this folder: python workflow/unlock.py

The lock of Snakemake does not say whose it is. It is left alone while a process of Snakemake works in the folder.
"""

import sys
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


if __name__ == "__main__":
    if said := unlock(Path.cwd().resolve()):
        print(said, file=sys.stderr)

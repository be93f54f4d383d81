"""Write a rig file, or a working plugin file, to start from."""

import shlex

from rotorstudy.errors import RotorstudyError


def add(parser):
    parser.add_argument("kind", help="rig; or of a plugin: rotor, crack, depth, bearing, effect, spectrum, estimator")
    parser.add_argument("name", help="name of the rig or plugin, and of its file")
    parser.add_argument("--records", nargs="+", default=(), help="of a rig: record files, which show how to read them")
    parser.add_argument("--ross", metavar="MODEL", help="of a rig: a rotor saved by ROSS (.toml or .json)")
    told = "output folder (default: for a rig the current one, for a plugin that of its kind or rotorstudy_plugins)"
    parser.add_argument("--folder", help=told)


def run(given):
    """Write the file."""
    if given.kind == "rig":
        return _rig(given)
    from rotorstudy.authoring.files import new_plugin

    if given.records or given.ross:
        raise RotorstudyError(f"new {given.kind}: --records and --ross are for `new rig`")
    path = new_plugin(given.kind, given.name, given.folder)
    print(f"wrote {path}; edit it, then: rotorstudy check {path}")
    return {"file": str(path)}


def _rig(given):
    """Write a rig file and the picture of its probes."""
    from rotorstudy.authoring.new_rig import new_rig
    from rotorstudy.presentation.probe_figures import draw_probes

    path, guessed, changed = new_rig(given.name, given.folder, given.records, given.ross)
    picture = draw_probes(path, path.with_name(f"{path.stem}_probes.png"))
    for title, lines in (
        ("different from the rotor of ROSS", changed),
        ("guessed from the records; confirm or correct it in the section `measurement:`", guessed),
    ):
        if lines:
            print("\n  ".join([f"{title}:", *map(str, lines)]))
    print(f"wrote {path}" + (f" and the picture of its probes, {picture}" if picture else ""))
    shown, rig = shlex.join(map(str, given.records)) or "RECORDS", shlex.quote(str(path))
    print(f"next: rotorstudy check {rig}; rotorstudy import {shown} --rig {rig} --out spectrum.nc")
    return {"file": str(path), "probes": picture and str(picture), "guessed": list(guessed), "different": list(changed)}

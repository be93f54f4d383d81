"""The measurement of a case as files in the format of measured records."""

import numpy as np

from rotorstudy.store import dataset, save, write_text


def write_records(case, folder):
    """Write rig.yaml and one NetCDF record per speed to a folder (Path); returns the paths of the records."""
    import yaml

    rig = {**case.rig, "measurement": {"harmonics": [int(n) for n in case.spectrum.harmonics]}}
    write_text(folder / "rig.yaml", yaml.safe_dump(rig, sort_keys=False))
    paths = []
    for i, record in enumerate(case.records):
        shown = np.stack([record.displacement.real, record.displacement.imag], axis=1)[None]
        marks = np.arange(0, record.time[-1], 2 * np.pi / record.speed)
        variables = {
            "displacement": (("speed", "node", "direction", "time"), shown, "m", "displacement of the shaft"),
            "phase_mark_time": (("speed", "revolution"), marks[None], "s", "instants at which the phase mark passes"),
        }
        coordinates = {
            "speed": ([record.speed], "rad/s", "nominal spin speed"),
            "node": (list(record.sensors), "1", "node"),
            "direction": (["x", "y"], "1", "direction of the probe"),
            "time": (record.time, "s", "time"),
        }
        paths.append(folder / f"record_{i}.nc")
        save(dataset(variables, coordinates, title=record.where), paths[-1])
    return paths

"""Simulate records of the steady state of a rig (NetCDF)."""

from rotorstudy.commands.shared import NETCDF, add_rpm, check_file, in_rad_s
from rotorstudy.errors import RotorstudyError
from rotorstudy.units import spin

HARMONICS = (0, 1, 2, 3, 5, 7, -1, -3, -5)  # of the reference signal
LARGEST_DISPLACEMENT = 1.0  # m, of a rotor whose length is not known
MOST_SAMPLES = 20_000_000  # per record, about a gigabyte of memory


def add(parser):
    parser.add_argument("rig", help="rig file (YAML) with a value for every parameter")
    parser.add_argument("--speeds", type=float, nargs="+", required=True, metavar="RAD_S", help="spin speeds in rad/s")
    add_rpm(parser)
    parser.add_argument("--harmonics", type=int, nargs="+", default=HARMONICS, help="harmonics of the reference signal")
    told = "length of each record in s (default 1)"
    parser.add_argument("--duration", type=float, default=1.0, metavar="S", help=told)
    parser.add_argument("--rate", type=float, default=10000.0, metavar="HZ", help="samples per second (default 10000)")
    told = "white noise in percent of the rms displacement"
    parser.add_argument("--noise", type=float, default=0.0, metavar="PERCENT", help=told)
    parser.add_argument("--seed", type=int, default=0, help="random seed of the noise (default 0)")
    parser.add_argument("--out", required=True, help="NetCDF file to write")


def run(given):
    """Simulate and write the records."""
    import numpy as np

    from rotorstudy.measurement.records import check_length_of_record, records_dataset
    from rotorstudy.model.rig import read_rig
    from rotorstudy.response.coupling import check_speed
    from rotorstudy.store import provenance, save_along

    for name, value in (("--duration", given.duration), ("--rate", given.rate)):
        if not 0 < value < np.inf:
            raise RotorstudyError(f"{name} {value:g}: must be positive and finite")
    if not 0 <= given.noise < np.inf or given.seed < 0:
        raise RotorstudyError(f"--noise {given.noise:g} --seed {given.seed}: must be finite and not negative")
    if given.duration * given.rate > MOST_SAMPLES:
        raise RotorstudyError(
            f"--duration {given.duration:g} at --rate {given.rate:g}: more than {MOST_SAMPLES:.0e} samples per speed; "
            "shorten the record or reduce the rate"
        )
    check_file(given.out, given.rig, suffixes=NETCDF)
    rig = read_rig(given.rig)
    model = rig.model  # refuses what is wrong in the file
    time = np.arange(round(given.duration * given.rate)) / given.rate
    speeds = check_speed(in_rad_s(given.speeds, given.rpm))
    for speed in speeds:  # before anything is computed
        where = f"simulated record at {speed:g} rad/s"
        check_length_of_record(speed, len(time), 1 / given.rate, given.harmonics, where)
    attributes = provenance(rig.given, rig.plugins, given.seed if given.noise else None)
    records = _noisy_records(model, speeds, time, given)
    save_along((records_dataset([one]).assign_attrs(attributes) for one in records), given.out, "speed")
    print(f"wrote {len(speeds)} record(s) of {len(time)} samples to {given.out}")
    return {"records": str(given.out), "speeds_rad_per_s": [float(speed) for speed in speeds]}


def _noisy_records(model, speeds, time, given):
    """The records, one after another; RotorstudyError for a displacement that no rotor of this size can have."""
    import numpy as np

    from rotorstudy.measurement.noise import standard_normal
    from rotorstudy.measurement.records import check_record, each_record

    longest = model.structure.length or LARGEST_DISPLACEMENT
    for i, record in enumerate(each_record(model, speeds, given.harmonics, time)):
        check_record(record, given.harmonics)
        if (reached := float(np.abs(record.displacement).max())) > longest:
            raise RotorstudyError(
                f"{given.rig}: the displacement reaches {reached:.3g} m at {spin(record.speed)}, more than the "
                "size of the rotor; check eccentricities and forces, stiffness, and damping at a resonance"
            )
        if given.noise:
            x, y = standard_normal(given.seed, i, 1, (2, *record.displacement.shape))[0]
            moving = record.displacement - record.displacement.mean(axis=-1, keepdims=True)
            size = given.noise / 100 * np.sqrt(np.mean(np.abs(moving) ** 2, axis=-1, keepdims=True) / 2)
            record.displacement[:] += size * (x + 1j * y)
        yield record

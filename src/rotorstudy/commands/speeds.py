"""Speeds on the command line: rad/s, or rpm with `--rpm`."""

from rotorstudy.units import RAD_PER_S


def add_rpm(parser):
    """Add `--rpm` to a parser."""
    parser.add_argument("--rpm", action="store_true", help="the speeds given are in rpm instead of rad/s")


def in_rad_s(speeds, rpm):
    """Speeds (speed,) as given, None if none were, in rad/s."""
    return [speed * RAD_PER_S["rpm"] for speed in speeds] if speeds is not None and rpm else speeds

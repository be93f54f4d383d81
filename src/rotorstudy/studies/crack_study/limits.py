"""The smallest crack that is detected, over the shaft, by noise, probes and what is known of the healthy machine."""

from itertools import product

import numpy as np

from rotorstudy.store import dataset
from rotorstudy.studies.crack_study.sensitivity import Machine, explained_away, visibility

FREEDOM = 3  # position, depth and angle
BASELINES = ("none", "healthy record")
DETECTED = 1e-4  # accuracy of the size that is needed


def needed_visibility(false_alarm, power):
    """Size of a change in standard deviations at which a chi-square test with three degrees of freedom has a power."""
    from scipy.optimize import brentq
    from scipy.stats import chi2, ncx2

    least = chi2.isf(false_alarm, FREEDOM)
    return float(np.sqrt(brentq(lambda square: ncx2.sf(least, FREEDOM, square) - power, 1e-3, 1e3, xtol=DETECTED)))


def detection_probability(seen, false_alarm):
    """(...,) power of that test for changes of some sizes (...) in standard deviations."""
    from scipy.stats import chi2, ncx2

    return ncx2.sf(chi2.isf(false_alarm, FREEDOM), FREEDOM, np.maximum(seen, 1e-6) ** 2)


def smallest(depths, seen, needed):
    """(...,) depth at which the visibility (..., depth), a power between depths, reaches what is needed, or NaN."""
    logs, found = np.log(np.maximum(seen, 1e-300)), np.full(seen.shape[:-1], np.nan)
    for place in np.ndindex(found.shape):
        rising = np.maximum.accumulate(logs[place])
        if np.isnan(rising).any() or rising[-1] < np.log(needed):
            continue
        i = min(max(int(np.searchsorted(rising, np.log(needed))) - 1, 0), len(depths) - 2)
        slope = (rising[i + 1] - rising[i]) / np.log(depths[i + 1] / depths[i])
        if slope > 0:
            found[place] = depths[i] * np.exp((np.log(needed) - rising[i]) / slope)
    return found


def limits(config):
    """A Dataset of the visibility of cracks at their worst angle, and of the smallest one detected, over shafts."""
    coordinates = {
        "noise": (np.array(config.noise_percent), "percent", "white noise on each sample, of the rms vibration"),
        "baseline": (list(BASELINES), "1", "what is known of the healthy machine beyond the rig file"),
        "depth_ratio": (np.array(config.map.depth_ratios), "1", "depth over diameter"),
    }
    variables = {}
    needed = needed_visibility(config.false_alarm, config.power)
    for name, rotor in config.rotors.items():
        machine = Machine(config, rotor)
        position = machine.positions(config.map.positions)
        seen = _visibilities(config, machine, position)
        least = smallest(config.map.depth_ratios, seen, needed)
        dims = (f"planes_{name}", "noise", "baseline", f"position_{name}")
        section = [machine.model.structure.section_at(s).outer_diameter_m for s in position]
        variables |= {
            f"visibility_{name}": ((*dims, "depth_ratio"), seen, "1", "change that nothing else explains, in sigma"),
            f"smallest_depth_{name}": (dims, least, "1", "smallest depth detected, over the diameter"),
            f"diameter_{name}": (dims[-1:], np.array(section), "m", "diameter of the shaft"),
        }
        coordinates |= {
            f"planes_{name}": (list(rotor.planes), "1", f"probes of {name}"),
            f"position_{name}": (position, "m", f"position on the shaft of {name}, from node 1"),
        }
    title = f"{config.title}: smallest crack detected"
    return dataset(variables, coordinates, title=title, needed_visibility=needed)


def _visibilities(config, machine, position):
    """(planes, noise, baseline, position, depth) visibility of cracks on a machine, of the least visible angle."""
    grid = list(product(position, config.map.depth_ratios, config.map.angles_rad))
    changes = np.array([machine.change(*one) for one in grid])
    found = np.empty((len(machine.rotor.planes), len(config.noise_percent), len(BASELINES), len(grid)))
    others = machine.others.values()
    base, known = machine.healthy_columns(*others), machine.work(machine.raw, *others).prior.whitener
    for (p, nodes), (n, percent) in product(enumerate(machine.rotor.planes.values()), enumerate(config.noise_percent)):
        chosen, std = machine.chosen(nodes), machine.std(percent)
        columns = (base / std[:, None])[chosen]
        healthy = np.vstack([columns, known])  # what a record before the crack says, and the rig file
        for b, before in enumerate((known, healthy)):
            found[p, n, b] = visibility((changes / std)[:, chosen], explained_away(columns, before))
    shape = (len(position), len(config.map.depth_ratios), len(config.map.angles_rad))
    return found.reshape(*found.shape[:-1], *shape).min(axis=-1)

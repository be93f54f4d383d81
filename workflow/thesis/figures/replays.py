"""Figures of a replayed experiment, of its configuration and of the Datasets of `thesis.replay`.

reference : folder of the printed values;  case, group : published speed, and estimates of the thesis that are shown
"""

import re

import numpy as np

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished, harmonic_axis, plot_orbit
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex
from rotorstudy.units import percent
from thesis import checks as limits
from thesis.figures.full_spectra import Panel, full_spectra
from thesis.replay import COLUMN, thesis_estimates
from thesis.replay_tables import estimate_checks

OUTSIDE = ("impossible", "implausible")  # verdicts on an estimate
SYMBOLS = {"c_E": "external damping $c_E$", "c_H": "internal damping $c_H$", "e": "eccentricity $e$"}
METHODS = {"fft": "FFT"}  # columns of the thesis


def symbol(name):
    """A printed name as a formula: dk p_-1 is the stiffness loss times the participation factor of -1X."""
    order = re.fullmatch(r"dk p_(-?\d+)", name)
    return rf"$\Delta k\,p_{{{order[1]}}}$" if order else SYMBOLS.get(name, name)


def _measured(spectra, case):
    """(harmonic,) of the column that figures show, slow roll removed, m."""
    here = spectra.sel(version="corrected", data_set=COLUMN, spectrum_method=COLUMN, case=case)
    return as_complex(here.corrected)


def _recorded(config, records, case, revolutions):
    """Time (time,) s, displacement (time,) m, and reference (time,) of the first revolutions of a record."""
    shown = records.time.values < revolutions * 2 * np.pi / config.cases[case]
    found = records.sel(version="corrected", data_set=COLUMN, case=case).isel(time=shown)
    return found.time.values, as_complex(found.displacement), found.reference.values


def _estimates_for(config, identification, group):
    """Estimates of a group as the thesis names it."""
    return identification.sel(data_set=COLUMN, group=config.thesis_groups.get(group, group))


def _in_time(axes, time, rows):
    for panel, (label, values) in zip(axes, rows.items(), strict=True):
        panel.plot(time * 1e3, values)
        panel.set_ylabel(label)
    axes[-1].set_xlabel("time (ms)")


def record(config, records, case):
    """A record in time as measured."""
    time, z, mark = _recorded(config, records, case, 3)
    picture, axes = figure(4, 1, height=1.8, width=4.5)
    rows = {"reference (1)": mark, "vertical x (mm)": z.real * 1e3, "horizontal y (mm)": z.imag * 1e3}
    _in_time(axes[:3, 0], time, rows)
    plot_orbit(z, axes[3, 0])
    axes[0, 0].set_title(f"{case}: three revolutions, with bow and sensor gap")
    return picture


def spectra(config, spectra, case):
    """Full spectra of displacement and reference, both columns of the thesis."""
    both, marks = {}, {}
    for data_set in config.data_sets:
        label = METHODS.get(data_set, data_set)
        part = spectra.sel(version="corrected", data_set=data_set, spectrum_method=data_set, case=case)
        both[label], marks[label] = as_complex(part.displacement), np.exp(1j * part.reference_phase.values)
    panels = [
        Panel(f"Amplitude of the displacement, {case}", "amplitude", both),
        Panel(f"Phase of the displacement, {case}", "phase", both),
        Panel(f"Phase of the reference signal, {case}", "phase", marks),
    ]
    first, *_, last = both.values()
    apart = np.abs(last - first) / np.abs(first)
    told = f"differ by {percent(apart.max(), 2)} at most, as vectors ({config.harmonics[apart.argmax()]}X)"
    picture = full_spectra(config.harmonics, panels)
    return finished(picture, f"{case}: the columns of the thesis {told}", size=8)


def without_slow_roll(config, spectra, case):
    """Time signals without bow and sensor gap."""
    time = np.linspace(0, 3 * 2 * np.pi / config.cases[case], 1500)
    z = synthesize(_measured(spectra, case), config.cases[case], config.harmonics, time) * 1e6
    picture, axes = figure(2, 1, height=1.8, width=4.5, sharex=True)
    _in_time(axes[:, 0], time, {"vertical x (µm)": z.real, "horizontal y (µm)": z.imag})
    axes[0, 0].set_title(f"{case}: slow roll (mean and 1X) subtracted, three revolutions")
    return picture


def orbits(config, records, spectra, case):
    """Orbits before and after subtracting the slow roll."""
    _, raw, _ = _recorded(config, records, case, 1)
    time = np.linspace(0, 2 * np.pi / config.cases[case], 800)
    clean = synthesize(_measured(spectra, case), config.cases[case], config.harmonics, time)
    picture, ((left, right),) = figure(1, 2, height=3.0)
    plot_orbit(raw, left)
    plot_orbit(clean, right, index=1)
    left.set_title(f"{case}: as measured, with bow and sensor gap")
    size = np.ptp(clean.real) / np.ptp(raw.real)
    right.set_title(f"slow roll subtracted: {percent(size)} of the height, not a circle")
    return picture


def model(config, reference, spectra, identification, case, group):
    """Measured against simulated with identified parameters."""
    simulated = _estimates_for(config, identification, group).simulated.sel(case=case)
    theta = thesis_estimates(config, reference, group)
    theirs = measured_response(config.model, [config.cases[case]], config.harmonics, theta)[0, :, 0]
    rows = {"measured": _measured(spectra, case)}
    for estimator in ("least squares", "maximum likelihood"):
        rows[estimator] = as_complex(simulated.sel(estimator=estimator.replace(" ", "_")))
    rows[f"the thesis's Table {config.estimates_table}"] = theirs
    panels = [Panel(kind.capitalize(), kind, rows) for kind in ("amplitude", "phase")]
    errors = np.abs(rows["least squares"] - rows["measured"]) / np.abs(rows["measured"])
    told = f"{np.sum(errors < 0.2)} of {len(errors)} harmonics within 20 % as vectors (amplitude and phase)"
    return finished(full_spectra(config.harmonics, panels), f"{case}: least squares fits {told}", size=7)


def crack_force(config, reference, identification):
    """Crack force at each harmonic from the estimated stiffness losses, ours and the thesis's."""
    rotor, free = config.model, [config.thesis_names[f"dk p_{n}"][0] for n in config.harmonics]
    static = rotor.structure.static_deflection[rotor.measured[0]].real
    models = [p for p in config.figures.values() if p.kind == "model"]
    shown, differing = {p.group: [q.case for q in models if q.group == p.group] for p in models}, []
    picture, axes = figure(1, len(shown), width=2.8 if len(shown) > 1 else 4.0, sharey=True)
    for panel, (group, cases) in zip(axes[0], shown.items(), strict=True):
        estimate = _estimates_for(config, identification, group).estimate
        ours = estimate.sel(estimator="least_squares", parameter=free).values * static
        theirs = thesis_estimates(config, reference, group)[rotor.position(free)] * static
        for i, (label, force) in enumerate((("here", ours), ("thesis", theirs))):
            at = np.array(config.harmonics) + (i - 0.5) * 0.4
            panel.bar(at, np.abs(force), 0.4, color=COLOURS[i], label=label)
        sizes = np.abs(theirs), np.abs(ours)
        differing += [(abs(a - b), n, a, b) for n, a, b in zip(config.harmonics, *sizes, strict=True)]
        harmonic_axis(panel, config.harmonics)
        panel.set_xlabel("harmonic")
        panel.set_title(f"{' and '.join(cases)} (estimates of {group})", fontsize=7)
    axes[0, 0].set_ylabel("crack force (N)")
    axes[0, 0].legend()
    n, theirs, ours = max(differing)[1:]
    told = f"differ most at {n}X: {theirs:.1f} N in the thesis, {ours:.1f} N here"
    return finished(picture, f"Crack forces from the estimated stiffness losses {told}", size=8)


def bow_magnification(config, spectra):
    """Change of 1X from slow roll beside the magnification of a bow."""
    frequency = config.speeds[config.higher] / (2 * np.pi)
    picture, ((panel,),) = figure(height=2.6, width=4.0)
    for i, data_set in enumerate(config.data_sets):
        here = spectra.sel(version="corrected", data_set=data_set, spectrum_method=data_set)
        change, magnified, explained = limits.bow_magnification(config, as_complex(here.compensated))
        if data_set == COLUMN:
            share = explained
            panel.plot(frequency, np.abs(magnified) * 1e6, "k--", label="predicted for a bow")
        style = {"color": COLOURS[i], "fillstyle": "none", "label": f"measured, {METHODS.get(data_set, data_set)}"}
        panel.plot(frequency, np.abs(change) * 1e6, MARKERS[i], **style)
    title = "A bow alone would increase 1X more than measured"
    if share.min() > 0.5:
        title = f"A bow explains {percent(share.min())} to {percent(share.max())} of the change of 1X"
    panel.set(xlabel="spin speed (Hz)", ylabel="change of 1X from slow roll (µm)", title=title)
    panel.set_ylim(bottom=0)
    panel.legend()
    return picture


def checks(config, reference, spectra, identification, group):
    """Estimates beside their physical limits."""
    found = estimate_checks(config, reference, spectra, identification)
    found = found[found.group == group]
    names = list(dict.fromkeys(found.parameter))
    picture, ((panel,),) = figure(height=4.2, width=5.5)
    for s, source in enumerate(dict.fromkeys(found.source)):
        for row in found[found.source == source].itertuples():
            low, high, at = (v / row.largest_possible for v in (row.low, row.high, row.estimate))
            style = {"fmt": MARKERS[s], "color": COLOURS[s], "capsize": 2}
            style |= {"fillstyle": "full" if row.verdict in OUTSIDE else "none"}
            style |= {"label": source if row.parameter == names[0] else None}
            place = names.index(row.parameter) + (s - 1) * 0.27
            panel.errorbar(at, place, xerr=[[at - low], [high - at]], **style)
    of_either_sign = [limits.shown_name(name) for name in config.losses.values()]  # judged by size alone
    sides, place = np.where(np.isin(names, of_either_sign), -1, 0), np.arange(len(names))
    panel.barh(place, sides, 1.0, color=COLOURS[2], alpha=0.12, linewidth=0, label="possible in size")
    panel.axvspan(0, 1, color=COLOURS[2], alpha=0.25, label="possible")
    panel.set_yticks(place, [symbol(name) for name in names])
    panel.set_xscale("symlog", linthresh=1)
    printed = found[found.source == "thesis"]
    outside = f"{int(printed.verdict.isin(OUTSIDE).sum())} of {len(printed)} limits by the rig's data"
    panel.set_title(f"The thesis's estimates exceed {outside} (filled; {group})")
    panel.set_xlabel("estimate / largest possible value (1)")
    return finished(picture, legend=2)

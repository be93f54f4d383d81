"""Figures of a replayed experiment."""

import re
from typing import NamedTuple

import numpy as np
import xarray as xr

from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, harmonic_axis, plot_orbit
from rotorstudy.response.measured import measured_response
from rotorstudy.response.series import synthesize
from rotorstudy.store import as_complex
from rotorstudy.units import percent
from thesis.checks import bow_magnification, shown_name
from thesis.config import ReplayConfig
from thesis.figures.responses import Panel, full_spectra
from thesis.replay import COLUMN, thesis_estimates
from thesis.replay_tables import estimate_checks

OUTSIDE = ("impossible", "implausible")  # verdicts on an estimate
SYMBOLS = {"c_E": "external damping $c_E$", "c_H": "internal damping $c_H$", "e": "eccentricity $e$"}
METHODS = {"fft": "FFT"}  # columns of the thesis


def symbol(name):
    """A printed name as a formula: dk p_-1 is the stiffness loss times the participation factor of -1X."""
    order = re.fullmatch(r"dk p_(-?\d+)", name)
    return rf"$\Delta k\,p_{{{order[1]}}}$" if order else SYMBOLS.get(name, name)


class Replayed(NamedTuple):
    """A replay and its results; reference : folder of the printed values."""

    config: ReplayConfig
    reference: str
    records: xr.Dataset
    spectra: xr.Dataset
    identification: xr.Dataset

    @property
    def here(self):
        """The spectra with the misprints corrected."""
        return self.spectra.sel(version="corrected")

    def measured(self, case):
        """(harmonic,) of the column that figures show, slow roll removed, m."""
        return as_complex(self.here.corrected.sel(data_set=COLUMN, spectrum_method=COLUMN, case=case))

    def recorded(self, case, revolutions):
        """Time (time,) s, displacement (time,) m, and reference (time,) of the first revolutions of a record."""
        shown = self.records.time.values < revolutions * 2 * np.pi / self.config.cases[case]
        found = self.records.sel(version="corrected", data_set=COLUMN, case=case).isel(time=shown)
        return found.time.values, as_complex(found.displacement), found.reference.values

    def estimates_for(self, group):
        """Estimates of a group as the thesis names it."""
        return self.identification.sel(data_set=COLUMN, group=self.config.thesis_groups.get(group, group))


def _in_time(axes, time, rows):
    for panel, (label, values) in zip(axes, rows.items(), strict=True):
        panel.plot(time * 1e3, values)
        panel.set_ylabel(label)
    axes[-1].set_xlabel("time (ms)")


def record_figure(replayed, case, group):
    """A record in time as measured."""
    time, z, mark = replayed.recorded(case, 3)
    picture, axes = figure(4, 1, height=1.8, width=4.5)
    rows = {"reference (1)": mark, "vertical x (mm)": z.real * 1e3, "horizontal y (mm)": z.imag * 1e3}
    _in_time(axes[:3, 0], time, rows)
    plot_orbit(z, axes[3, 0])
    axes[0, 0].set_title(f"{case}: three revolutions, with bow and sensor gap")
    return picture


def spectra_figure(replayed, case, group):
    """Full spectra of displacement and reference, both columns of the thesis."""
    harmonics, both, marks = replayed.config.harmonics, {}, {}
    for data_set in replayed.config.data_sets:
        label = METHODS.get(data_set, data_set)
        part = replayed.here.sel(data_set=data_set, spectrum_method=data_set, case=case)
        both[label], marks[label] = as_complex(part.displacement), np.exp(1j * part.reference_phase.values)
    panels = [
        Panel(f"Amplitude of the displacement, {case}", "amplitude", both),
        Panel(f"Phase of the displacement, {case}", "phase", both),
        Panel(f"Phase of the reference signal, {case}", "phase", marks),
    ]
    picture = full_spectra(harmonics, panels)
    first, *_, last = both.values()
    apart = np.abs(last - first) / np.abs(first)
    told = f"differ by {percent(apart.max(), 2)} at most, as vectors ({harmonics[apart.argmax()]}X)"
    picture.suptitle(f"{case}: the columns of the thesis {told}", fontsize=8)
    return picture


def without_slow_roll_figure(replayed, case, group):
    """Time signals without bow and sensor gap."""
    config = replayed.config
    time = np.linspace(0, 3 * 2 * np.pi / config.cases[case], 1500)
    z = synthesize(replayed.measured(case), config.cases[case], config.harmonics, time) * 1e6
    picture, axes = figure(2, 1, height=1.8, width=4.5, sharex=True)
    _in_time(axes[:, 0], time, {"vertical x (µm)": z.real, "horizontal y (µm)": z.imag})
    axes[0, 0].set_title(f"{case}: slow roll (mean and 1X) subtracted, three revolutions")
    return picture


def orbits_figure(replayed, case, group):
    """Orbits before and after subtracting the slow roll."""
    config = replayed.config
    raw = replayed.recorded(case, 1)[1]
    time = np.linspace(0, 2 * np.pi / config.cases[case], 800)
    clean = synthesize(replayed.measured(case), config.cases[case], config.harmonics, time)
    picture, axes = figure(1, 2, height=3.0)
    plot_orbit(raw, axes[0, 0])
    plot_orbit(clean, axes[0, 1], index=1)
    axes[0, 0].set_title(f"{case}: as measured, with bow and sensor gap")
    size = np.ptp(clean.real) / np.ptp(raw.real)
    axes[0, 1].set_title(f"slow roll subtracted: {percent(size)} of the height, not a circle")
    return picture


def model_figure(replayed, case, group):
    """Measured against simulated with identified parameters."""
    config = replayed.config
    best = replayed.estimates_for(group).sel(case=case)
    theta = thesis_estimates(config, replayed.reference, group)
    rows = {
        "measured": replayed.measured(case),
        "least squares": as_complex(best.simulated.sel(estimator="least_squares")),
        "maximum likelihood": as_complex(best.simulated.sel(estimator="maximum_likelihood")),
        f"the thesis's Table {config.estimates_table}": measured_response(
            config.model, [config.cases[case]], config.harmonics, theta
        )[0, :, 0],
    }
    picture = full_spectra(config.harmonics, [Panel(kind.capitalize(), kind, rows) for kind in ("amplitude", "phase")])
    errors = np.abs(rows["least squares"] - rows["measured"]) / np.abs(rows["measured"])
    told = f"{np.sum(errors < 0.2)} of {len(errors)} harmonics within 20 % as vectors (amplitude and phase)"
    picture.suptitle(f"{case}: least squares fits {told}", fontsize=7)
    return picture


def crack_force_figure(replayed, case, group):
    """Crack force at each harmonic from the estimated stiffness losses, ours and the thesis's."""
    config, model = replayed.config, replayed.config.model
    static = model.structure.static_deflection[model.measured[0]].real
    free = [config.thesis_names[f"dk p_{n}"][0] for n in config.harmonics]
    models = [p for p in config.figures.values() if p.kind == "model"]
    shown = {p.group: [q.case for q in models if q.group == p.group] for p in models}
    differing = []
    picture, axes = figure(1, len(shown), width=2.8 if len(shown) > 1 else 4.0, sharey=True)
    for panel, (of_group, of_cases) in zip(axes[0], shown.items(), strict=True):
        estimate = replayed.estimates_for(of_group).estimate
        ours = estimate.sel(estimator="least_squares", parameter=free).values * static
        theirs = thesis_estimates(config, replayed.reference, of_group)[model.position(free)] * static
        for i, (label, force) in enumerate((("here", ours), ("thesis", theirs))):
            at = np.array(config.harmonics) + (i - 0.5) * 0.4
            panel.bar(at, np.abs(force), 0.4, color=COLOURS[i], label=label)
        sizes = np.abs(theirs), np.abs(ours)
        differing += [(abs(a - b), n, a, b) for n, a, b in zip(config.harmonics, *sizes, strict=True)]
        harmonic_axis(panel, config.harmonics)
        panel.set_xlabel("harmonic")
        panel.set_title(f"{' and '.join(of_cases)} (estimates of {of_group})", fontsize=7)
    axes[0, 0].set_ylabel("crack force (N)")
    axes[0, 0].legend()
    n, theirs, ours = max(differing)[1:]
    told = f"differ most at {n}X: {theirs:.1f} N in the thesis, {ours:.1f} N here"
    picture.suptitle(f"Crack forces from the estimated stiffness losses {told}", fontsize=8)
    return picture


def bow_magnification_figure(replayed, case, group):
    """Change of 1X from slow roll beside the magnification of a bow."""
    config = replayed.config
    frequency = config.speeds[config.higher] / (2 * np.pi)
    picture, axes = figure(height=2.6, width=4.0)
    for i, data_set in enumerate(config.data_sets):
        compensated = as_complex(replayed.here.compensated.sel(data_set=data_set, spectrum_method=data_set))
        change, magnified = bow_magnification(config, compensated)
        if data_set == COLUMN:
            share = 1 - np.abs(change - magnified) / np.abs(change)
            axes[0, 0].plot(frequency, np.abs(magnified) * 1e6, "k--", label="predicted for a bow")
        style = {"color": COLOURS[i], "fillstyle": "none", "label": f"measured, {METHODS.get(data_set, data_set)}"}
        axes[0, 0].plot(frequency, np.abs(change) * 1e6, MARKERS[i], **style)
    axes[0, 0].set(xlabel="spin speed (Hz)", ylabel="change of 1X from slow roll (µm)")
    if share.min() > 0.5:
        title = f"A bow explains {percent(share.min())} to {percent(share.max())} of the change of 1X"
    else:
        title = "A bow alone would increase 1X more than measured"
    axes[0, 0].set_title(title)
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].legend()
    return picture


def checks_figure(replayed, case, group):
    """Estimates beside their physical limits."""
    checks = estimate_checks(replayed.config, replayed.reference, replayed.spectra, replayed.identification)
    checks = checks[checks.group == group]
    names = list(dict.fromkeys(checks.parameter))
    picture, axes = figure(height=4.2, width=5.5)
    for s, source in enumerate(dict.fromkeys(checks.source)):
        for row in checks[checks.source == source].itertuples():
            low, high, at = (v / row.largest_possible for v in (row.low, row.high, row.estimate))
            style = {"fmt": MARKERS[s], "color": COLOURS[s], "capsize": 2}
            style |= {"fillstyle": "full" if row.verdict in OUTSIDE else "none"}
            style |= {"label": source if row.parameter == names[0] else None}
            place = names.index(row.parameter) + (s - 1) * 0.27
            axes[0, 0].errorbar(at, place, xerr=[[at - low], [high - at]], **style)
    of_either_sign = [shown_name(name) for name in replayed.config.losses.values()]  # judged by size alone
    sides = np.where(np.isin(names, of_either_sign), -1, 0)
    place = np.arange(len(names))
    axes[0, 0].barh(place, sides, 1.0, color=COLOURS[2], alpha=0.12, linewidth=0, label="possible in size")
    axes[0, 0].axvspan(0, 1, color=COLOURS[2], alpha=0.25, label="possible")
    axes[0, 0].set_yticks(range(len(names)), [symbol(name) for name in names])
    axes[0, 0].set_xscale("symlog", linthresh=1)
    printed = checks[checks.source == "thesis"]
    outside = int(printed.verdict.isin(OUTSIDE).sum())
    axes[0, 0].set(
        xlabel="estimate / largest possible value (1)",
        title=f"The thesis's estimates exceed {outside} of {len(printed)} limits by the rig's data (filled; {group})",
    )
    picture.legend(loc="outside lower center", ncols=2)
    return picture


KINDS = {
    "record": record_figure,
    "spectra": spectra_figure,
    "without slow roll": without_slow_roll_figure,
    "orbits": orbits_figure,
    "model": model_figure,
    "crack force": crack_force_figure,
    "bow magnification": bow_magnification_figure,
    "checks": checks_figure,
}


def figures(config, reference, records, spectra, identification):
    """The figures that a replay's configuration asks for, from the Datasets of `thesis.replay`."""
    replayed = Replayed(config, reference, records, spectra, identification)
    return {name: KINDS[item.kind](replayed, item.case, item.group) for name, item in config.figures.items()}

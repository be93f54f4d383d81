from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np
    import pandas as pd

    from rotorstudy.presentation.plots import (
        COLOURS,
        MARKERS,
        figure,
        harmonic_axis,
        plot_full_spectrum,
        plot_orbit,
        plot_phase,
        save_figure,
    )
    from rotorstudy.response.harmonic import measured_response
    from rotorstudy.response.series import synthesize
    from rotorstudy.store import as_complex, load
    from rotorstudy.thesis.checks import bow_magnification, percent
    from rotorstudy.thesis.replay import COLUMN, load_replay, thesis_estimates

    config = load_replay(snakemake.input.config)
    spectra, identification = load(snakemake.input.spectra), load(snakemake.input.identification)
    records = load(snakemake.input.records)
    reference = Path(snakemake.input.published).parent
    harmonics, cases, model = config.harmonics, list(config.cases), config.model
    higher = [case for case in cases if case != config.slow_roll]
    speeds = np.array([config.cases[case] for case in higher])
    here = spectra.sel(version="corrected")

    def measured(case, quantity="corrected"):
        return as_complex(here[quantity].sel(data_set=COLUMN, spectrum_method=COLUMN, case=case))

    def recorded(case, turns):
        shown = records.time.values < turns * 2 * np.pi / config.cases[case]
        found = records.sel(version="corrected", data_set=COLUMN, case=case).isel(time=shown)
        return found.time.values, as_complex(found.displacement), found.reference.values

    def estimates_for(group):
        return identification.sel(data_set=COLUMN, group=config.thesis_groups.get(group, group))

    def in_time(axes, time, rows):
        for panel, (label, values) in zip(axes, rows.items(), strict=True):
            panel.plot(time * 1e3, values)
            panel.set_ylabel(label)
        axes[-1].set_xlabel("time (ms)")

    def draw_record(case, group):
        """A record in time as the sensors show it."""
        time, z, mark = recorded(case, 3)
        picture, axes = figure(4, 1, height=1.8, width=4.5)
        rows = {"reference (1)": mark, "vertical x (mm)": z.real * 1e3, "horizontal y (mm)": z.imag * 1e3}
        in_time(axes[:3, 0], time, rows)
        plot_orbit(z, axes[3, 0])
        axes[0, 0].set_title(f"{case}: three turns, bow and sensor gap in them")
        return picture

    def draw_spectra(case, group):
        """Full spectra of displacement and reference, both columns of the thesis."""
        picture, axes = figure(3, 1, height=2.2, width=4.5)
        for i, data_set in enumerate(config.data_sets):
            part = here.sel(data_set=data_set, spectrum_method=data_set, case=case)
            plot_full_spectrum(harmonics, as_complex(part.displacement), axes[0, 0], label=data_set, index=i, count=2)
            plot_phase(harmonics, as_complex(part.displacement), axes[1, 0], label=data_set, index=i)
            plot_phase(harmonics, np.exp(1j * part.reference_phase.values), axes[2, 0], label=data_set, index=i)
        for panel, title in enumerate(
            ("Amplitude of the displacement", "Phase of the displacement", "Phase of the reference signal")
        ):
            axes[panel, 0].set_title(f"{title}, {case}")
        axes[0, 0].legend(title="column of the thesis")
        return picture

    def draw_without_slow_roll(case, group):
        """Time signals without bow and sensor gap."""
        time = np.linspace(0, 3 * 2 * np.pi / config.cases[case], 1500)
        z = synthesize(measured(case), config.cases[case], harmonics, time) * 1e6
        picture, axes = figure(2, 1, height=1.8, width=4.5, sharex=True)
        in_time(axes[:, 0], time, {"vertical x (µm)": z.real, "horizontal y (µm)": z.imag})
        axes[0, 0].set_title(f"{case}: slow roll (mean and 1X) taken off, three turns")
        return picture

    def draw_orbits(case, group):
        """Orbits before and after the slow roll is taken off."""
        raw = recorded(case, 1)[1]
        clean = synthesize(
            measured(case), config.cases[case], harmonics, np.linspace(0, 2 * np.pi / config.cases[case], 800)
        )
        picture, axes = figure(1, 2, height=3.0)
        plot_orbit(raw, axes[0, 0])
        plot_orbit(clean, axes[0, 1], index=1)
        axes[0, 0].set_title(f"{case}: as measured, bow and sensor gap in it")
        size = np.ptp(clean.real) / np.ptp(raw.real)
        axes[0, 1].set_title(f"slow roll taken off: {percent(size)} of the height, not a circle")
        return picture

    def draw_model(case, group):
        """Measured against simulated with identified parameters."""
        best = estimates_for(group).sel(case=case)
        theta = thesis_estimates(config, reference, group)
        rows = {
            "measured": measured(case),
            "least squares": as_complex(best.simulated.sel(estimator="least_squares")),
            "maximum likelihood": as_complex(best.simulated.sel(estimator="maximum_likelihood")),
            f"the thesis's Table {config.estimates_table}": measured_response(
                model, [config.cases[case]], harmonics, theta
            )[0, :, 0],
        }
        picture, axes = figure(2, 1, height=2.4, width=5.0)
        for i, (label, values) in enumerate(rows.items()):
            plot_full_spectrum(harmonics, values, axes[0, 0], label=label, index=i, count=len(rows))
            plot_phase(harmonics, values, axes[1, 0], label=label, index=i)
        errors = np.abs(rows["least squares"] - rows["measured"]) / np.abs(rows["measured"])
        axes[0, 0].set_title(
            f"{case}: least squares meets {np.sum(errors < 0.2)} of {len(errors)} harmonics within 20 % as vectors "
            "(amplitude and phase)",
            fontsize=7,
        )
        picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        return picture

    def draw_crack_force(case, group):
        """Crack force at each harmonic from the estimated stiffness losses, ours and the thesis's."""
        static = model.structure.static_deflection[model.measured[0]].real
        free = [config.thesis_names[f"dk p_{n}"][0] for n in harmonics]
        models = [p for p in config.figures.values() if p.kind == "model"]
        shown = {p.group: [q.case for q in models if q.group == p.group] for p in models}
        picture, axes = figure(1, len(shown), width=2.8 if len(shown) > 1 else 4.0, sharey=True)
        for panel, (of_group, of_cases) in zip(axes[0], shown.items(), strict=True):
            ours = estimates_for(of_group).estimate.sel(estimator="least_squares", parameter=free).values * static
            theirs = thesis_estimates(config, reference, of_group)[model.position(free)] * static
            for i, (label, force) in enumerate((("here", ours), ("thesis", theirs))):
                at = np.array(harmonics) + (i - 0.5) * 0.4
                panel.bar(at, np.abs(force), 0.4, color=COLOURS[i], label=label)
            harmonic_axis(panel, harmonics)
            panel.set_xlabel("harmonic")
            panel.set_title(f"{' and '.join(of_cases)} (estimates of {of_group})", fontsize=7)
        axes[0, 0].set_ylabel("crack force (N)")
        axes[0, 0].legend()
        picture.suptitle("Crack force from the estimated stiffness losses", fontsize=8)
        return picture

    def draw_bow_magnification(case, group):
        """What the slow roll leaves behind."""
        picture, axes = figure(height=2.6, width=4.0)
        for i, data_set in enumerate(config.data_sets):
            compensated = as_complex(here.compensated.sel(data_set=data_set, spectrum_method=data_set))
            change, magnified = bow_magnification(config, compensated)
            if data_set == COLUMN:
                share = 1 - np.abs(change - magnified) / np.abs(change)
                axes[0, 0].plot(speeds / (2 * np.pi), np.abs(magnified) * 1e6, "k--", label="a bow's own magnification")
            style = {"color": COLOURS[i], "fillstyle": "none", "label": f"measured, {data_set}"}
            axes[0, 0].plot(speeds / (2 * np.pi), np.abs(change) * 1e6, MARKERS[i], **style)
        axes[0, 0].set(xlabel="spin speed (Hz)", ylabel="change of 1X from slow roll (µm)")
        if share.min() > 0.5:
            title = f"The bow, magnified, explains {percent(share.min())} to {percent(share.max())} of the 'unbalance'"
        else:
            title = "A bow alone would make 1X grow more than it does"
        axes[0, 0].set_title(title)
        axes[0, 0].set_ylim(bottom=0)
        axes[0, 0].legend()
        return picture

    def draw_checks(case, group):
        """Estimates against what is possible."""
        checks = pd.read_csv(snakemake.input.checks)
        checks = checks[checks.group == group]
        names = list(dict.fromkeys(checks.parameter))
        picture, axes = figure(height=4.2, width=5.5)
        for s, source in enumerate(dict.fromkeys(checks.source)):
            for row in checks[checks.source == source].itertuples():
                low, high, at = (v / row.largest_possible for v in (row.low, row.high, row.estimate))
                axes[0, 0].errorbar(
                    at,
                    names.index(row.parameter) + (s - 1) * 0.27,
                    xerr=[[at - low], [high - at]],
                    fmt=MARKERS[s],
                    color=COLOURS[s],
                    fillstyle="full" if row.verdict in ("impossible", "implausible") else "none",
                    capsize=2,
                    label=source if row.parameter == names[0] else None,
                )
        sides = np.where([name.startswith("dk") for name in names], -1, 0)
        place = np.arange(len(names))
        axes[0, 0].barh(place, sides, 1.0, color=COLOURS[2], alpha=0.12, linewidth=0, label="possible in size")
        axes[0, 0].axvspan(0, 1, color=COLOURS[2], alpha=0.25, label="possible")
        axes[0, 0].set_yticks(range(len(names)), names)
        axes[0, 0].set_xscale("symlog", linthresh=1)
        axes[0, 0].set(
            xlabel="estimate / largest possible value (1)",
            title=f"Filled: not possible by the rig's own data ({group})",
        )
        picture.legend(loc="outside lower center", ncols=2)
        return picture

    draw = {
        "record": draw_record,
        "spectra": draw_spectra,
        "without slow roll": draw_without_slow_roll,
        "orbits": draw_orbits,
        "model": draw_model,
        "crack force": draw_crack_force,
        "bow magnification": draw_bow_magnification,
        "checks": draw_checks,
    }
    for shown, png, svg in zip(config.figures.values(), snakemake.output.png, snakemake.output.svg, strict=True):
        save_figure(draw[shown.kind](shown.case, shown.group), png, svg)

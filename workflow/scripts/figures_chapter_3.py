from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np

    from rotorstudy.plots import (
        COLOURS,
        MARKERS,
        figure,
        harmonic_axis,
        plot_full_spectrum,
        plot_orbit,
        plot_phase,
        save_figure,
    )
    from rotorstudy.records import synthesize
    from rotorstudy.response import measured_response
    from rotorstudy.scoreboard import published
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.checks import bow_magnification
    from rotorstudy.studies.replay import load_replay

    config = load_replay(snakemake.input.config)
    spectra, identification = load(snakemake.input.spectra), load(snakemake.input.identification)
    records = load(snakemake.input.records)
    printed = published(Path(snakemake.input.published).parent, ["3.9"])
    outputs = iter(zip(snakemake.output.png, snakemake.output.svg, strict=True))
    harmonics, cases = config.harmonics, list(config.cases)
    higher = [case for case in cases if case != config.slow_roll]
    group_of = {"17 Hz": "17, 18, 19 Hz", "20 Hz": "20, 21, 22 Hz", "22 Hz": "20, 21, 22 Hz"}
    here = spectra.sel(version="corrected")

    def measured(case, quantity="corrected"):
        return as_complex(here[quantity].sel(data_set="fft", spectrum_method="fft", case=case))

    def thesis_model(group):
        """Response of the model with the parameters printed in Table 3.9."""
        values = printed[printed.case == group].set_index("item").published
        e = values["e"] * np.exp(1j * np.deg2rad(values["phi"]))
        theta = [values["c_E"], values["c_H"], e.real, e.imag, *(values[f"dk p_{n}"] for n in harmonics)]
        return dict(
            zip(higher, measured_response(config.model, config.speeds[1:], harmonics, theta)[..., 0], strict=True)
        )

    # Figures 3.12 to 3.15: full spectra of displacement and reference
    for case in cases:
        picture, axes = figure(3, 1, height=2.2, width=4.5)
        for i, data_set in enumerate(config.data_sets):
            part = here.sel(data_set=data_set, spectrum_method=data_set, case=case)
            plot_full_spectrum(harmonics, as_complex(part.displacement), axes[0, 0], label=data_set, index=i, count=2)
            plot_phase(harmonics, as_complex(part.displacement), axes[1, 0], label=data_set, index=i)
            mark = np.exp(1j * part.reference_phase.values)
            plot_phase(harmonics, mark, axes[2, 0], label=data_set, index=i)
        for panel, title in enumerate(
            ("Amplitude of the displacement", "Phase of the displacement", "Phase of the reference signal")
        ):
            axes[panel, 0].set_title(f"{title}, {case}")
        axes[0, 0].legend(title="column of the thesis")
        save_figure(picture, *next(outputs))

    # Figures 3.17 to 3.19: time signals without bow and sensor gap
    for case in higher:
        speed = config.cases[case]
        time = np.linspace(0, 3 * 2 * np.pi / speed, 1500)
        z = synthesize(measured(case), speed, harmonics, time)
        picture, axes = figure(2, 1, height=1.8, width=4.5, sharex=True)
        for panel, values, label in (
            (axes[0, 0], z.real, "vertical x (µm)"),
            (axes[1, 0], z.imag, "horizontal y (µm)"),
        ):
            panel.plot(time * 1e3, values * 1e6)
            panel.set_ylabel(label)
        axes[1, 0].set_xlabel("time (ms)")
        axes[0, 0].set_title(f"{case}: slow roll (mean and 1X) taken off, three turns")
        save_figure(picture, *next(outputs))

    # Figures 3.20 to 3.22: orbits before and after
    for case in higher:
        speed = config.cases[case]
        c = cases.index(case)
        turn = records.time.values < 2 * np.pi / speed
        raw = as_complex(records.displacement.sel(version="corrected", data_set="fft", case=case))[turn]
        time = np.linspace(0, 2 * np.pi / speed, 800)
        clean = synthesize(measured(case), speed, harmonics, time)
        picture, axes = figure(1, 2, height=3.0)
        plot_orbit(raw, axes[0, 0])
        plot_orbit(clean, axes[0, 1], index=1)
        size = np.ptp(clean.real) / np.ptp(raw.real)
        axes[0, 0].set_title(f"{case}: as measured, bow and sensor gap in it")
        axes[0, 1].set_title(f"slow roll taken off: {size:.0%} of the height, not a circle")
        save_figure(picture, *next(outputs))

    # Figures 3.23 to 3.25: measured against simulated with identified parameters
    for case in higher:
        group = group_of[case]
        picture, axes = figure(2, 1, height=2.4, width=5.0)
        rows = {
            "measured": measured(case),
            "least squares": as_complex(
                identification.simulated.sel(estimator="least_squares", data_set="fft", group=group, case=case)
            ),
            "maximum likelihood": as_complex(
                identification.simulated.sel(estimator="maximum_likelihood", data_set="fft", group=group, case=case)
            ),
            "with the thesis's Table 3.9": thesis_model(group)[case],
        }
        for i, (label, values) in enumerate(rows.items()):
            plot_full_spectrum(harmonics, values, axes[0, 0], label=label, index=i, count=len(rows))
            plot_phase(harmonics, values, axes[1, 0], label=label, index=i)
        errors = np.abs(rows["least squares"] - rows["measured"]) / np.abs(rows["measured"])
        axes[0, 0].set_title(
            f"{case}: least squares meets {np.sum(errors < 0.2)} of {len(errors)} harmonics within 20 %"
        )
        axes[0, 0].set_ylim(top=2e3)
        axes[0, 0].legend(ncols=2)
        save_figure(picture, *next(outputs))

    # Figure 3.26: crack force
    static = config.model.structure.static_deflection[0].real
    picture, axes = figure(1, len(higher), width=2.8, sharey=True)
    for c, case in enumerate(higher):
        group = group_of[case]
        best = identification.sel(estimator="least_squares", data_set="fft", group=group)
        ours = [float(best.estimate.sel(parameter=f"stiffness_loss_p{n}")) * static for n in harmonics]
        values = printed[printed.case == group].set_index("item").published
        theirs = [values[f"dk p_{n}"] * static for n in harmonics]
        for i, (label, force) in enumerate((("here", ours), ("thesis", theirs))):
            axes[0, c].bar(np.array(harmonics) + (i - 0.5) * 0.4, np.abs(force), 0.4, color=COLOURS[i], label=label)
        harmonic_axis(axes[0, c], harmonics)
        axes[0, c].set_xlabel("harmonic")
        axes[0, c].set_title(f"{case} (estimates of {group})", fontsize=7)
    axes[0, 0].set_ylabel("crack force (N)")
    axes[0, 0].legend()
    picture.suptitle(
        "Crack force from the estimated stiffness losses: only -1X agrees with the thesis",
        fontsize=8,
    )
    save_figure(picture, *next(outputs))

    # What the slow roll leaves behind
    picture, axes = figure(height=2.6, width=4.0)
    for i, data_set in enumerate(config.data_sets):
        compensated = as_complex(here.compensated.sel(data_set=data_set, spectrum_method="regression"))
        change, magnified = bow_magnification(config, compensated)
        if i == 0:
            axes[0, 0].plot(
                config.speeds[1:] / (2 * np.pi), np.abs(magnified) * 1e6, "k--", label="a bow's own magnification"
            )
        axes[0, 0].plot(
            config.speeds[1:] / (2 * np.pi),
            np.abs(change) * 1e6,
            MARKERS[i],
            color=COLOURS[i],
            fillstyle="none",
            label=f"measured, {data_set}",
        )
    axes[0, 0].set(xlabel="spin speed (Hz)", ylabel="change of 1X from slow roll (µm)")
    axes[0, 0].set_title("Most of the 'unbalance' is the bow, magnified")
    axes[0, 0].set_ylim(bottom=0)
    axes[0, 0].legend()
    save_figure(picture, *next(outputs))

    # Estimates against what is possible
    import pandas as pd

    checks = pd.read_csv(snakemake.input.checks)
    checks = checks[checks.group == "17 to 22 Hz"]
    names = list(dict.fromkeys(checks.parameter))
    picture, axes = figure(height=4.2, width=5.5)
    for s, source in enumerate(dict.fromkeys(checks.source)):
        part = checks[checks.source == source]
        for row in part.itertuples():
            y = names.index(row.parameter) + (s - 1) * 0.27
            low, high, at = (v / row.largest_possible for v in (row.low, row.high, row.estimate))
            fill = "full" if row.verdict in ("impossible", "implausible") else "none"
            label = source if row.parameter == names[0] else None
            axes[0, 0].errorbar(
                at,
                y,
                xerr=[[at - low], [high - at]],
                fmt=MARKERS[s],
                color=COLOURS[s],
                fillstyle=fill,
                capsize=2,
                label=label,
            )
    axes[0, 0].axvspan(-1, 0, color=COLOURS[2], alpha=0.12, label="possible in size")
    axes[0, 0].axvspan(0, 1, color=COLOURS[2], alpha=0.25, label="possible")
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].set_xscale("symlog", linthresh=1)
    axes[0, 0].set(
        xlabel="estimate / largest possible value (1)", title="Filled: not possible by the rig's own data (17 to 22 Hz)"
    )
    picture.legend(loc="outside lower center", ncols=2)
    save_figure(picture, *next(outputs))

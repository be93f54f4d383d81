from rotorstudy.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np

    from rotorstudy.cracks import SERIES_ORDER
    from rotorstudy.plots import (
        COLOURS,
        MARKERS,
        figure,
        plain_log,
        plot_full_spectrum,
        plot_orbit,
        plot_phase,
        save_figure,
    )
    from rotorstudy.plugins import registry
    from rotorstudy.records import reference_signal
    from rotorstudy.scoreboard import published
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.config import load_study

    LABELS = {
        "internal_damping": "internal damping",
        "external_damping": "external damping",
        "eccentricity": "eccentricity",
        "eccentricity_phase": "unbalance phase",
        "stiffness_loss": "crack stiffness",
    }
    SHORT = {
        "Single speed 88": "88 rad/s",
        "Single speed 308": "308 rad/s",
        "Combined speed from 50 to 199 with increment +1": "50 to 199 rad/s",
        "Combined speed from 200 to 350 with increment +1": "200 to 350 rad/s",
    }
    config = load_study(snakemake.input.config)
    records, spectra = load(snakemake.input.records), load(snakemake.input.spectra)
    thesis_spectra = load(snakemake.input.thesis_spectra)
    bias, dominance, stable = (load(snakemake.input[key]) for key in ("bias", "weight_dominance", "stability"))
    noisy = {case: load(path) for case, path in zip(config.cases, snakemake.input.monte_carlo, strict=True)}
    noisy_thesis = {
        case: load(path) for case, path in zip(config.cases, snakemake.input.monte_carlo_thesis, strict=True)
    }
    printed = published(Path(snakemake.input.published).parent, ["2.2", "2.3", "2.5"])
    outputs = iter(zip(snakemake.output.png, snakemake.output.svg, strict=True))
    harmonics = config.harmonics

    # Figure 2.4: the switching function
    picture, axes = figure()
    speed, crack = 88.0, registry().get("crack", "switching")
    time = np.linspace(0, 4 * np.pi / speed, 2000)
    axes[0, 0].plot(time * 1e3, crack.function(speed * time), label="sudden opening")
    for order, style in ((7, "--"), (SERIES_ORDER, ":")):
        series = sum(s * np.exp(1j * k * speed * time) for k, s in crack.series(order).items()).real
        axes[0, 0].plot(time * 1e3, series, style, label=f"series to order {order}")
    axes[0, 0].set(
        xlabel="time (ms)", ylabel="opening, 0 closed to 1 open", title="Crack opening over two turns at 88 rad/s"
    )
    axes[0, 0].set_ylim(-0.15, 1.65)
    axes[0, 0].legend(loc="upper center", ncols=2)
    save_figure(picture, *next(outputs))

    # Figures 2.6 and 2.7: records in time, closed form and integration
    for speed in config.shown_speeds_rad_s:
        shown = records.time.values < 3 * 2 * np.pi / speed
        time = records.time.values[shown]
        picture, axes = figure(2, 2)
        for i, source in enumerate(("closed form", "integration")):
            z = as_complex(records.displacement.sel(source=source, speed=speed).isel(node=0))[shown]
            style = {"label": source, "color": COLOURS[i], "linestyle": ("-", "--")[i]}
            axes[0, 0].plot(time * 1e3, z.real * 1e6, **style)
            axes[0, 1].plot(time * 1e3, z.imag * 1e6, **style)
            plot_orbit(z, axes[1, 0], index=i, linestyle=("-", "--")[i])
        axes[1, 1].plot(time * 1e3, reference_signal(speed, harmonics, time), color=COLOURS[6])
        axes[0, 0].set(xlabel="time (ms)", ylabel="vertical x (µm)", title="Vertical displacement")
        axes[0, 1].set(xlabel="time (ms)", ylabel="horizontal y (µm)", title="Horizontal displacement")
        axes[1, 0].set_title("Orbit: more than one loop")
        axes[1, 1].set(xlabel="time (ms)", ylabel="reference signal (1)", title="Multi-harmonic phase reference")
        picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
        picture.suptitle(f"Three turns at {speed:g} rad/s: integration lies on the closed form", fontsize=9)
        save_figure(picture, *next(outputs))

    # Figures 2.8 and 2.9: full spectra, with the printed values where there are any
    for speed in config.shown_speeds_rad_s:
        picture, axes = figure(3, 1, height=2.2, width=4.5)
        late = {"source": "integration", "record": "half a sample late", "spectrum_method": "fft", "speed": speed}
        rows = {
            "physical signs": as_complex(spectra.displacement.sel(**late, phase_reference="reference").isel(node=0)),
            "the thesis's reading": as_complex(
                thesis_spectra.displacement.sel(**late, phase_reference="reference").isel(node=0)
            ),
        }
        uncompensated = as_complex(thesis_spectra.displacement.sel(**late, phase_reference="none").isel(node=0))
        for i, (label, values) in enumerate(rows.items()):
            plot_full_spectrum(harmonics, values, axes[0, 0], label=label, index=i, count=2)
            plot_phase(harmonics, values, axes[2, 0], label=label, index=i)
        plot_phase(harmonics, uncompensated, axes[1, 0], label="the thesis's reading, uncompensated", index=1)
        if speed == 88.0:
            for table, method, panel, scale in (
                ("2.2", "fft", 0, 1e6),
                ("2.3", "fft, uncompensated", 1, 1.0),
                ("2.3", "fft, compensated", 2, 1.0),
            ):
                values = printed[(printed.table == table) & (printed.method == method)]
                axes[panel, 0].plot(
                    values.item.astype(int), values.published * scale, "kx", label="printed in the thesis"
                )
        for panel, title in enumerate(
            ("Amplitude", "Phase, record half a sample late", "Phase, compensated by the reference")
        ):
            axes[panel, 0].set_title(f"{title}, {speed:g} rad/s")
            if panel:
                axes[panel, 0].set(ylim=(-3.5, 8.0), yticks=range(-3, 4))
            axes[panel, 0].legend(loc="upper right")
        save_figure(picture, *next(outputs))

    # Error against noise: both estimators, the bound
    cases = list(config.cases)[2:]
    picture, axes = figure(len(LABELS), 2 * len(cases), height=1.7, width=2.6, sharex=True)
    for c, case in enumerate(cases):
        for m, model in enumerate(noisy[case].noise_model.values):
            data, column = noisy[case].sel(noise_model=model), 2 * c + m
            for row, (parameter, label) in enumerate(LABELS.items()):
                panel, true = axes[row, column], float(data.true.sel(parameter=parameter))
                scale = 1.0 if parameter.endswith("phase") else 100 / abs(true)
                for i, estimator in enumerate(data.estimator.values):
                    error = data.estimate.sel(estimator=estimator, parameter=parameter) - true
                    rms = np.sqrt((error**2).mean("trial")) * scale
                    panel.loglog(
                        data.noise, rms, MARKERS[i] + "-", color=COLOURS[i], label=str(estimator).replace("_", " ")
                    )
                panel.loglog(
                    data.noise, data.cramer_rao.sel(parameter=parameter) * scale, "k--", label="Cramér-Rao bound"
                )
                if column == 0:
                    panel.set_ylabel(f"{label}\nrms error ({'rad' if parameter.endswith('phase') else '%'})")
                if row == 0:
                    panel.set_title(f"{SHORT[case]}\nnoise {model}")
                plain_log(panel, data.noise.values)
                if row == len(LABELS) - 1:
                    panel.set_xlabel("noise level (%)")
    axes[0, 0].legend()
    picture.suptitle("Maximum likelihood sits on the bound; least squares of the equations does not", fontsize=9)
    save_figure(picture, *next(outputs))

    # Printed noise rows of Table 2.5 among our trials
    picture, axes = figure(height=2.8, width=4.5)
    names = {"c_H": "internal_damping", "c_E": "external_damping", "e": "eccentricity", "phi": "eccentricity_phase"}
    names["dk_xi"] = "stiffness_loss"
    rows = printed[(printed.table == "2.5") & (printed.noise_percent > 0)]
    for m, model in enumerate(("per harmonic, same at all speeds", "per harmonic", "white in time")):
        place, level = [], []
        for row in rows.itertuples():
            data = noisy_thesis[row.case.removesuffix(", with phase compensation")].sel(
                noise_model=model, noise=row.noise_percent
            )
            trials = data.estimate.sel(estimator="least_squares", parameter=names[row.item])
            factor = 180 / np.pi if row.item == "phi" else 1.0
            place.append(abs(row.published / factor - float(trials.mean())) / float(trials.std()))
            level.append(list(names).index(row.item) + (m - 1) * 0.22)
        axes[0, 0].semilogy(level, place, MARKERS[m], color=COLOURS[m], fillstyle="none", label=f"noise {model}")
    axes[0, 0].axhline(1.96, color="k", linestyle="--", linewidth=0.8, label="95 % of trials")
    axes[0, 0].set_xticks(
        range(len(names)), ["internal\ndamping", "external\ndamping", "eccentricity", "phase", "crack\nstiffness"]
    )
    axes[0, 0].set(
        ylabel="distance from our mean\n(our standard deviations)",
        title="Table 2.5: one draw per harmonic, used at all speeds",
    )
    axes[0, 0].legend(loc="upper left", fontsize=6)
    save_figure(picture, *next(outputs))

    # Bias of what is held known
    picture, axes = figure(2, len(LABELS), height=2.0, width=2.2, sharex=True)
    for k, known in enumerate(bias.known.values):
        for p, (parameter, label) in enumerate(LABELS.items()):
            panel = axes[k, p]
            scale = 1.0 if parameter.endswith("phase") else 100.0
            for c, case in enumerate(cases):
                for i, estimator in enumerate(bias.estimator.values):
                    error = (
                        bias.relative_error.sel(known=known, case=case, estimator=estimator, parameter=parameter)
                        * scale
                    )
                    text = f"{SHORT[case]}, {str(estimator).replace('_', ' ')}"
                    panel.plot(bias.percent, error, ("-", "--")[c], color=COLOURS[i], label=text)
            panel.set_title(label if k == 0 else "")
            name = {"mass_kg": "mass", "stiffness_N_per_m": "stiffness"}[str(known)]
            panel.set_xlabel(f"error of the {name} (%)")
            if p in (0, 3, 4):
                panel.set_ylabel("error (rad)" if parameter.endswith("phase") else "error (%)")
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
    picture.suptitle("Wrong mass or stiffness mostly costs maximum likelihood more than least squares", fontsize=9)
    save_figure(picture, *next(outputs))

    # Weight dominance against the full crack
    picture, axes = figure(1, 2, height=2.8)
    amplitude = np.abs(as_complex(dominance.displacement))
    ratio = amplitude[1] / amplitude[0]
    model = config.rig(config.main_rig)
    loss = model.theta[model.names.index("stiffness_loss")] / model.structure.stiffness[0, 0] * 100
    percent = dominance.crack_scale.values * loss
    for i, n in enumerate((0, 1, 2, 3)):
        column = harmonics.index(n)
        for s in range(len(config.shown_speeds_rad_s)):
            text = f"{n}X" if s == 0 else None
            axes[0, 0].plot(percent, ratio[:, s, column], ("-", "--")[s], color=COLOURS[i], label=text)
    axes[0, 0].set(xlabel="stiffness lost by the open crack (%)", ylabel="full crack / weight dominant (1)")
    axes[0, 0].axhline(1, color="k", linewidth=0.8)
    axes[0, 0].set_title("Amplitude ratio (full line 88, dashed 308 rad/s)")
    axes[0, 0].legend(ncols=2)
    for i, (parameter, label) in enumerate(LABELS.items()):
        if parameter.endswith("phase"):
            continue
        error = dominance.error.sel(case=cases[0], parameter=parameter) * 100
        axes[0, 1].plot(percent, error, MARKERS[i] + "-", color=COLOURS[i], label=label)
    axes[0, 1].set(xlabel="stiffness lost by the open crack (%)", ylabel="error of the estimate (%)")
    axes[0, 1].set_title(f"What identification pays, {SHORT[cases[0]]}")
    axes[0, 1].legend()
    picture.suptitle("Weight dominance is not a small approximation", fontsize=9)
    save_figure(picture, *next(outputs))

    # Stability
    picture, axes = figure(1, 2, height=2.6)
    natural = float(stable.natural_frequency)
    for i, damping in enumerate(stable.damping_ratio.values):
        growth = stable.growth_rate.sel(damping_ratio=damping)
        axes[0, 0].plot(stable.relative_speed, growth, color=COLOURS[i], label=f"c_E / c_H = {damping:g}")
    axes[0, 0].axhline(0, color="k", linewidth=0.8)
    axes[0, 0].set(xlabel="speed / natural frequency (1)", ylabel="growth rate (1/s)", title="Unstable above zero")
    axes[0, 0].legend()
    line = np.linspace(0, float(stable.damping_ratio.max()), 50)
    axes[0, 1].plot(line, 1 + line, "k--", label=r"$1 + c_E / c_H$")
    axes[0, 1].plot(stable.damping_ratio, stable.threshold / natural, MARKERS[0], color=COLOURS[0], label="eigenvalues")
    axes[0, 1].set(xlabel="external / internal damping (1)", ylabel="threshold / natural frequency (1)")
    axes[0, 1].set_title("Threshold as the closed form says")
    axes[0, 1].legend()
    save_figure(picture, *next(outputs))

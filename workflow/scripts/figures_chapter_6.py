from rotorstudy.studies.job import job

with job(snakemake):
    from pathlib import Path

    import numpy as np

    from rotorstudy.presentation import study_figures as figures
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
    from rotorstudy.response.statics import static_deflection
    from rotorstudy.response.whirl import time_invariant, whirl_modes, without_damping
    from rotorstudy.store import as_complex, load
    from rotorstudy.studies.config import load_study
    from rotorstudy.thesis.scoreboard import published

    PLACES = {1: "left bearing", 2: "disc 1", 3: "crack", 4: "disc 2", 5: "right bearing"}
    config = load_study(snakemake.input.config)
    single = {key: path for key, path in snakemake.input.items() if key != "monte_carlo"}
    data = {key: load(path) for key, path in single.items() if str(path).endswith(".nc")}
    noisy = dict(zip(config.cases, [load(path) for path in snakemake.input.monte_carlo], strict=True))
    printed = published(Path(snakemake.input.published).parent, [f"6.{n}" for n in range(2, 8)])
    outputs = iter(zip(snakemake.output.png, snakemake.output.svg, strict=True))
    harmonics, speed = config.harmonics, config.shown_speeds_rad_s[0]

    def save(picture):
        save_figure(picture, *next(outputs))

    # Figure 6.5: the static line
    model = config.rig(config.main_rig)
    structure = model.structure
    deflection = static_deflection(model, [speed], model.theta[: len(model.rotor_unknowns)]).value[0].real
    length = sum(part["length_m"] for part in config.rigs[config.main_rig]["rotor"]["elements"])
    position = np.linspace(0, length, 201)
    line = np.array([structure.shape_at(s) for s in position]) @ deflection
    at = np.linspace(0, length, len(structure.nodes))
    picture, axes = figure(1, 2, height=2.4)
    axes[0, 0].plot(position, line * 1e6)
    axes[0, 0].plot(at, [deflection[structure.index(n)] * 1e6 for n in structure.nodes], "ko", label="nodes")
    axes[0, 0].set(xlabel="position along the shaft (m)", ylabel="static deflection (µm)", title="Deflection")
    axes[0, 0].invert_yaxis()
    axes[0, 0].legend()
    axes[0, 1].plot(position, np.gradient(line, position) * 1e6)
    axes[0, 1].plot(at, [deflection[structure.index(n, "tilt")] * 1e6 for n in structure.nodes], "ko")
    axes[0, 1].set(xlabel="position along the shaft (m)", ylabel="slope (µrad)", title="Slope")
    bearings = deflection[structure.index(1)] / deflection[structure.index(3)]
    picture.suptitle(f"Static line: bearings take {bearings:.0%} of the deflection at the crack", fontsize=9)
    save(picture)

    # Figures 6.6 to 6.8: records and orbits at five nodes
    here = data["records"].sel(speed=speed, method="nearest").sel(source="from rest")
    shown = here.time.values < 3 * 2 * np.pi / speed
    time = here.time.values[shown] * 1e3
    signals = {n: as_complex(here.displacement.sel(node=n))[shown] * 1e6 for n in PLACES}
    for part, text in ((np.real, "vertical x"), (np.imag, "horizontal y")):
        picture, axes = figure(len(PLACES), 1, height=1.2, width=4.5, sharex=True)
        for panel, (n, place) in zip(axes[:, 0], PLACES.items(), strict=True):
            panel.plot(time, part(signals[n]))
            panel.set_title(f"node {n}: {place}")
        axes[2, 0].set_ylabel(f"{text} (µm)")
        axes[-1, 0].set_xlabel("time (ms)")
        picture.suptitle(f"Three turns at {speed:g} rad/s, from the static deflection", fontsize=9)
        save(picture)
    picture, axes = figure(1, len(PLACES), height=2.4, width=2.0)
    for panel, (n, place) in zip(axes[0], PLACES.items(), strict=True):
        plot_orbit(signals[n] * 1e-6, panel)
        panel.set_title(f"node {n}: {place}")
    picture.suptitle(f"Orbits at {speed:g} rad/s: the shaft moves as a whole on its soft bearings", fontsize=9)
    save(picture)

    # Figures 6.9 and 6.10: full spectra at five nodes
    seen = {"source": "from rest", "record": "complete cycles", "spectrum_method": "regression"}
    rows = {"physical": data["spectra"], "the thesis's reading": data["thesis_spectra"]}
    for first, quantity in ((2, "amplitude"), (5, "phase")):
        picture, axes = figure(len(PLACES), 1, height=1.7, width=4.8)
        for panel, (n, place) in zip(axes[:, 0], PLACES.items(), strict=True):
            for i, (name, found) in enumerate(rows.items()):
                where = found.displacement.sel(**seen, phase_reference="reference", node=n)
                values = as_complex(where.sel(speed=speed, method="nearest"))
                if quantity == "amplitude":
                    plot_full_spectrum(harmonics, values, panel, label=name, index=i, count=2)
                else:
                    plot_phase(harmonics, values, panel, label=name, index=i)
            table = printed[(printed.table == f"6.{first + n - 1}") & (printed.method == "regression")]
            if n <= 3:
                scale = 1e6 if quantity == "amplitude" else 1.0
                panel.plot(table.item.astype(int), table.published * scale, "kx", label="printed in the thesis")
            panel.set_title(f"node {n}: {place}")
            panel.set_xlabel("")
        harmonic_axis(axes[-1, 0], harmonics)
        picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
        picture.suptitle(f"Full spectrum at {speed:g} rad/s, {quantity}", fontsize=9)
        save(picture)

    # mode shapes, and what unbalance does over speed
    uncracked = time_invariant(model)
    values, shapes = whirl_modes(uncracked, speed, without_damping(uncracked))
    lowest = np.flatnonzero(values.imag > 0)[:4]
    interpolated = np.array([structure.shape_at(s) for s in position])
    picture, axes = figure(1, 2, height=2.6)
    for i, mode in enumerate(lowest):
        both = interpolated @ shapes[mode].reshape(2, -1).T  # motion each way round; vertical is their sum
        vertical, horizontal = np.abs(both.sum(axis=1)), np.abs(both[:, 0] - both[:, 1])
        main, way = (vertical, "x") if vertical.max() > horizontal.max() else (horizontal, "y")
        frequency = values[mode].imag / (2 * np.pi)
        axes[0, 0].plot(position, main / main.max(), color=COLOURS[i], label=f"{frequency:.1f} Hz, mostly {way}")
    axes[0, 0].set(xlabel="position along the shaft (m)", ylabel="size (1)", title="Lowest whirl modes")
    axes[0, 0].legend(fontsize=6)
    sweep = np.linspace(20.0, 600.0, 400)
    response = np.abs(measured_response(uncracked, sweep, [1])[:, 0]) * 1e6
    for i, n in enumerate(model.sensors):
        axes[0, 1].semilogy(sweep, response[:, i], color=COLOURS[i], label=f"node {n}")
    axes[0, 1].set(xlabel="spin speed (rad/s)", ylabel="1X forward (µm)", title="Response to unbalance")
    axes[0, 1].legend(fontsize=6)
    first = np.sort(np.abs(values[lowest].imag))[:2]
    picture.suptitle(f"First whirl at {first[0]:.0f} and {first[1]:.0f} rad/s; the thesis prints 415.99", fontsize=9)
    save(picture)

    # error against noise, with what the thesis's condensation costs besides
    best = {case: found.sel(record="steady state") for case, found in noisy.items()}
    save(figures.error_against_noise(best, "Maximum likelihood sits on the bound; least squares does not"))

    # few sensors
    few = data["sensors"]
    picture, axes = figure(1, len(config.cases), height=3.6, width=4.0, sharey=True)
    names = [figures.label(p) for p in few.parameter.values]
    for panel, case in zip(axes[0], config.cases, strict=True):
        for i, (name, nodes) in enumerate(config.sensor_sets.items()):
            right = int((few.start_error.sel(sensors=name, case=case) < 1e-6).sum())
            text = f"nodes {', '.join(map(str, nodes))} ({right} of {few.sizes['start']} far starts)"
            style = {"color": COLOURS[i], "label": text}
            bound = few.bound.sel(sensors=name, case=case) * 100
            panel.plot(bound, range(len(names)), "|", markersize=9, color=COLOURS[i])
            scatter = few.scatter.sel(sensors=name, case=case) * 100
            panel.plot(scatter, range(len(names)), MARKERS[i], fillstyle="none", **style)
        panel.set_xscale("log")
        panel.set(xlabel="error at 1 % noise (%, phases 0.01 rad)", title=case)
        panel.legend(fontsize=5)
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].invert_yaxis()
    picture.suptitle("Two sensors are enough for all parameters (dashes: Cramér-Rao bound)", fontsize=9)
    save(picture)

    # what wrong equations cost without any noise
    variants = data["variants"]
    picture, axes = figure(1, len(config.cases), height=3.6, width=4.0, sharey=True)
    for panel, case in zip(axes[0], config.cases, strict=True):
        for i, name in enumerate(variants.variant.values):
            error = np.maximum(np.abs(variants.relative_error.sel(variant=name, case=case)) * 100, 1e-12)
            panel.plot(error, range(len(names)), MARKERS[i], color=COLOURS[i], fillstyle="none", label=str(name))
        panel.set_xscale("log")
        panel.set(xlabel="error without noise (%, phases 0.01 rad)", title=case)
    axes[0, 0].set_yticks(range(len(names)), names)
    axes[0, 0].invert_yaxis()
    picture.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    picture.suptitle("Errors of eccentricity: the gyroscopic sign, not condensation", fontsize=9)
    save(picture)

    case = next(iter(config.cases))
    save(figures.collinearity(data["identifiability"], case, "What trades off at a single speed"))
    rigs = {"physical": "right gyroscopic sign", "thesis": "the thesis's sign and mass"}
    save(figures.campbell(data["whirl"], rigs, "Whirl on anisotropic bearings"))
    combined = list(config.cases)[1]
    title = "What a wrong modulus or disc mass costs"
    save(figures.bias(data["bias"], {combined: combined}, title))
    title = "What weight dominance costs on this rotor"
    save(figures.weight_dominance(config, data["weight_dominance"], combined, combined, title))
    save(figures.stability(data["stability"]))

"""Names of the figures of a diagnosis and of a blind test, with their captions; free of imports for the workflow."""

DIAGNOSIS_FIGURES = {
    "what_is_wrong": (
        "What the simulation gets wrong",
        "Left: measured minus simulated in standard deviations (noise and stated model error), after the fit of the "
        "rig's own parameters; 1 is expected under noise alone. Right: equivalent residual force, the force at the "
        "measured nodes that would cause the residual; where not all of the rotor is measured the true force may act "
        "elsewhere. "
        "An effect of the measuring chain appears as a force too, although none acts.",
    ),
    "causes": (
        "Explanations tried",
        "Best first, each fitted together with the parameters of the rig. The odds account for the residual it leaves, "
        "its parameters, and the number of causes it was chosen from.",
    ),
    "before_and_after": (
        "Spectra and orbits",
        "The harmonics and one revolution of the orbit, at the nodes with the largest residual; dots: the phase mark "
        "passes; grey circle: clearance of the bearing, where it is stated.",
    ),
    "gain": ("What adding the causes gains", "Error of the rig as given, fitted, and of the rig with the causes."),
}
CHANGE_FIGURES = {
    "two_states": (
        "Both states",
        "Left: one revolution of the orbit about its mean, before and after, at the speed of the largest change; dots: "
        "the phase mark. Right: 1X of both states at every speed; an arrow is the change, the circle at its end the "
        "95 % confidence region.",
    ),
}
BLIND_FIGURES = {
    "answers": "What the diagnosis answered. The first row is of records with nothing hidden; the others are of single "
    "effects of size 3 or more, of the library's form or another one. Named alone is part of in the stated set. The "
    "records are of a simulator that shares nothing with the diagnosis.",
    "curves": "Completeness: share of hidden effects whose cause and place are found. Reliability: share of the named "
    "causes that are true. Error bars are 95 % bounds; dotted: 95 %, and size 3.",
    "confusion": "A row for each hidden effect, a column for each answer; cases with at most one effect, of any size. "
    "Solid boxes: right answers; dashed: confounders that the effect declares. For effects far below size 3 "
    "'nothing' is an appropriate answer.",
    "calibration": "Share of the causes named first that are true, over their stated probability. On the "
    "dotted line the probabilities are calibrated; above it they are too low, below it too high. Labels: numbers "
    "of cases.",
}
ROTOR_FIGURES = {
    "rotor": (
        "The rotor to scale",
        "Grey: shaft; blue: discs, drawn as solid cylinders of their mass and moments of inertia; green: bearings; "
        "arrows: probe planes; orange: cracks.",
    ),
    "probes": (
        "Probes and phase mark",
        "The shaft in the view of the section measurement of the rig file, gravity downward, at the instant when the "
        "phase mark (square) passes its sensor (black bar). Dotted: reference line of the shaft; arrow: sense of "
        "rotation.",
    ),
    "campbell": (
        "Campbell diagram",
        "Damped whirl frequencies. Elliptic whirl is neither clearly forward nor clearly backward. Grey: operating "
        "speeds, where given.",
    ),
    "mode_shapes": (
        "Mode shapes",
        "At the highest operating speed, or the highest shown. Motion in the plane of its largest displacement; "
        "dotted: largest radius of the orbit at each node. Triangles below: bearings; above: planes of probes.",
    ),
    "bode": (
        "Unbalance response",
        "1X along each probe: amplitude, and phase lag from the phase mark. Dotted: critical speeds; grey: operating "
        "speeds, where given. Polar plot: each resonance is a loop.",
    ),
    "polar": ("Polar plot", "The response of the Bode plot; each resonance is a loop."),
    "centreline": (
        "Shaft centreline",
        "Where each journal runs in its bearing, gravity downward, turning counterclockwise. Circle: the "
        "clearance; line: the film of the rig, from the lowest speed (dot) to the highest; crosses: measured, with "
        "the shaft at rest at the bottom.",
    ),
    "stability": (
        "Stability",
        "Largest growth rate of a free motion: real part of an eigenvalue or, where the stiffness rotates with the "
        "shaft, Floquet exponent over one revolution. Above zero the rotor is unstable. Below: the "
        "decrement of the first forward mode, the least damped one below the speed, where it is under one.",
    ),
}
MEASURED_FIGURES = {  # with records of the machine
    name: (ROTOR_FIGURES[name][0], f"{ROTOR_FIGURES[name][1]} Symbols: measured.") for name in ("bode", "polar")
}

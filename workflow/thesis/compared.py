"""The rotors of a comparison, those of replayed experiments included."""

from dataclasses import replace

import numpy as np

from rotorstudy.store import load
from rotorstudy.studies.comparison.config import make_rotor, study_rotor
from rotorstudy.studies.config import load_study
from thesis.config import load_replay


def replay_rotor(compared, replay, identification):
    """The Rotor of a replayed experiment at its own speeds, with the parameters identified from all of them."""
    found = identification.estimate.sel(estimator="maximum_likelihood", data_set="regression").isel(group=-1)
    terms = []
    for term in replay.model.terms:
        values = {}
        for p in term.parameters:
            name = term.full_name(p)
            values[p.name] = float(found.sel(parameter=name))
            if p.is_complex:
                values[p.name] *= np.exp(1j * float(found.sel(parameter=f"{name}_phase")))
        terms.append(replace(term, values=values))
    model = replace(replay.model, terms=tuple(terms))
    speeds = [w for case, w in replay.cases.items() if case != replay.slow_roll]
    return make_rotor(compared, model, model.names, replay.harmonics, speeds)


def load_rotor(config, name, source, identification=None):
    """The Rotor of a comparison by name; source : file of its study or replay; identification : file, of a replay."""
    compared = config.rotors[name]
    if compared.study:
        return study_rotor(compared, load_study(source))
    return replay_rotor(compared, load_replay(source), load(identification))

"""The rotors of a comparison, those of replayed experiments included; its spectra and estimates as files."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from rotorstudy.model.registry import registry
from rotorstudy.store import chunk_of, load, provenance, save
from rotorstudy.studies.comparison import estimates as accuracy
from rotorstudy.studies.comparison import trials
from rotorstudy.studies.comparison.config import make_rotor, study_rotor
from rotorstudy.studies.config import file_name, load_study
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
    return make_rotor(compared, model, model.names, replay.harmonics, list(replay.higher_cases.values()))


def load_rotor(config, name, source, identification=None):
    """The Rotor of a comparison by name; source : file of its study or replay; identification : file, of a replay."""
    compared = config.rotors[name]
    if compared.study:
        return study_rotor(compared, load_study(source))
    return replay_rotor(compared, load_replay(source), load(identification))


def write_spectra(spectra, config, sources, spectrum, chunk):
    """Write the spectra of every rotor by a spectrum method; sources : rotor -> arguments of `load_rotor`."""
    method = registry().get("spectrum", spectrum)
    faults, origin = chunk_of(list(config.faults), *chunk), provenance(config.model_dump(), [method], config.seed)
    for (name, source), path in zip(sources.items(), spectra, strict=True):
        found = trials.spectra(config, name, load_rotor(config, name, *source), method, faults)
        save(found.assign_attrs(origin), path)


def write_estimates(estimates, config, sources, estimator, spectra, bias=()):
    """Write the accuracy of an estimator on every rotor; errors by wrong known quantities go to the paths `bias`."""
    estimator = registry().get("estimator", estimator)
    origin = provenance(config.model_dump(), [estimator], config.seed)
    biased = {Path(path).parent.name: path for path in bias}
    for (name, source), path in zip(sources.items(), estimates, strict=True):
        rotor, file = load_rotor(config, name, *source), file_name(name)
        by_method = {Path(one).stem: load(one) for one in spectra if Path(one).parent.name == file}
        save(accuracy.estimates(config, name, rotor, by_method, estimator).assign_attrs(origin), path)
        if file in biased:
            found = accuracy.bias(load_study(source[0]), rotor, estimator)
            save(found.assign_attrs(origin), biased[file])

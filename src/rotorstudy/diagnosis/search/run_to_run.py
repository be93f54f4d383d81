"""The model of a change between two states of a machine, and what differs from run to run without being one."""

from dataclasses import replace

import numpy as np

from rotorstudy.diagnosis.settings import Settings
from rotorstudy.inference.prior import Prior
from rotorstudy.model.model import Model

LABEL = "change"  # of the terms by which a parameter differs in the later state


def of_change(whole: Model, prior: Prior, settings: Settings) -> tuple[Model, Prior]:
    """The model of a change between two states, and its Prior.

    What the states share cancels. A parameter that differs from run to run changes by the difference of two draws, with
    twice its variance. Where the motion is linear in it, the earlier state can be taken to be without it. One that
    multiplies the motion (the stiffness of a bearing) keeps its value in both; its change is a term of its own.

    whole : with `before`, and the nuisance terms
    prior : of its uncertain parameters
    """
    moving = {name for parameter in settings.run_to_run for name in whole.amplitudes_of(parameter)}
    stds, changes, known = dict(zip(prior.names, prior.std, strict=True)), [], {}
    for one, change in _changes(whole, moving & set(stds)):
        names = [unknown.name for unknown in one.unknowns]
        changes.append(change)
        known |= {new.name: (0.0, np.sqrt(2) * stds[old]) for new, old in zip(change.unknowns, names, strict=True)}
        moving -= set(names)
    moves = np.array([name in moving for name in prior.names], bool)
    twice = np.where(moves, np.sqrt(2), 1.0)
    changed = Prior(prior.names, np.where(moves, 0.0, prior.mean), prior.covariance * np.outer(twice, twice))
    model = replace(whole.plus(*changes), before=frozenset(whole.names) - moving)
    return model, changed.plus(Prior.independent(known))


def _changes(model, moving):
    """(Term of one parameter, Term of its change) for each that multiplies the motion of the rotor and is not zero."""
    for term in model.terms:
        for p in term.parameters:
            one = replace(term, parameters=(p,))
            multiplies = p.force is not None or any(entry.on != "one" for entry in p.entries)
            differs = all(unknown.name in moving for unknown in one.unknowns)
            if differs and multiplies and not term.acts_on_output and term.values.get(p.name):
                label = f"{term.label}, {LABEL}" if term.label else LABEL
                yield one, replace(one, values={p.name: 0.0}, label=label, carries=False)

"""Figures of pages by name, in the order in which they stand there: (title, caption), from templates/captions.yaml."""

from pathlib import Path

from rotorstudy.yaml_file import read_yaml

_STATED = read_yaml(Path(__file__).with_name("templates") / "captions.yaml")
DIAGNOSIS_FIGURES, CHANGE_FIGURES, BLIND_FIGURES, ROTOR_FIGURES = (
    {name: tuple(told) for name, told in _STATED[page].items()} for page in ("diagnosis", "change", "blind", "rotor")
)
MEASURED_FIGURES = {  # with records of the machine
    name: (ROTOR_FIGURES[name][0], f"{ROTOR_FIGURES[name][1]} Symbols: measured.") for name in ("bode", "polar")
}

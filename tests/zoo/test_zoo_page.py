"""The zoo's page follows from the registry: every plugin is on it, also one that lives elsewhere."""

import pytest

from jobs.plugin_pages import plugin_library, shown
from jobs.shown import write_tables
from rotorstudy import registry
from rotorstudy.authoring.facts import tables
from rotorstudy.authoring.files import new_plugin
from rotorstudy.commands.line import main
from rotorstudy.model.kinds import KINDS
from rotorstudy.model.registry import Registry, plugin_folders, using


def test_every_plugin_is_on_the_page_with_its_source_and_checks():
    found = tables()
    assert set(found) == set(KINDS)
    for kind, table in found.items():
        assert list(table.name) == sorted(registry().plugins[kind])
        assert table["source"].str.len().min() > 3 and table["checked against"].str.len().min() > 10
    assert found["bearing"].parameters.str.contains("typically").all()
    assert all(found[kind].claims.str.len().max() > 5 for kind in ("spectrum", "estimator", "bearing"))


def test_a_plugin_of_another_folder_is_on_the_page(tmp_path):
    path = new_plugin("bearing", "mine", tmp_path)
    with using(Registry(plugin_folders(), files=[path])):
        row = tables()["bearing"].set_index("name").loc["mine"]
    # ten times the stiffness of the rotor that the page takes its sizes from
    assert "bearing_stiffness_N_per_m (typically 7.6e+06)" in row.parameters
    assert "mine" not in set(tables()["bearing"].name)


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_says_all_that_the_table_says_in_few_columns(kind):
    table = tables()[kind]
    page = shown(table)
    assert list(page["name"].str.split("\n").str[0]) == list(table["name"]) and len(page.columns) <= 4
    for (_, row), (_, facts) in zip(page.iterrows(), table.iterrows(), strict=True):
        said = " ".join(row)
        assert all(part in said for text in facts for part in text.split("; "))


def test_the_page_and_its_table_are_written(tmp_path):
    write_tables(plugin_library(), [tmp_path / "zoo.html", tmp_path / "zoo.csv"])
    page, table = ((tmp_path / f"zoo.{suffix}").read_text() for suffix in ("html", "csv"))
    assert all(plugin.name in page and plugin.name in table for _, plugin in registry())


def test_one_plugin_on_the_command_line(capsys, command):
    said = command("plugins", "--name", "short_journal").out
    for words in ("bearing short_journal", "load_N", "viscosity_Pa_s", "bearing_scale", "source"):
        assert words in said
    assert main(["plugins", "--name", "linear"]) == main(["plugins", "--name", "finite_element"]) == 0
    said = capsys.readouterr().out  # the keys of every choice, and those inside lists
    assert "isotropic or anisotropic" in said and "bearing_stiffness_xy_N_per_m" in said
    assert "discs with node, mass_kg?" in said
    assert "did you mean 'short_journal'" in command("plugins", "--name", "short_jurnal", status=1).err

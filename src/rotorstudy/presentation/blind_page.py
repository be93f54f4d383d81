"""The pages of a blind test: acceptance criteria with their figures, and cases with a wrong answer."""

from pathlib import Path

import numpy as np
import pandas as pd

from rotorstudy.blind.criteria import AT_A_GLANCE, LARGE, judge, sentences, statement
from rotorstudy.blind.meanings import MEANS
from rotorstudy.blind.scoring import ANSWERS_WITHOUT_CAUSE, calibration, is_chain, share_bounds
from rotorstudy.model.registry import registry
from rotorstudy.presentation.captions import BLIND_FIGURES
from rotorstudy.presentation.pages import Table, cells, pictures, render, to_index, write_csv, write_html
from rotorstudy.presentation.plots import COLOURS, MARKERS, figure, finished, save_pictures
from rotorstudy.store import write_text

MARKS = {"reached": "good", "not reached": "bad", "undecided": "doubtful"}
SIZE_EDGES = np.array([0.3, 1.0, 2.0, 3.0, 6.0, 12.0, 30.0, 100.0, 300.0])


def write_pages(data, criteria, rows, folder, others=None, index=None):
    """Write figures (PNG, SVG), criteria and cases (CSV, HTML) to a folder; others : name -> rows (CSV) of a run."""
    folder = Path(folder)
    criteria = pd.concat([*(judge(pd.read_csv(path), name) for name, path in (others or {}).items()), criteria])
    figures = {"answers": answers_figure(criteria), "curves": curves(rows, criteria[criteria.key == "in_set"].iloc[-1])}
    figures |= {"confusion": confusion_figure(rows), "calibration": calibration_figure(rows)}
    png = save_pictures(figures, folder / "figures")
    write_csv(criteria, folder / "criteria.csv")
    write_csv(rows.drop(columns=["seconds"]), folder / "cases.csv")
    source = (
        f"{data.attrs['cases']} cases of seed {data.attrs['seed']}: effects were hidden in records of an "
        "independent simulator, and the truth was sealed before the diagnosis began."
    )
    figures = pictures(png, BLIND_FIGURES)
    links = to_index(folder / "criteria.html", index)
    wrong = links | {"Cases with a wrong answer": "cases.html"}
    write_text(folder / "criteria.html", criteria_page(criteria, source, figures, wrong))
    _write_cases(rows, source, folder, links | {"How often the diagnosis is right": "criteria.html"})


def criteria_page(criteria, source, figures, links=None):
    """The page as HTML; criteria : of one source or several."""
    return render(
        "blind.html",
        title="Blind tests: how often the diagnosis is right",
        opening=sentences(criteria),
        source=source,
        runs={
            name: {
                "statement": statement(judged),
                "missed": judged[judged.status == "not reached"].to_dict("records"),
                "table": cells(judged[judged.cases > 0].drop(columns=["key", "kind", "source"]), 3, "reasons"),
            }
            for name, judged in criteria.groupby("source", sort=False)
        },
        marks=MARKS,
        figures=list(figures.values()),
        links=links or {},
    )


def _write_cases(cases, source, folder, links):
    """The page of the cases with a wrong answer, the largest effects first."""
    outside = (cases.group == "outside") & (cases["size"] >= LARGE) & (cases.verdict != "unknown")
    known = ~cases.group.isin(["outside", "clean"]) & ~cases.in_set.astype(bool)
    wrong = known | (cases.group == "clean") & (cases.verdict != "nothing") | outside
    shown = cases[wrong].sort_values("size", ascending=False)
    shown = shown[["case", "kind", "machine", "size", "families", "verdict", "answer", "probability"]]
    shown = shown.assign(**{key: shown[key].str.replace("_", " ") for key in ("families", "answer")})
    by_rig = cases.groupby("machine").seconds.agg(["count", "mean", "max"]).reset_index()
    note = f"{len(shown)} of {len(cases)} cases have a wrong answer, the largest effects first. Size is in "
    note += "standard deviations; an effect below 1 can hardly be detected."
    tables = {"Cases": shown, "Duration of a diagnosis (s)": by_rig}
    title = "Blind tests: cases with a wrong answer"
    write_html(folder / "cases.html", Table(shown, title, [note, source], 3, tables), links)


def _shares(found, of):
    """Shares (bin,) and how far their 95 % bounds reach below and above (2, bin)."""
    share = found / of
    low, high = np.array([share_bounds(int(k), int(n)) for k, n in zip(found, of, strict=True)]).reshape(-1, 2).T
    return share, np.abs([share - low, high - share])


def answers_figure(criteria):
    """The answers at a glance, a point with 95 % bounds for each source of the truth."""
    shown = criteria[criteria.key.isin(list(AT_A_GLANCE)) & (criteria.cases > 0)]
    sources = list(dict.fromkeys(criteria.source))
    picture, ((axes,),) = figure(height=1.4 + 0.7 * len(sources), width=6.4)
    for i, source in enumerate(sources):
        rows = shown[shown.source == source]
        place = np.array([list(AT_A_GLANCE).index(key) for key in rows.key]) + 0.3 * (i - (len(sources) - 1) / 2)
        reach = 100 * np.array([rows.reached - rows.low, rows.high - rows.reached])
        style = {"fmt": MARKERS[i], "color": COLOURS[i], "capsize": 2, "label": source}
        axes.errorbar(100 * rows.reached, place, xerr=reach, **style)
        for y, row in zip(place, rows.itertuples(), strict=True):
            axes.text(103, y, f"{row.found} of {row.cases}", va="center", fontsize=7, color=COLOURS[i])
    axes.set_yticks(range(len(AT_A_GLANCE)), [name for name, _ in AT_A_GLANCE.values()])
    axes.set(xlim=(-2, 118), ylim=(len(AT_A_GLANCE) - 0.4, -0.6), xlabel="share of cases (%), with 95 % bounds")
    axes.set_xticks(range(0, 101, 20))
    told = ", ".join(f"{row.found} of {row.cases}" for row in shown[shown.key == "in_set"].itertuples())
    told = f"The hidden effect is named or not ruled out in {told or 'no case'}"
    return finished(picture, told, legend=2, size=8, frameon=False)


def curves(rows, in_set):
    """Completeness and reliability over the size of the effect; in_set : criterion of that name."""
    picture, ((axes,),) = figure(height=2.8, width=4.2)
    right, middle = rows.in_set.to_numpy(bool), np.sqrt(SIZE_EDGES[1:] * SIZE_EDGES[:-1])
    size = np.digitize(rows["size"], SIZE_EDGES[1:-1])
    single = rows.group.isin(["single", "chain"]).to_numpy(bool)
    naming = ((rows.causes > 0) & (rows.group != "two")).to_numpy(bool)
    for i, (name, chosen) in enumerate((("completeness", single), ("reliability", naming))):
        found, of = (np.bincount(size[some], minlength=len(middle)) for some in (chosen & right, chosen))
        there = of > 0
        share, reach = _shares(found[there], of[there])
        place = middle[there] * (1.03 if i else 0.97)
        axes.errorbar(place, share, reach, color=COLOURS[i], fmt=f"-{MARKERS[i]}", capsize=2, label=name)
    axes.axhline(0.95, color="0.5", linewidth=0.8, linestyle=":")
    axes.axvline(LARGE, color="0.5", linewidth=0.8, linestyle=":")
    axes.set(xscale="log", ylim=(-0.03, 1.03), ylabel="share of cases, 95 % bounds")
    axes.set_xticks([1, 3, 10, 30, 100], ["1", "3", "10", "30", "100"])
    axes.set_xlabel("size of the effect (standard deviations)")
    found = f"{in_set.found} of {in_set.cases} cases ({100 * in_set.low:.0f} to {100 * in_set.high:.0f} %)"
    axes.legend(loc="lower right")
    return finished(picture, f"In the stated set at size 3 and more: {found}", size=8)


def confusion_figure(rows):
    """Counts of answers by truth; right answers and declared confounders boxed."""
    from matplotlib.patches import Rectangle

    truths, answers, counts = confusion(rows)
    accepted = confounders_of(truths, answers)
    there = counts.sum(axis=0) > 0
    answers, counts, accepted = np.array(answers)[there], counts[:, there], accepted[:, there]
    whole = np.maximum(counts.sum(axis=1, keepdims=True), 1)
    picture, ((axes,),) = figure(height=0.19 * len(truths) + 1.9, width=0.19 * len(answers) + 1.6)
    axes.grid(False)
    axes.imshow(counts / whole, cmap="Blues", vmin=0, vmax=3, aspect="auto")  # tinted: a count is read, not guessed
    for i, j in zip(*np.nonzero(counts), strict=True):
        axes.text(j, i, counts[i, j], ha="center", va="center", fontsize=7)
    for i, j in zip(*np.nonzero(accepted), strict=True):
        right = accepted[i, j] == 1
        style = {"edgecolor": "k", "linewidth": 1.2} if right else {"edgecolor": "#E69F00", "linewidth": 0.9}
        axes.add_patch(Rectangle((j - 0.5, i - 0.5), 1, 1, fill=False, linestyle="-" if right else "--", **style))
    axes.set_xticks(range(len(answers)), list(map(_called, answers)), rotation=90)
    axes.set_yticks(range(len(truths)), list(map(_called, truths)))
    axes.set(xlabel="first answer", ylabel="hidden")
    share = 100 * counts[accepted == 1].sum() / max(counts.sum(), 1)
    dashed = "; dashed: a declared confounder" * bool((accepted == 2).any())
    axes.set_title(f"First answer right (boxed) in {share:.0f} % of cases{dashed}")
    return picture


def _called(effect):
    """ac_coupling -> AC coupling."""
    return str(effect).replace("_", " ").replace("ac coupling", "AC coupling")


def calibration_figure(rows):
    """Share of true causes over their stated probability."""
    picture, ((axes,),) = figure(height=2.8)
    stated = rows[rows.probability.notna()]
    said, right, count, error = calibration(stated.probability.to_numpy(float), stated.first_right.to_numpy(float))
    there = count > 0
    place, (share, reach) = said[there] / count[there], _shares(right[there], count[there])
    axes.plot([0, 1], [0, 1], color="0.5", linewidth=0.8, linestyle=":", label="calibrated")
    axes.errorbar(place, share, reach, fmt="-o", color=COLOURS[0], capsize=2, label="observed")
    for x, y, n in zip(place, share, count[there], strict=True):
        axes.annotate(int(n), (x, y), textcoords="offset points", xytext=(-4, -9), fontsize=6, ha="right")
    axes.set(xlim=(0, 1.03), ylim=(0, 1.03), ylabel="share that is true")
    axes.set_xlabel("stated probability of the first cause")
    axes.set_title(f"Stated probabilities are off by {error:.2f} on average" if len(stated) else "No cause was stated")
    axes.legend()
    return picture


def confusion(rows):
    """Truths, answers, and counts (truth, answer), of cases with at most one effect, which the library has."""
    seen = rows[rows.group.isin(["clean", "single", "chain"])]
    one = seen.answer.where(~seen.answer.str.contains("+", regex=False), "two causes")
    families = seen.families.where(seen.families != "", "clean")
    truths = sorted(families.unique(), key=lambda name: (name != "clean", is_chain(name), name))
    others = {"nothing", "two causes", *ANSWERS_WITHOUT_CAUSE}
    usual = [name for family in truths if family != "clean" for name in MEANS[family].names if name in set(one)]
    answers = list(dict.fromkeys(usual)) + sorted(set(one) - set(usual) - others)
    answers = ["nothing", *answers, "two causes", *ANSWERS_WITHOUT_CAUSE[1:]]
    counts = pd.crosstab(families, one).reindex(index=truths, columns=answers, fill_value=0)
    return truths, answers, counts.to_numpy(int)


def confounders_of(truths, answers):
    """(truth, answer): 1 where the answer is right, 2 where it is a declared confounder, else 0."""
    zoo, found = registry().plugins["effect"], []
    for truth in truths:
        means = MEANS[truth].names if truth in MEANS else ("nothing",)
        alike = {name for one in means if one in zoo for name in registry().confounders(one)}
        found.append([1 if answer in means else 2 * (answer in alike) for answer in answers])
    return np.array(found, int).reshape(len(truths), len(answers))

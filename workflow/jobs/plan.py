"""Every job of the workflow. A job does what it can for all rigs, rotors or cases: its start takes longer than most."""

import re
from pathlib import Path
from typing import NamedTuple

from jobs.index_page import HEADED
from jobs.report import FIGURES, SHOWN, TABLES, add_printed, add_replay
from rotorstudy.model.registry import registry
from rotorstudy.model.rig import named_plugins
from rotorstudy.presentation.pages import to_index
from rotorstudy.studies.config import file_name, named_methods
from rotorstudy.yaml_file import read_yaml

LOAD_STUDY, LOAD_REPLAY = "rotorstudy.studies.config.load_study", "thesis.config.load_replay"
LOAD_COMPARISON = "rotorstudy.studies.comparison.config.load_comparison"
LOAD_BLIND = "rotorstudy.blind.config.load_blind"
REPLAY_STAGES = ("records", "spectra", "identification")
CRACK_STUDY = "rotorstudy.studies.crack_study"
CRACK_STAGES = ("limits", "accuracy", "trials", "fronts", "passage", "thesis_method")
THESIS = {f"chapter_{n}" for n in range(2, 7)}
BLIND_CHUNK = "rotorstudy.blind.run.answer_chunk"
TESTED = ("rotor", "crack", "bearing", "effect")  # kinds of plugins that a diagnosis tries


class Job(NamedTuple):
    """A rule: a function, called with files and further arguments by name."""

    name: str
    function: str  # full name
    load: str = ""  # full name of what reads the file `config`
    inputs: dict = {}  # argument -> path or paths; NetCDF files are opened
    outputs: dict = {}  # argument -> path or paths
    given: dict = {}  # further arguments
    needs: tuple = ()  # further files that it depends on
    makes: tuple = ()  # further files that it writes
    priority: int = 0
    threads: int = 1

    @property
    def files(self):
        """All that it writes."""
        named = (path for given in self.outputs.values() for path in ([given] if isinstance(given, str) else given))
        return [*named, *self.makes]

    @property
    def functions(self):
        """Full names of its function and of those that it is given to call."""
        calls, named = self.given.get("calls", ()), [self.function, self.load, self.given.get("function")]
        return [*filter(None, named), *(name for name, _ in (calls.values() if isinstance(calls, dict) else calls))]

    @property
    def log(self):
        """Name of its log, with the wildcards of its files."""
        return "_".join([self.name, *sorted(set(re.findall(r"{\w+}", " ".join(self.files))))])


def plugin_files(rigs, plugins=()):
    """Files of the plugins that rigs name, and of further plugins."""
    return sorted({plugin.file for plugin in [*plugins, *(p for rig in rigs for p in named_plugins(rig))]})


def files_of_kinds(*kinds):
    """Files of all plugins of some kinds, by default of every kind."""
    return tuple(sorted({plugin.file for kind, plugin in registry() if not kinds or kind in kinds}))


def computed(name, load, config, data, calls, plugins, priority=0, needs=(), **needed):
    """A Job of `jobs.datasets.compute`; calls : (full name of a function, its arguments) of each file of `data`."""
    inputs = {"config": config, "plugins": plugins, **needed}
    return Job(name, "jobs.datasets.compute", load, inputs, {"data": data}, {"calls": calls}, needs, priority=priority)


def drawn(name, load, config, module, shown, pictures, given=None, needs=(), priority=0, **results):
    """A Job of `jobs.shown.draw`; shown : figure -> its arguments, among them `kind`, a function of the module."""
    calls = {}
    for figure, arguments in shown.items():
        arguments = {**(given or {}), **arguments}
        calls[figure] = f"{module}.{arguments.pop('kind', figure).replace(' ', '_')}", arguments
    inputs, outputs = {"config": config, **results}, {"pictures": pictures}
    return Job(name, "jobs.shown.draw", load, inputs, outputs, {"calls": calls}, needs, priority=priority)


class Plan:
    """The jobs of Settings."""

    def __init__(self, settings):
        self.settings, self.config = settings, settings.config
        self.results, self.reference = self.config.results, self.config.reference
        self.index = {"index": f"{self.results}/index.html"}  # which every page links to
        self.printed = tuple(f"{self.reference}/{name}.csv" for name in ("full_spectrum", "identified_parameters"))
        for name, replay in settings.replays.items():
            add_replay(name, replay)
        described = read_yaml(f"{self.reference}/tables.yaml")
        for name in settings.studies.keys() & described.keys():
            number, title, note = (described[name]["assumed"][key] for key in ("number", "title", "note"))
            add_printed(name, {number: (title, note), **described[name]["tables"]})
        self.chapters = sorted(name for name in TABLES if name in settings.studies or name in settings.replays)

    def jobs(self):
        """All of them, the index last."""
        found = [job for item in self.settings.studies.items() for job in self.study(*item)]
        found += [job for item in self.settings.replays.items() for job in self.replay(*item)]
        found += [job for name in self.chapters for job in self.chapter(name)]
        found += [*self.over_all_chapters(), *self.plugin_library(), *self.diagnoses()]
        for key, jobs in (("compare", self.comparison), ("blind", self.blind), ("crack_study", self.crack_study)):
            found += jobs() if getattr(self.config, key) else []
        files = [path for job in found for path in job.files if "{" not in path]
        pages = {"path": self.index["index"], "report": f"{self.results}/report.rst"}
        return [*found, Job("index", "jobs.index_page.write_index", "", {"files": files}, pages, needs=(str(HEADED),))]

    def of(self, name, *stages):
        """Paths of the results of a study or replay."""
        return [f"{self.results}/{name}/{stage}.nc" for stage in stages]

    def pictures(self, group, folder=None):
        """Paths of the figures of a group, in its folder of the results or in another one."""
        folder = folder or f"{self.results}/{group}"
        return [f"{folder}/figures/{name}.{kind}" for kind in ("png", "svg") for name in FIGURES[group]]

    def tables(self, *names):
        """Paths of tables, for programs and as pages."""
        return [f"{self.results}/{name}.{kind}" for kind in ("csv", "html") for name in names]

    def page(self, name, function, inputs, files=None, given=None, needs=(), load=""):
        """A Job of `jobs.shown.write`, by default of one table, for programs and as a page."""
        given = {"function": function, **self.index, **(given or {})}
        return Job(name, "jobs.shown.write", load, inputs, {"files": files or self.tables(name)}, given, needs)

    def study(self, name, study):
        """Stages of a simulated study."""

        def job(stage, data, calls, *kinds, **needed):
            methods = [plugin for kind in kinds for plugin in study.methods[kind].values()]
            plugins, first = plugin_files(study.rigs.values(), methods), int(stage.startswith("monte_carlo"))
            calls = [(f"rotorstudy.studies.{function}", given) for function, given in calls]
            config = self.config.studies[name]
            return computed(f"{stage}_{name}", LOAD_STUDY, config, data, calls, plugins, first, **needed)

        def of_rigs(stage):
            return self.of(name, *(f"{stage}/{rig}" for rig in study.rigs))

        def for_rigs(function):
            return [(function, {"rig": rig}) for rig in study.rigs]

        def once(stage, functions, *kinds):
            return job(stage, self.of(name, *functions), [(call, {}) for call in functions.values()], *kinds)

        names = ("identifiability", "stability", "weight_dominance", "whirl", *(["variants"] if study.variants else []))
        # errors by wrong known quantities, and with fewer sensors
        sensitivity = {"bias": "identify.bias"} | ({"sensors": "sensors.sensors"} if study.sensor_sets else {})
        records = of_rigs("records")
        return [
            *(one for rig in study.monte_carlo.rigs for one in self.trials(name, study, rig, job)),
            job("simulate", records, for_rigs("simulate.simulate")),
            job("spectra", of_rigs("spectra"), for_rigs("simulate.spectra"), "spectrum", records=records),
            job("identify", of_rigs("identification"), for_rigs("identify.identify"), "spectrum", "estimator"),
            once("sensitivity", sensitivity, "estimator"),
            once("analyses", {name: f"analyses.{name}" for name in names}),
        ]

    def trials(self, name, study, rig, job):
        """Monte Carlo trials of a rig: in one job, or in chunks of the noise levels and a job that gathers them."""
        chunks = min(self.config.chunks.monte_carlo, len(study.monte_carlo.levels_percent))
        cases, stage = [file_name(case) for case in study.cases], f"monte_carlo_{rig}"

        def of_cases(stage, function, ending, needed, **given):
            data = self.of(name, *(f"monte_carlo/{rig}/{ending.format(case)}" for case in cases))
            return job(stage, data, [(function, {"case": case, **given}) for case in cases], "estimator", **needed)

        if chunks == 1:
            return [of_cases(stage, "identify.monte_carlo", "{}", {}, rig=rig)]
        split = {"rig": rig, "chunks": chunks}
        some = [
            of_cases(f"{stage}_{i}", "identify.monte_carlo", f"chunks/{{}}_{i}", {}, chunk=i, **split)
            for i in range(chunks)
        ]
        parts = {"parts": [path for one in some for path in one.files]}
        return [*some, of_cases(stage, "identify.gather_monte_carlo", "{}", parts, chunks=chunks)]

    def replay(self, name, replay):
        """Stages of a replayed experiment, the first to run: they are short, and what the first figures need."""
        methods = named_methods(replay.spectra, replay.estimators, f"replay {name}")
        estimators = plugin_files([replay.rig], methods["estimator"].values())
        (records, spectra, found), reference = self.of(name, *REPLAY_STAGES), {"reference": self.reference}

        def job(stage, path, given, plugins, **needed):
            config, calls = self.config.replays[name], [(f"thesis.replay.{stage}", given)]
            return computed(f"{stage}_{name}", LOAD_REPLAY, config, [path], calls, plugins, 2, self.printed, **needed)

        return [
            job("records", records, reference, []),
            job("spectra", spectra, {}, plugin_files([], methods["spectrum"].values()), records=records),
            job("identify", found, reference, estimators, spectra=spectra),
        ]

    def chapter(self, name):
        """Figures and tables of a chapter of the thesis."""
        given, needs = {"reference": self.reference}, self.printed
        if name in self.settings.replays:
            config, load, module = self.config.replays[name], LOAD_REPLAY, "thesis.figures.replays"
            shown = {figure: item.model_dump() for figure, item in self.settings.replays[name].figures.items()}
            results = dict(zip(REPLAY_STAGES, self.of(name, *REPLAY_STAGES), strict=True))
            tabling, priority = "thesis.replay_tables.tables", 2
        else:
            config, load, module, shown = self.config.studies[name], LOAD_STUDY, "thesis.figures", SHOWN[name]
            results = self.of_study(self.settings.studies[name], name)
            tabling, priority = "thesis.chapter_tables.tables", 0
            needs += tuple(f"{self.reference}/{file}" for file in ("rows_of_estimates.csv", "tables.yaml"))
        files = [f"{self.results}/{name}/scored.csv", *self.tables(*(f"{name}/tables/{one}" for one in TABLES[name]))]
        inputs = {"config": config, "reasons": f"{self.reference}/reasons.yaml", **results}
        pictures = self.pictures(name)
        return [
            drawn(f"figures_{name}", load, config, module, shown, pictures, given, needs, priority, **results),
            self.page(f"tables_{name}", tabling, inputs, files, given, needs, load),
        ]

    def of_study(self, study, name):
        """Results that the figures and the tables of a simulated chapter show, by argument."""
        same = ["bias", "weight_dominance", "stability", "whirl", "identifiability"]
        same += ["sensors"] * bool(study.sensor_sets) + ["variants"] * bool(study.variants)
        places = {stage: stage for stage in same} | {"records": "records/physical", "spectra": "spectra/physical"}
        places |= {f"{stage}_thesis": f"{stage}/thesis" for stage in ("spectra", "identification")}
        found = dict(zip(places, self.of(name, *places.values()), strict=True))
        for rig in study.monte_carlo.rigs:
            trials = self.of(name, *(f"monte_carlo/{rig}/{file_name(case)}" for case in study.cases))
            found["monte_carlo" if rig == "physical" else f"monte_carlo_{rig}"] = trials
        return found

    def over_all_chapters(self):
        """Scoreboard, errata and -1X of both rigs; the last two need all chapters."""
        scored = {"scored": [f"{self.results}/{name}/scored.csv" for name in self.chapters]}
        found = [self.page("scoreboard", "thesis.scoreboard.scoreboard", scored)]
        if not set(self.chapters) >= THESIS:
            return found
        inputs = {"errata": f"{self.reference}/errata.yaml"}
        every = {**self.config.studies, **self.config.replays}
        inputs |= {name: path for name, path in every.items() if name in THESIS}
        inputs["thesis_spectra"], inputs["weight_dominance"], inputs["monte_carlo"] = self.of(
            "chapter_4", "spectra/thesis", "weight_dominance", "monte_carlo/thesis/20_to_50_Hz"
        )
        inputs["spectra"], inputs["identification"] = self.of("chapter_5", *REPLAY_STAGES[1:])
        (inputs["variants"],) = self.of("chapter_6", "variants")
        found.append(self.page("errata", "thesis.errata.errata_table", inputs, needs=self.printed))
        configs = {name: self.config.replays[name] for name in ("chapter_3", "chapter_5")}
        inputs = {name: self.of(name, "spectra")[0] for name in configs}
        files, needs = self.tables("rigs/backward_1X"), (*self.printed, *configs.values())
        function = "thesis.backward_1x.backward_1x_table"
        return [*found, self.page("backward_1X", function, inputs, files, {"configs": configs}, needs)]

    def plugin_library(self):
        """The plugins, crack models and bearings side by side, and what others printed beside ours."""
        zoo = self.page("zoo", "jobs.plugin_pages.plugin_library", {}, needs=files_of_kinds())
        outputs = {"data": f"{self.results}/bearings/coefficients.nc"}
        outputs["pictures"] = [f"{self.results}/bearings/coefficients.{kind}" for kind in ("png", "svg")]
        function, needs = "jobs.bearing_figures.write_bearings", files_of_kinds("bearing")
        found = [zoo, Job("bearings", function, outputs=outputs, needs=needs)]
        if self.config.published:
            rigs = sorted(map(str, Path(self.config.published).glob("*.yaml")))
            needs = (*(path.removesuffix(".yaml") + ".csv" for path in rigs), *plugin_files(map(read_yaml, rigs)))
            function = "jobs.plugin_pages.published"
            found.append(self.page("published", function, {"rigs": rigs}, needs=needs))
        if config := self.config.cracks:
            load, (data,) = "rotorstudy.studies.cracks.load_cracks", self.of("cracks", "comparison")
            compared = [plugin for kind, plugin in registry() if kind in ("crack", "depth")]
            plugins = plugin_files([self.settings.cracks.base], compared)
            calls = [("rotorstudy.studies.cracks.compare", {})]
            found.append(computed("cracks", load, config, [data], calls, plugins))
            module, pictures = "jobs.crack_figures", self.pictures("cracks")
            found.append(drawn("figures_cracks", load, config, module, SHOWN["cracks"], pictures, comparison=data))
        return found

    def crack_study(self):
        """Chapter 7, our own: how small transverse cracks are detected, and how accurately they are found."""
        study, config = self.settings.crack_study, self.config.crack_study
        load = f"{CRACK_STUDY}.config.load_crack_study"
        rigs = [rotor.model_dump(include={"rotor", "bearings", "effects"}) for rotor in study.rotors.values()]
        used = [registry().get("effect", study.crack.kind), *registry().plugins["depth"].values()]
        calls = [(f"{CRACK_STUDY}.{'fronts' if one == 'fronts' else 'stages'}.{one}", {}) for one in CRACK_STAGES]
        data, pictures = self.of(study.name, *CRACK_STAGES), self.pictures("chapter_7", f"{self.results}/{study.name}")
        results, module = dict(zip(CRACK_STAGES, data, strict=True)), "jobs.crack_study_figures"
        return [
            computed("crack_study", load, config, data, calls, plugin_files(rigs, used)),
            drawn("figures_crack_study", load, config, module, SHOWN["chapter_7"], pictures, **results),
        ]

    def comparison(self):
        """Every spectrum method with every estimator, in chunks of the faults; a new estimator reuses spectra."""
        compared, base = self.settings.compare.rotors, f"{self.results}/compare"
        chunks = min(self.config.chunks.compare, len(self.settings.compare.faults))
        sources, rigs = {}, []  # files of each rotor
        for name, rotor in compared.items():
            if rotor.study:
                study = self.settings.studies[rotor.study]
                sources[name] = [self.config.studies[rotor.study]]
                rigs.append(study.rigs[study.main_rig])
            else:
                sources[name] = [self.config.replays[rotor.replay], *self.of(rotor.replay, "identification")]
                rigs.append(self.settings.replays[rotor.replay].rig)
        needs = (*(path for files in sources.values() for path in files), *plugin_files(rigs))
        inputs, found = {"config": self.config.compare}, []

        def job(kind, stage, plugin, number, needs, outputs, **more):
            name, function = f"compare_{stage}_{plugin}_{number}", f"thesis.compared.write_{stage}"
            given, needs = {"sources": sources, kind: plugin, **more}, (*needs, registry().get(kind, plugin).file)
            found.append(Job(name, function, LOAD_COMPARISON, inputs, outputs, given, needs))

        def paths(folder, stage, name, rotors=compared):
            return [f"{folder}/{stage}/{file_name(rotor)}/{name}.nc" for rotor in rotors]

        for chunk in range(chunks):
            folder = base if chunks == 1 else f"{base}/chunks/{chunk}"
            spectra = []
            for name in sorted(registry().plugins["spectrum"]):
                files = {"spectra": paths(folder, "spectra", name)}
                spectra += files["spectra"]
                job("spectrum", "spectra", name, chunk, needs, files, chunk=(chunk, chunks))
            for name in sorted(registry().plugins["estimator"]):
                files = {"estimates": paths(folder, "estimates", name)}
                if chunk == 0:  # also the errors by wrong known quantities
                    files["bias"] = paths(base, "bias", name, [r for r in compared if compared[r].study])
                job("estimator", "estimates", name, chunk, (*needs, *spectra), files, spectra=spectra)
        outputs = {"comparison": f"{base}/comparison.nc", "pictures": self.pictures("compare")}
        outputs["sheets"] = [f"{base}/ranking.csv", *self.tables("compare/advice")]
        function, kinds = "jobs.comparison_page.write_comparison", ("spectra", "estimates", "bias")
        every = {kind: [path for made in found for path in made.outputs.get(kind, ())] for kind in kinds}
        needs = tuple(path for made in found for path in made.files)
        return [*found, Job("compare", function, LOAD_COMPARISON, inputs, outputs, {**every, **self.index}, needs)]

    def blind(self):
        """Effects hidden in simulated records, diagnosed without the truth: in chunks, gathered into one array."""
        inputs, chunks, folder = {"config": self.config.blind}, self.config.chunks.blind, f"{self.results}/blind"
        outputs = {name: f"{folder}/chunks/{{chunk}}/{name}.json" for name in ("seals", "answers")}
        given, plugins, function = {"chunks": chunks, "out": folder}, files_of_kinds(*TESTED), BLIND_CHUNK
        threads = 8 if chunks == 1 else 1  # at most
        some = Job("blind_chunk", function, LOAD_BLIND, inputs, outputs, given, plugins, threads=threads)
        inputs = inputs | {name: [path.format(chunk=i) for i in range(chunks)] for name, path in outputs.items()}
        inputs["independent"], sources = [*self.config.independent_records.values()], [*self.config.independent_records]
        names = ("blind.nc", "seals.json", "truths.json", "verdicts.json")
        pages = self.tables("blind/criteria", "blind/cases")
        makes = (*(f"{folder}/{name}" for name in names), *pages, *self.pictures("blind"))
        given = {"folder": folder, "sources": sources, **self.index}
        return [some, Job("blind", "jobs.blind.gather", LOAD_BLIND, inputs, given=given, makes=makes)]

    def diagnoses(self):
        """Diagnoses of measured records, a folder each, and a page on those of replayed experiments."""
        base, found, items = f"{self.results}/diagnosis", [], self.config.diagnoses
        plugins, function = files_of_kinds(*TESTED), "rotorstudy.presentation.diagnosis_files.diagnose_files"
        for name, item in items.items():
            folder, inputs = f"{base}/{name}", {"records": item.records, "rig_path": item.rig}
            names = ("verdict.json", "verdict.nc", "extended_rig.yaml", "index.html")
            makes = (*(f"{folder}/{file}" for file in names), *self.pictures("diagnosis", folder))
            links = to_index(f"{folder}/index.html", self.index["index"])
            given = {"out": folder, "name": name.replace("_", " "), "links": links}
            found.append(Job(f"diagnose_{name}", function, "", inputs, {}, given, plugins, makes))
            if item.replay:
                outputs, left_out = {"path": f"{folder}/left_out.json"}, "thesis.left_out.write"
                found.append(Job(f"diagnose_left_out_{name}", left_out, "", inputs, outputs, needs=plugins))
        if folders := [f"{base}/{name}" for name, item in items.items() if item.replay]:
            inputs = {"configs": [self.config.replays[item.replay] for item in items.values() if item.replay]}
            names = ("verdict.json", "verdict.nc", "left_out.json")
            texts = f"{self.reference}/undecided.yaml"
            needs = (*(f"{folder}/{file}" for folder in folders for file in names), *self.printed, texts)
            files = [f"{base}/replays_{sheet}.csv" for sheet in ("harmonics", "left_out", "parameters")]
            given, function = {"folders": folders, "reference": self.reference}, "thesis.replays_page.replays_page"
            files.append(f"{base}/replays.html")
            found.append(self.page("diagnose_replays", function, inputs, files, given, needs))
        return found

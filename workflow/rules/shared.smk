# What the rules of bearings, comparison, blind tests and diagnoses share: their targets and inputs.


def bearing_files():
    return [f"{RESULTS}/bearings/coefficients.{kind}" for kind in ("nc", "png", "svg")]


COMPARE = f"{RESULTS}/compare"
ESTIMATORS = sorted(registry().plugins["estimator"])
METHODS = sorted(registry().plugins["spectrum"])
ROTORS = {file_name(name): name for name in (COMPARISON.rotors if COMPARISON else {})}
BIASED = [file for file, name in ROTORS.items() if COMPARISON.rotors[name].study]
COMPARE_CHUNKS = min(settings.chunks.compare, len(COMPARISON.faults)) if COMPARISON else 1


def compare_chunk(chunk):
    """Folder of the spectra and estimates of a chunk, which has some of the faults."""
    return COMPARE if COMPARE_CHUNKS == 1 else f"{COMPARE}/chunks/{chunk}"


def compared_of_chunks(stage, names):
    """Files of all chunks: spectra by some methods, or estimates by some estimators."""
    folders = [f"{compare_chunk(chunk)}/{stage}/{rotor}" for rotor in ROTORS for chunk in range(COMPARE_CHUNKS)]
    return [f"{folder}/{name}.nc" for folder in folders for name in names]


def compared_source(compared):
    """Configuration of the study or replay of a rotor, and the identification of a replay."""
    if compared.study:
        return [str(ROOT / settings.studies[compared.study])]
    return [str(ROOT / settings.replays[compared.replay]), f"{RESULTS}/{compared.replay}/identification.nc"]


def compared_sources():
    return [path for name in ROTORS.values() for path in compared_source(COMPARISON.rotors[name])]


def method_file(kind, wildcard):
    return lambda wildcards: registry().get(kind, getattr(wildcards, wildcard)).file


def compared_plugins():
    rigs = []
    for compared in COMPARISON.rotors.values():
        source = STUDIES[compared.study] if compared.study else REPLAYS[compared.replay]
        rigs.append(source.rigs[source.main_rig] if compared.study else source.rig)
    return plugin_files(rigs)


def comparison_files():
    if not COMPARISON:
        return []
    tables = [f"{COMPARE}/{name}.{kind}" for name in ("ranking", "advice") for kind in ("csv", "html")]
    return [f"{COMPARE}/comparison.nc", *pictures("compare", "png", "svg"), *tables]


BLIND_RESULTS = f"{RESULTS}/blind"
BLIND_PAGES = ["criteria", "cases"]


def blind_files():
    if not BLIND:
        return []
    pages = [f"{BLIND_RESULTS}/{name}.html" for name in BLIND_PAGES]
    return [f"{BLIND_RESULTS}/blind.nc", f"{BLIND_RESULTS}/criteria.csv", *pictures("blind", "png", "svg"), *pages]


DIAGNOSIS = f"{RESULTS}/diagnosis"
REPLAYED = [name for name, item in settings.diagnoses.items() if item.replay]
REPLAY_SHEETS = ["harmonics", "left_out", "parameters"]
EFFECTS = sorted(plugin.file for kind, plugin in registry() if kind in ("rotor", "crack", "bearing", "effect"))


def diagnosis_files():
    made = ["verdict.json", "verdict.nc", "extended_rig.yaml", "index.html"]
    found = [f"{DIAGNOSIS}/replays.html"] * bool(REPLAYED)
    for folder in [f"{DIAGNOSIS}/{name}" for name in settings.diagnoses]:
        found += [*(f"{folder}/{file}" for file in made), *pictures("diagnosis", "png", "svg", folder=folder)]
    return found


def diagnosed(wildcards):
    """Records and rig of a diagnosis."""
    item = settings.diagnoses[wildcards.diagnosis]
    return {"records": [str(ROOT / path) for path in item.records], "rig": str(ROOT / item.rig)}


wildcard_constraints:
    method="|".join(METHODS),
    estimator="|".join(ESTIMATORS),
    diagnosis="|".join(settings.diagnoses) or "none",


PRINTED = sorted(map(str, Path(ROOT / settings.published).glob("*.yaml"))) if settings.published else []


def all_files():
    """Every result but the index."""
    found = [*scoreboard_files(), *table_files(), *figure_files(), *bearing_files(), *data_files(), *rules.zoo.output]
    found += [f"{RESULTS}/published.{kind}" for kind in ("csv", "html") if PRINTED]
    return [*found, *comparison_files(), *blind_files(), *diagnosis_files(), *crack_files(), *crack_study_files()]

"""List the plugin library (zoo): kind, name, summary and source."""

from rotorstudy.errors import PluginError, check_known
from rotorstudy.model.registry import registry


def add(parser):
    parser.add_argument("--name", help="show one plugin in full: options, parameters, claims, confounders")
    parser.add_argument("--kind", help="only this kind: rotor, crack, depth, bearing, effect, spectrum, estimator")


def run(given):
    """List the plugins, or show one."""
    from rotorstudy.model.kinds import KINDS

    check_known("kind", filter(None, [given.kind]), KINDS, "--kind")
    zoo = registry()
    shown = [(kind, plugin) for kind, plugin in zoo if given.kind in (None, kind)]
    if given.name:
        return _show(given.name, shown)
    widths = [max(map(len, column)) for column in zip(*((kind, one.name) for kind, one in shown), strict=True)]
    for kind, plugin in shown:
        print(f"{kind:{widths[0]}}  {plugin.name:{widths[1]}}  {plugin.summary} [{plugin.source}]")
    if zoo.failures:
        raise PluginError("; ".join(zoo.failures))
    return {"plugins": [{"kind": kind, "name": one.name, "summary": one.summary} for kind, one in shown]}


def _show(name, known):
    """Print the facts of the plugins with a name; known : [(kind, plugin)]."""
    from rotorstudy.authoring.facts import facts

    check_known("plugin", [name], [plugin.name for _, plugin in known], "--name")
    found = [(kind, plugin) for kind, plugin in known if plugin.name == name]
    told = [{"kind": kind, "file": str(plugin.file), **facts(kind, plugin)} for kind, plugin in found]
    for kind, file, *rest in map(dict.items, told):
        print(f"{kind[1]} {name} ({file[1]})")
        for heading, text in rest:
            print(f"  {heading:16} {text}")
    return {"plugins": told}

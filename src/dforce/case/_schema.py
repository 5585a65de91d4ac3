"""The JSON schema of a case file."""

from __future__ import annotations

from typing import Any

from dforce import library
from dforce.case._case import Case
from dforce.core.parameters import Parameters
from dforce.experiments import EXPERIMENTS
from dforce.forces import REGISTRY
from dforce.library.cantilevers import cantilevers
from dforce.library.materials import materials


def case_schema() -> dict[str, Any]:
    """Return the JSON schema of a case file, for editors: keys, units, symbols, bounds, sentences."""
    schema = Case.model_json_schema()
    definitions = schema["$defs"]
    for field, tag, known in (("forces", "model", REGISTRY), ("experiment", "kind", EXPERIMENTS)):
        for name, model in known.items():
            definitions[f"{field}.{name}"] = _tagged(model, tag, name, definitions)
        choices = {"anyOf": [{"$ref": f"#/$defs/{field}.{name}"} for name in known]}
        description = schema["properties"][field]["description"]
        whole = {"type": "array", "items": choices} if field == "forces" else choices
        schema["properties"][field] = {"description": description, **whole}
    lever = definitions["Cantilever"]["properties"]
    higher = lever["higher_modes"]  # a number of modes, or a table of each
    number = {"type": "integer", "minimum": 0, "maximum": higher["maxItems"]}
    lever["higher_modes"] = {"description": higher.pop("description"), "anyOf": [number, higher]}
    known_by_name = {"Medium": sorted(library.media()), "Cantilever": list(cantilevers()), "Sample": list(materials())}
    for section, names in known_by_name.items():
        definitions[section] = {"anyOf": [{"enum": names}, definitions[section]]}
    for base in ("Force", "Experiment"):
        del definitions[base]
    for section in schema["properties"].values():
        section.pop("default", None)  # a section left out has the defaults of its keys
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema"
    return schema


def _tagged(model: type[Parameters], tag: str, name: str, definitions: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a force or an experiment as a table that names it; add the definitions that it refers to."""
    part = model.model_json_schema()
    definitions |= part.pop("$defs", {})
    hidden = {tag, *model.shared_fields()}
    kept = {key: value for key, value in part["properties"].items() if key not in hidden}
    part["properties"] = {tag: {"const": name}, **kept}
    part["required"] = [tag, *(key for key in part.get("required", []) if key not in hidden)]
    return part

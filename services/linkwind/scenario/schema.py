"""The JSON Schema of scenario files, from the models: ``python -m linkwind.scenario.schema [FILE]``."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from linkwind.scenario.model import Scenario


def schema() -> dict[str, Any]:
    """Return the JSON Schema of what a file may hold, ``[aero]`` and default names included."""
    generated = Scenario.model_json_schema(mode="validation")
    definitions = generated["$defs"]
    provider = definitions["Provider"]
    definitions["Aero"] = {
        **provider,
        "title": "Aero",
        "description": "Short for one entry of providers with the name aero.",
        "properties": {key: value for key, value in provider["properties"].items() if key != "name"},
        "required": ["model"],
    }
    generated["properties"]["aero"] = {
        "$ref": "#/$defs/Aero",
        "description": "The force provider; short for one entry of providers with the name aero",
    }
    generated["required"] = [key for key in generated["required"] if key not in ("name", "providers")]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "linkwind scenario",
        **generated,
    }


def text() -> str:
    """Return the schema as it lies in ``schemas/scenario.schema.json``."""
    return json.dumps(schema(), indent=2, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(text(), encoding="utf-8")
    else:
        sys.stdout.write(text())

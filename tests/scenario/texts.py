"""Scenario texts that the tests start from."""

from importlib.resources import files

BUILTIN = {
    entry.name.removesuffix(".toml"): entry.read_text(encoding="utf-8")
    for entry in files("linkwind.scenario").joinpath("library").iterdir()
    if entry.name.endswith(".toml")
}
TWO_LINK = BUILTIN["two_link"]

SMALL = """
[time]
end = 1.0
[[bodies]]
name = "a"
mass = 1.0
inertia = 0.1
"""


def edited(old: str, new: str, text: str = TWO_LINK) -> str:
    """Return the text with the first ``old`` replaced; there must be one."""
    assert old in text
    return text.replace(old, new, 1)

"""One FMU from a scenario: its mechanism, or the force model of a provider.

The same input gives the same file, byte for byte.
"""

from __future__ import annotations

import hashlib
import io
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from linkwind.errors import InputError
from linkwind.fmi import build, data, documentation, picture, terminals, toolchain
from linkwind.fmi.description import FmiVersion, model_description, to_bytes
from linkwind.fmi.part import Part, PartName, aero_part, dynamics_part
from linkwind.fmi.reference import reference_files
from linkwind.scenario import Scenario, load

Arrays = Literal["native", "scalar"]

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the first date that a zip file can state
_ICON_SIDE, _PICTURE_SIDE = 100, 360  # pixels


@dataclass(frozen=True)
class Exported:
    """An FMU that was written.

    Attributes:
        file: where it is.
        bytes: its size.
        fmi: version of FMI.
        platforms: that it has binaries for, as FMI 3 names them.
    """

    file: Path
    bytes: int
    fmi: FmiVersion
    platforms: tuple[str, ...]


def export(
    scenario: Scenario | str | Path,
    out: str | Path,
    *,
    fmi: FmiVersion = "2",
    platforms: Sequence[str] = ("host",),
    part: PartName = "dynamics",
    arrays: Arrays = "native",
) -> Exported:
    """Write an FMU for Co-Simulation and Model Exchange.

    Args:
        scenario: whose mechanism or force model it is, or what :func:`linkwind.load` takes.
        out: the file.
        fmi: version of FMI.
        platforms: ``host``, ``all``, or names of FMI 3 such as ``x86_64-windows``. The binary of ``host``
            alone is made by the system's compiler, and runs on this system or newer ones; any other, also
            of the platform that this is, by zig, and on Linux from glibc 2.17 on.
        part: ``dynamics``, or ``aero``: the first provider with model ``plate`` or ``field``.
        arrays: of FMI 3: ``native``, or ``scalar`` for importers that have no arrays.

    Raises:
        InputError: a wrong name, a compiler that is missing or fails, a file that cannot be written, a
            scenario without such a part.
    """
    names = toolchain.choose(platforms)
    loaded = scenario if isinstance(scenario, Scenario) else load(scenario)
    fmu = archive(_part(loaded, fmi, part, arrays), fmi, platforms)
    file = Path(out)
    write(file, fmu)
    return Exported(file, len(fmu), fmi, tuple(names))


def archive(part: Part, fmi: FmiVersion, platforms: Sequence[str]) -> bytes:
    """Return an FMU; see `export`."""
    content = _content(part, fmi)
    sources = {
        name.removeprefix("sources/"): text for name, text in content.items() if name.startswith("sources/")
    }
    names, portable = toolchain.choose(platforms), tuple(platforms) != ("host",)
    content |= build.binaries(sources, names, part.identifier, fmi, portable=portable)
    return zipped(content, "modelDescription.xml")


def _part(scenario: Scenario, fmi: FmiVersion, part: PartName, arrays: Arrays) -> Part:
    make = dynamics_part if part == "dynamics" else aero_part
    return make(scenario, native_arrays=fmi == "3" and arrays == "native")


def content_of(
    scenario: Scenario, *, fmi: FmiVersion = "2", part: PartName = "dynamics", arrays: Arrays = "native"
) -> dict[str, bytes]:
    """Return all files of an FMU but the binaries, by path.

    Raises:
        InputError: the scenario does not have the part.
    """
    return _content(_part(scenario, fmi, part, arrays), fmi)


def _content(chosen: Part, fmi: FmiVersion) -> dict[str, bytes]:
    sources = build.c_sources(chosen, fmi)
    own = sorted(name for name in (*sources, build.DATA_FILE) if name.endswith(".c"))
    token = _token(chosen, fmi, sources, own)
    sources[build.DATA_FILE] = data.source(chosen, token).encode()
    content = {f"sources/{name}": text for name, text in sources.items()}
    content["modelDescription.xml"] = model_description(chosen, fmi, token, own)
    if fmi == "3":
        content["sources/buildDescription.xml"] = _build_description(chosen, own)
    references = reference_files(chosen)
    return content | references | _pages(chosen, fmi, has_references=bool(references))


def _token(part: Part, fmi: FmiVersion, sources: Mapping[str, bytes], own: Sequence[str]) -> str:
    """Return a GUID made of a hash of everything that the model is."""
    digest = hashlib.sha256(model_description(part, fmi, "", own))
    digest.update(data.source(part, "").encode())
    for name in sorted(sources):
        digest.update(name.encode() + b"\0" + sources[name])
    text = digest.hexdigest()[:32]
    return "{" + "-".join((text[:8], text[8:12], text[12:16], text[16:20], text[20:])) + "}"


def _pages(part: Part, fmi: FmiVersion, *, has_references: bool) -> dict[str, bytes]:
    """Return documentation, icons and terminals."""
    drawing = picture.strokes(part.scenario, part.mechanism)
    icon = picture.png(drawing, _ICON_SIDE)
    found = {
        "documentation/index.html": documentation.index(
            part, picture.svg(drawing, _PICTURE_SIDE), has_references=has_references
        )
    }
    if has_references:
        found["documentation/fmi-ls-ref.html"] = documentation.references(part)
    if fmi == "2":
        return found | {"model.png": icon}
    folder, ports = "terminalsAndIcons", terminals.ICON_DRAWING
    return found | {
        f"{folder}/terminalsAndIcons.xml": terminals.terminals(part),
        f"{folder}/icon.png": icon,
        f"{folder}/icon.svg": picture.svg(drawing, _ICON_SIDE).encode(),
        f"{folder}/{terminals.ICON}.png": picture.png(ports, _ICON_SIDE // 4),
        f"{folder}/{terminals.ICON}.svg": picture.svg(ports, _ICON_SIDE // 4).encode(),
    }


def _build_description(part: Part, own: Sequence[str]) -> bytes:
    """Return ``buildDescription.xml``: one set of C99 files, all in one folder."""
    root = ET.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ET.SubElement(root, "BuildConfiguration", modelIdentifier=part.identifier)
    files = ET.SubElement(
        configuration, "SourceFileSet", language="C99", compilerOptions=" ".join(build.flags())
    )
    for name in own:
        ET.SubElement(files, "SourceFile", name=name)
    ET.SubElement(
        files, "PreprocessorDefinition", name="LW_API", value="", description="Exports the FMI only"
    )
    ET.SubElement(
        configuration, "Library", name="m", external="true", description="Mathematics, where it is apart"
    )
    return to_bytes(root)


def zipped(content: Mapping[str, bytes], description: str) -> bytes:
    """Return the archive; the description first, so that it is found at once, and fixed dates."""
    memory = io.BytesIO()
    names = sorted(content, key=lambda name: (name != description, name))
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as target:
        for name in names:
            entry = zipfile.ZipInfo(name, _EPOCH)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3  # Unix, wherever this runs
            entry.external_attr = (0o755 if name.startswith("binaries/") else 0o644) << 16
            target.writestr(entry, content[name], compresslevel=9)
    return memory.getvalue()


def write(out: Path, content: bytes) -> None:
    """Write the file, whole or not at all.

    Raises:
        InputError: it cannot be written.
    """
    partial = out.with_name(out.name + ".partial")
    try:
        partial.write_bytes(content)
        partial.replace(out)
    except OSError as error:
        raise InputError(
            f"{out}: cannot be written: {error.strerror}. Choose another place with -o."
        ) from error

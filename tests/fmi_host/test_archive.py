"""The file of an FMU is somebody else's: every trick of it is an error, and nothing is written elsewhere."""

from __future__ import annotations

import re
import stat
import struct
import zipfile
from dataclasses import replace

import pytest

from linkwind.errors import InputError
from linkwind.fmi.host import archive, description
from linkwind.fmi.host.instances import Instances
from linkwind.fmi.host.mapping import resolve
from linkwind.scenario.providers import FmuModel
from tests.fmi_host.foreign import Foreign, Variable, fmu

GOOD = Foreign((Variable("Fx", "output"),), code="#define OUTPUTS(m)")


@pytest.fixture
def good(tmp_path):
    return fmu(tmp_path, GOOD, "good")


def remade(tmp_path, good, change):
    """A copy of a good FMU with its entries changed: ``change`` takes and returns {name: data}."""
    with zipfile.ZipFile(good) as source:
        entries = change({name: source.read(name) for name in source.namelist()})
    path = tmp_path / "bad.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for name, data in entries.items():
            target.writestr(name, data)
    return path


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("../outside.txt", "stay in the folder"),
        ("resources/../../outside.txt", "stay in the folder"),
        ("/tmp/outside.txt", "relative paths"),
        ("C:/outside.txt", "relative paths"),
        ("resources\\outside.txt", "forward slashes"),
        ("..\\outside.txt", "forward slashes"),
    ],
)
def test_entries_that_leave_the_folder(tmp_path, good, name, expected):
    path = remade(tmp_path, good, lambda entries: entries | {name: b"x"})
    with pytest.raises(InputError, match=f"expected entries .*{expected}.*{re.escape(repr(name))}"):
        description.read(path)
    assert not list(tmp_path.parent.rglob("outside.txt"))


@pytest.mark.parametrize(("kind", "word"), [(stat.S_IFLNK, "a link"), (stat.S_IFIFO, "a special file")])
def test_links_and_special_files(tmp_path, good, kind, word):
    entry = zipfile.ZipInfo("resources/passwd")
    entry.external_attr = (kind | 0o777) << 16
    path = remade(tmp_path, good, lambda entries: entries)
    with zipfile.ZipFile(path, "a") as target:
        target.writestr(entry, "/etc/passwd")
    with pytest.raises(
        InputError, match=f"expected entries that are files; got entry 'resources/passwd', {word}"
    ):
        description.read(path)


def test_bombs(tmp_path, good):
    path = remade(tmp_path, good, lambda entries: entries | {"resources/bomb": bytes(64 << 20)})
    with pytest.raises(
        InputError, match=r"packed at most 200 to 1; got entry 'resources/bomb', \d+ to 1: a zip bomb"
    ):
        description.read(path)


def test_a_size_that_lies(tmp_path, good):
    """The directory says 10 bytes, the data are a megabyte: not one byte more than said is kept."""
    path = remade(tmp_path, good, lambda entries: entries | {"resources/large": bytes(1 << 20)})
    data = path.read_bytes()
    true, lie = struct.pack("<I", 1 << 20), struct.pack("<I", 10)
    assert data.count(true) == 2
    path.write_bytes(data.replace(true, lie))
    opened = archive.Archive(path)
    with pytest.raises(InputError, match='an intact entry "resources/large"'):
        opened.unpack(2, tmp_path / "out")
    opened.close()
    assert (tmp_path / "out/resources/large").stat().st_size <= 10


def test_too_many_entries_and_too_much(tmp_path, good, monkeypatch):
    monkeypatch.setattr(archive, "MAX_ENTRIES", 1)
    with pytest.raises(InputError, match="at most 1 entries; got 2"):
        description.read(good)
    monkeypatch.undo()
    monkeypatch.setattr(archive, "MAX_SIZE", 10)
    with pytest.raises(InputError, match="GiB unpacked"):
        description.read(good)


def test_the_same_entry_twice(tmp_path, good):
    with zipfile.ZipFile(good, "a") as target, pytest.warns(UserWarning, match="Duplicate"):
        target.writestr("modelDescription.xml", "<other/>")
    with pytest.raises(InputError, match=r'got two different entries "modelDescription\.xml"'):
        description.read(good)


ENTITIES = """<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">
<!ENTITY file SYSTEM "file:///etc/passwd">]><fmiModelDescription fmiVersion="2.0" modelName="&b;&file;"/>"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ENTITIES, "without a document type; got one, which can define entities"),
        ("<fmiModelDescription", "to be well-formed XML"),
        ("", "to be well-formed XML"),
        ("\0\1\2", "to be well-formed XML"),
        ("<html/>", "expected a description of FMI 2.0 or 3.0"),
        ('<fmiModelDescription fmiVersion="2.0"/>', "expected a description of FMI 2.0 or 3.0"),
        ('<fmiModelDescription fmiVersion="7.0"/>', "expected a description of FMI 2.0 or 3.0; got.*7.0"),
    ],
)
def test_a_damaged_description(tmp_path, good, text, expected):
    path = remade(tmp_path, good, lambda entries: entries | {"modelDescription.xml": text.encode()})
    with pytest.raises(InputError, match=expected):
        description.read(path)


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_entities_in_another_encoding(tmp_path, good, encoding):
    text = ENTITIES.replace('version="1.0"', f'version="1.0" encoding="{encoding}"', 1).encode(encoding)
    path = remade(tmp_path, good, lambda entries: entries | {"modelDescription.xml": text})
    with pytest.raises(InputError, match="without a document type"):
        description.read(path)


def test_every_cut_is_an_error(tmp_path, good):
    data = good.read_bytes()
    path = tmp_path / "cut.fmu"
    for size in range(0, len(data), len(data) // 23):
        path.write_bytes(data[:size])
        with pytest.raises(InputError, match="expected an FMU"):
            description.read(path)


def test_damaged_bytes_never_raise_anything_else(tmp_path, good):
    data = bytearray(good.read_bytes())
    path = tmp_path / "damaged.fmu"
    for place in range(0, len(data), max(1, len(data) // 60)):
        damaged = bytearray(data)
        damaged[place] ^= 0xFF
        path.write_bytes(damaged)
        try:
            read = description.read(path)
            opened = archive.Archive(path)
            try:
                opened.unpack(2, tmp_path / f"out{place}")
            finally:
                opened.close()
        except InputError:
            continue
        assert read.version == 2


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_description_without_any_one_attribute_or_with_nonsense_in_it(tmp_path, fmi):
    """It is either still understood, or an InputError."""
    variables = (Variable("vx", "input", unit="km/h"), Variable("Fx", "output"), Variable("k", "parameter"))
    if fmi == 3:
        variables += (Variable("n", "structuralParameter"), Variable("T", "output", ("n",)))
    foreign = Foreign(variables, fmi, ("CoSimulation", "ModelExchange"), states=1, code="#define OUTPUTS(m)")
    good = fmu(tmp_path, foreign, "good")
    with zipfile.ZipFile(good) as source:
        text = source.read("modelDescription.xml").decode()
    understood = 0
    for found in re.finditer(r' \w+="[^"]*"', text):
        name = found[0].split("=")[0]
        for other in ("", f'{name}="-7"', f'{name}="nonsense"', f'{name}=""'):
            changed = (text[: found.start()] + other + text[found.end() :]).encode()
            path = remade(tmp_path, good, lambda entries, new=changed: {"modelDescription.xml": new})
            try:
                read = description.read(path)
                resolve(read, FmuModel(), ("wing",))
            except InputError:
                continue
            understood += 1
    assert understood > 10


def test_no_file_and_no_fmu(tmp_path):
    with pytest.raises(InputError, match="No such file"):
        description.read(tmp_path / "none.fmu")
    path = tmp_path / "empty.fmu"
    with zipfile.ZipFile(path, "w") as target:
        target.writestr("readme.txt", "hello")
    with pytest.raises(InputError, match=r"expected modelDescription\.xml in the archive; got none"):
        description.read(path)


def start(path):
    read = description.read(path)
    settings = FmuModel(isolation="inprocess")
    return Instances(read, resolve(read, settings, ("wing",)), settings, 1_000_000, 1.0)


def moved(old, new):
    return lambda entries: {name.replace(old, new): data for name, data in entries.items()}


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (moved("linux64/foreign.so", "win32/foreign.dll"), r"got binaries for win32\. Ask its author"),
        (moved("binaries/linux64", "binaries/darwin64"), r"got binaries for darwin64\. Ask its author"),
        (
            moved("binaries/linux64/foreign.so", "sources/foreign.c"),
            r"no platform\. It carries its C sources.*fmpy compile",
        ),
        (
            lambda entries: entries | {"binaries/linux64/foreign.so": b"MZ" * 40},
            "a shared library for this machine",
        ),
    ],
)
def test_no_binary_for_this_platform(tmp_path, good, change, expected):
    with pytest.raises(InputError, match=expected):
        start(remade(tmp_path, good, change))


@pytest.mark.parametrize("identifier", ["../../etc/x", "a/b", ".hidden", "a b"])
def test_an_identifier_that_is_a_path(tmp_path, good, identifier):
    def change(entries):
        old, new = b'modelIdentifier="foreign"', f'modelIdentifier="{identifier}"'.encode()
        return entries | {"modelDescription.xml": entries["modelDescription.xml"].replace(old, new)}

    with pytest.raises(InputError, match="modelIdentifier"):
        start(remade(tmp_path, good, change))


def test_scheduled_execution_alone_is_refused(tmp_path):
    foreign = replace(GOOD, fmi=3, interfaces=("ScheduledExecution",), attributes="")
    with pytest.raises(InputError, match="got Scheduled Execution alone"):
        description.read(fmu(tmp_path, foreign))


def test_only_what_a_run_needs_is_unpacked(tmp_path):
    extra = {
        "documentation/index.html": b"x",
        "resources/table.txt": b"1 2",
        "binaries/win64/foreign.dll": b"x",
    }
    path = fmu(tmp_path, replace(GOOD, extra=extra))
    opened = archive.Archive(path)
    opened.unpack(2, tmp_path / "out")
    opened.close()
    found = {
        str(file.relative_to(tmp_path / "out")) for file in (tmp_path / "out").rglob("*") if file.is_file()
    }
    assert found == {"modelDescription.xml", "binaries/linux64/foreign.so", "resources/table.txt"}
    assert (tmp_path / "out/resources/table.txt").read_bytes() == b"1 2"

"""Compile the schemas to ``linkwind/v1/linkwind.binpb``: ``python schemas/compile.py`` (extra ``dev``)."""

from __future__ import annotations

import sys
from pathlib import Path

from grpc_tools import protoc

HERE = Path(__file__).resolve().parent
TARGET = HERE / "linkwind" / "v1" / "linkwind.binpb"


def compile_to(target: Path) -> None:
    """Write the descriptor set of every schema to ``target``."""
    sources = sorted(str(p.relative_to(HERE)) for p in HERE.glob("linkwind/v1/*.proto"))
    arguments = ["protoc", f"-I{HERE}", "--include_imports", f"--descriptor_set_out={target}", *sources]
    if protoc.main(arguments):
        sys.exit("compiling the schemas failed")


if __name__ == "__main__":
    compile_to(TARGET)

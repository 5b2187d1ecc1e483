"""The compiled C library: found beside the package, loaded once, its functions declared."""

from __future__ import annotations

import ctypes
import functools
import hashlib
from collections.abc import Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

from linkwind.errors import LinkwindError


@functools.cache
def library() -> ctypes.CDLL:
    """Return the loaded library.

    Raises:
        LinkwindError: the file is missing or cannot be loaded here.
    """
    path = _path()
    try:
        return ctypes.CDLL(path)
    except OSError as error:
        raise LinkwindError(
            f"{path}: expected the library compiled at install; got {error}. "
            "Install linkwind again (pip install .), or run python fmu/hatch_build.py in a checkout."
        ) from error


def library_sha256() -> str:
    """Return the hash of the library's file: another compiler or other flags may give other bits."""
    return hashlib.sha256(Path(_path()).read_bytes()).hexdigest()


def _path() -> str:
    return str(files("linkwind").joinpath("_data", "liblinkwind.so"))


def declare(name: str, arguments: Sequence[Any], result: Any = ctypes.c_int) -> Callable[..., Any]:
    """Return the function ``name`` of the library with its C types declared.

    Arrays are passed as addresses (``ctypes.c_void_p``): converting an int costs a tenth of a microsecond,
    an array object several times that.

    Raises:
        LinkwindError: the library is missing, or older than this package.
    """
    try:
        function = getattr(library(), name)
    except AttributeError as error:
        raise LinkwindError(
            f"liblinkwind.so: expected the function {name}; got a library without it, older than this "
            "package. Install linkwind again (pip install .), or run python fmu/hatch_build.py."
        ) from error
    function.argtypes = list(arguments)
    function.restype = result
    return function  # type: ignore[no-any-return]

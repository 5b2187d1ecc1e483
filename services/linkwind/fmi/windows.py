"""Windows binaries straight on the Universal C Runtime, which is part of Windows.

The default of zig is to build a C runtime of its own for Windows first, which takes minutes and adds 80 kB
to each DLL. All that the FMU needs is there already.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

from linkwind.fmi import toolchain

_MATH = (
    "acos asin atan atan2 cbrt ceil copysign cos cosh exp fabs floor fmax fmin fmod frexp hypot ldexp log "
    "modf nextafter pow round sin sinh sqrt tan tanh trunc"
)
_REST = (
    "__stdio_common_vsprintf calloc free malloc memchr memcmp memcpy memmove memset realloc strchr strcmp "
    "strcspn strlen strncmp strspn"
)
_IMPORTS = f"LIBRARY ucrtbase.dll\nEXPORTS\n{chr(10).join((_MATH + ' ' + _REST).split())}\n"
# The DLL's entry point, and what the runtime has under another name (2: as the C standard says).
_ENTRY = """\
#include <stdarg.h>
#include <stddef.h>
int __stdio_common_vsprintf(unsigned long long, char *, size_t, const char *, void *, va_list);
int vsnprintf(char *out, size_t size, const char *format, va_list items) {
    return __stdio_common_vsprintf(2, out, size, format, NULL, items);
}
int snprintf(char *out, size_t size, const char *format, ...) {
    va_list items;
    va_start(items, format);
    int length = vsnprintf(out, size, format, items);
    va_end(items);
    return length;
}
int DllMainCRTStartup(void *module, unsigned long reason, void *reserved) {
    (void)module, (void)reason, (void)reserved;
    return 1;
}
"""


def prepare(folder: Path) -> list[str]:
    """Write an import library and the DLL's entry point to ``folder``; return the compiler's arguments.

    sin and cos stay apart, because the runtime has no sincos; and the headers take the runtime's printf.
    """
    (folder / "ucrtbase.def").write_text(_IMPORTS, encoding="ascii")
    (folder / "entry.c").write_text(_ENTRY, encoding="ascii")
    make = [sys.executable, "-m", "ziglang", "dlltool", "-m", "i386:x86-64"]
    toolchain.run([*make, "-d", "ucrtbase.def", "-l", "libucrt.a"], folder, "the import library for Windows")
    spec = importlib.util.find_spec("ziglang")
    assert spec is not None
    assert spec.origin is not None
    headers = Path(spec.origin).parent / "lib" / "libc" / "include" / "any-windows-any"
    return [
        "-nostdlib", "-isystem", str(headers), "-fno-builtin-sin", "-fno-builtin-cos",
        "-D__USE_MINGW_ANSI_STDIO=0", "entry.c", "libucrt.a",
    ]  # fmt: skip

"""Single keys from a terminal, while the command does its work."""

from __future__ import annotations

import contextlib
import os
import select
import sys
import threading
from collections.abc import Callable, Iterator, Mapping


@contextlib.contextmanager
def keys(actions: Mapping[str, Callable[[], None]]) -> Iterator[None]:
    """Call an action at every press of its key within the block; without a terminal there are no keys.

    Args:
        actions: by what the terminal sends for the key. They are called from another thread. Ctrl-C stays
            what it is.
    """
    if not sys.stdin.isatty():
        yield
        return
    import termios
    import tty

    terminal = sys.stdin.fileno()
    before = termios.tcgetattr(terminal)
    wake, close = os.pipe()
    listener = threading.Thread(target=_listen, args=(terminal, wake, actions), daemon=True)
    tty.setcbreak(terminal)
    listener.start()
    try:
        yield
    finally:
        os.close(close)
        listener.join()
        os.close(wake)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)


def _listen(terminal: int, wake: int, actions: Mapping[str, Callable[[], None]]) -> None:
    """Read keys until the other end of ``wake`` is closed, or the terminal is gone."""
    while True:
        ready, _, _ = select.select([terminal, wake], [], [])
        if wake in ready:
            return
        try:
            pressed = os.read(terminal, 100).decode(errors="replace")
        except OSError:  # the terminal was closed
            return
        while pressed:
            key = next((key for key in actions if pressed.startswith(key)), pressed[0])
            pressed = pressed[len(key) :]
            actions.get(key, lambda: None)()

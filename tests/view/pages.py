"""A served page in a real browser, and logs to look at."""

import contextlib
import threading
import time

from linkwind.view.recording import open_recording
from linkwind.view.server import listen, server

T = "Number(document.getElementById('time').value.replace(' s', ''))"
PLAY = "document.getElementById('play').getAttribute('aria-label')"
BADGE = "document.getElementById('badge').textContent"
READY = "document.getElementById('waiting').hidden && !!document.querySelector('.plot .cursor')"
SCENE = "document.getElementById('scene').toDataURL()"


@contextlib.contextmanager
def served(path, console=None):
    """Serve a log from a thread; the address of its page."""
    place, serving = listen("127.0.0.1", 0), server(open_recording(path), console)
    thread = threading.Thread(target=serving.run, args=([place],))
    thread.start()
    try:
        while not serving.started:
            time.sleep(0.005)
        yield f"http://127.0.0.1:{place.getsockname()[1]}/"
    finally:
        serving.should_exit = True
        thread.join()
        place.close()


def show(browser, url, *, ready=READY):
    """Open a page and wait until it shows something."""
    browser.send("Page.navigate", url="about:blank")  # the page before it may miss its server
    browser.until("location.href === 'about:blank'")
    browser.events.clear()
    browser.send("Page.navigate", url=url)
    browser.until(f"location.href === '{url}' && document.readyState === 'complete' && {ready}")


def scrub(browser, t):
    browser.evaluate(f"scrub.value = {t}; scrub.dispatchEvent(new Event('input'))")


def troubles(browser):
    """Return errors of the page, and what it asked of other hosts than this one."""
    found = []
    for event in browser.events:
        params = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            found.append(params)
        if event.get("method") == "Log.entryAdded" and params["entry"]["level"] == "error":
            found.append(params)
        if event.get("method") == "Network.requestWillBeSent":
            url = params["request"]["url"]
            found += [] if url.startswith(("http://127.0.0.1:", "data:", "blob:")) else [url]
    return found

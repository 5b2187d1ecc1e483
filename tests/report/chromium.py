"""A headless Chromium, driven over its DevTools protocol through a pair of pipes."""

import json
import os
import shutil
import subprocess
import time

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
DEADLINE = 30.0  # s for anything that the browser is waited for


class Chromium:
    """One page in one browser.

    Commands and answers are JSON, ended by a zero byte, on the file descriptors 3 and 4 of the browser.
    """

    def __init__(self, profile, *flags):
        read, self._write = os.pipe()
        self._read, write = os.pipe()
        command = [PROGRAM, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        command += ["--remote-debugging-pipe", f"--user-data-dir={profile}", *flags, "about:blank"]
        plumbing = f'exec "$@" 3<&{read} 4>&{write}'
        self._process = subprocess.Popen(
            ["bash", "-c", plumbing, "bash", *command],
            pass_fds=(read, write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(read)
        os.close(write)
        self._buffer, self._count, self._session = b"", 0, None
        self.events = []
        pages = self.send("Target.getTargets")["targetInfos"]
        target = next(page["targetId"] for page in pages if page["type"] == "page")
        self._session = self.send("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.send(f"{domain}.enable")

    def send(self, method, **params):
        """Send a command and return its answer."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def _next(self):
        while b"\0" not in self._buffer:
            part = os.read(self._read, 1 << 16)
            assert part, "Chromium has ended"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def evaluate(self, expression):
        """Return the value of a JavaScript expression."""
        answer = self.send("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def until(self, expression):
        """Return the value of an expression as soon as it is true."""
        end = time.monotonic() + DEADLINE
        while time.monotonic() < end:
            # The browser answers after it has drawn a frame: waiting without sleeping.
            value = self.evaluate(f"new Promise(done => requestAnimationFrame(() => done({expression})))")
            if value:
                return value
        raise AssertionError(f"{expression} did not come true")

    def open(self, path):
        self.events.clear()
        self.send("Page.navigate", url=path.as_uri())
        self.until("document.readyState === 'complete' && !!document.getElementById('time')?.value")

    def mouse(self, kind, x, y, buttons=0, count=1):
        button = "left" if kind != "mouseMoved" else "none"
        event = {"type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": count}
        self.send("Input.dispatchMouseEvent", **event)

    def click(self, x, y, times=1):
        self.mouse("mouseMoved", x, y)
        for count in range(1, times + 1):
            self.mouse("mousePressed", x, y, 1, count)
            self.mouse("mouseReleased", x, y, 0, count)

    def key(self, key, text=""):
        self.send("Input.dispatchKeyEvent", type="keyDown", key=key, text=text)
        self.send("Input.dispatchKeyEvent", type="keyUp", key=key)

    def close(self):
        self.send("Browser.close")
        self._process.wait(DEADLINE)
        os.close(self._read)
        os.close(self._write)

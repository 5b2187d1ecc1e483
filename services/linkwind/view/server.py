"""The page and its data, over HTTP on this machine.

Everything is asked for by the page (`recording`, `film`), so that a slow browser delays nobody but itself;
one stream a page tells how far the log has come, and that the page is still there.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Callable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.middleware import Middleware
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from linkwind.errors import InputError, LinkwindError
from linkwind.view.console import Console
from linkwind.view.film import Film
from linkwind.view.recording import Recording
from linkwind.view.volumefilm import VolumeFilm
from linkwind.view.wakefilm import WakeFilm

LOOK, SELDOM = 0.1, 0.5  # s between two looks at a log that grows, and at one that does not
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
POLICY = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:"


class Pages:
    """What the browser may ask for.

    Args:
        recording: the log.
        console: steers the run that writes it; None for a log that nobody here writes.

    Attributes:
        leaving: tells whether the server is about to end, which ends the streams.
    """

    def __init__(self, recording: Recording, console: Console | None) -> None:
        self._recording = recording
        self._console = console
        self._films: dict[str, Film] = {}
        self._wakes: dict[str, WakeFilm] = {}
        self._volumes: dict[str, VolumeFilm] = {}
        self.leaving: Callable[[], bool] = lambda: False

    def application(self, hosts: Sequence[str]) -> Starlette:
        """Return the application, which answers requests for these hosts only: no other site's pages."""
        assets = Path(str(files("linkwind.view").joinpath("assets")))
        report = Path(str(files("linkwind.report").joinpath("assets")))
        return Starlette(
            routes=[
                Route(
                    "/",
                    lambda request: FileResponse(
                        assets / "page.html", headers={"Content-Security-Policy": POLICY}
                    ),
                ),
                Route("/plotly.min.js", lambda request: FileResponse(_plotly())),
                Route("/facts", self._facts),
                Route("/window", self._window),
                Route("/reel/{provider}", self._reel),
                Route("/picture/{provider}/{quantity}/{index:int}", self._picture),
                Route("/wake/{provider}", self._wake_reel),
                Route("/wake/{provider}/{index:int}", self._wake_frame),
                Route("/vortices/{provider}", self._vortices_reel),
                Route("/vortices/{provider}/{index:int}", self._vortices_frame),
                Route("/events", self._events),
                Route("/steer", self._steer, methods=["POST"]),
                Mount("/report", StaticFiles(directory=report)),
                Mount("/assets", StaticFiles(directory=assets)),
            ],
            middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=list(hosts))],
            exception_handlers={LinkwindError: _told},
        )

    def _facts(self, request: Request) -> Response:
        steered = {"steered": self._console is not None}
        return JSONResponse(self._recording.facts | self._recording.progress() | steered)

    def _window(self, request: Request) -> Response:
        low, high = (_number(request.query_params.get(name)) for name in ("from", "to"))
        return JSONResponse(self._recording.window(low, high))

    def _film(self, request: Request) -> Film:
        provider = request.path_params["provider"]
        if provider not in self._recording.log.flows:
            raise HTTPException(404, f'no frames of "{provider}" in the log')
        return self._films.setdefault(provider, Film(self._recording, provider))

    def _reel(self, request: Request) -> Response:
        return JSONResponse(self._film(request).reel())

    def _picture(self, request: Request) -> Response:
        found = self._film(request).picture(request.path_params["index"], request.path_params["quantity"])
        if found is None:
            raise HTTPException(404, "no such frame")
        data, extent = found
        return Response(data, media_type="image/webp", headers={"X-Extent": json.dumps(extent)})

    def _wake(self, request: Request) -> WakeFilm:
        provider = request.path_params["provider"]
        if provider not in self._recording.log.wakes:
            raise HTTPException(404, f'no wakes of "{provider}" in the log')
        return self._wakes.setdefault(provider, WakeFilm(self._recording, provider))

    def _wake_reel(self, request: Request) -> Response:
        return JSONResponse(self._wake(request).reel())

    def _wake_frame(self, request: Request) -> Response:
        found = self._wake(request).frame(request.path_params["index"])
        if found is None:
            raise HTTPException(404, "no such frame")
        return JSONResponse(found)

    def _vortices(self, request: Request) -> VolumeFilm:
        provider = request.path_params["provider"]
        if provider not in self._recording.log.volumes:
            raise HTTPException(404, f'no fluid in a box of "{provider}" in the log')
        return self._volumes.setdefault(provider, VolumeFilm(self._recording, provider))

    def _vortices_reel(self, request: Request) -> Response:
        return JSONResponse(self._vortices(request).reel())

    def _vortices_frame(self, request: Request) -> Response:
        found = self._vortices(request).frame(request.path_params["index"])
        if found is None:
            raise HTTPException(404, "no such frame")
        return JSONResponse(found)

    async def _steer(self, request: Request) -> Response:
        """Pass on what a viewer wants; a page of another site cannot send this kind of content unasked."""
        if self._console is None:
            raise HTTPException(409, "no run to steer: this is a log")
        if request.headers.get("content-type") != "application/json":
            raise HTTPException(415, "expected application/json")
        try:
            await run_in_threadpool(self._console.steer, await request.json())
        except ValueError as error:
            raise HTTPException(400, str(error)) from error
        return Response(status_code=204)

    async def _events(self, request: Request) -> Response:
        return StreamingResponse(self._progress(request), media_type="text/event-stream")

    async def _progress(self, request: Request) -> AsyncIterator[str]:
        """Tell of every change; poses since the last one with it, so that the picture moves at once."""
        if self._console is not None:
            self._console.come()
        try:
            before: dict[str, Any] = {}
            while not self.leaving():
                now = await run_in_threadpool(self._now)
                if now != before:
                    after, last = before.get("last"), now["last"]
                    poses = None
                    if after is not None and last is not None and last > after:
                        poses = await run_in_threadpool(self._recording.poses, after, last)
                    yield f"data: {json.dumps(now | {'poses': poses})}\n\n"
                    before = now
                await asyncio.sleep(SELDOM if now["ended"] else LOOK)
        finally:
            if self._console is not None:
                self._console.leave()

    def _now(self) -> dict[str, Any]:
        console = self._console
        steering = {} if console is None else {"paused": console.paused, "rate": console.rate}
        return self._recording.progress() | steering


def _plotly() -> Path:
    import plotly

    return Path(plotly.__file__).parent / "package_data" / "plotly.min.js"


def _number(text: str | None) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e9:
        raise HTTPException(400, "expected times in seconds, such as ?from=0&to=1.2")
    return value


def _told(request: Request, error: Exception) -> Response:
    return JSONResponse({"error": str(error)}, status_code=500)


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens; port 0 is any that is free.

    Raises:
        InputError: the address is not this machine's, or the port is taken.
    """
    try:
        return socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
    except OSError as error:
        raise InputError(
            f"cannot listen on {host}, port {port}: {error.strerror}. Choose another --port, or none for a "
            "free one"
        ) from error


def server(recording: Recording, console: Console | None, hosts: Sequence[str] = LOOPBACK) -> uvicorn.Server:
    """Return a server, whose ``run(sockets=[…])`` answers browsers until it is interrupted.

    Args:
        recording: the log.
        console: steers the run that writes it; None for a log alone.
        hosts: names under which the browser may ask; ``["*"]`` for any.
    """
    pages = Pages(recording, console)
    config = uvicorn.Config(
        pages.application(hosts), log_level="warning", lifespan="off", ws="none", timeout_graceful_shutdown=1
    )
    made = uvicorn.Server(config)
    pages.leaving = lambda: made.should_exit
    return made

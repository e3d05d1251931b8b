"""The watch as a page in a browser on this machine: the picture with what is seen in it, and the evidence.

It listens on the loopback address alone, and answers only who asks for it by that name: a page of somebody else cannot
make a browser read it by giving its own name this address. No key and no secret is on it.
"""

import asyncio
import threading
from concurrent.futures import Future
from dataclasses import asdict
from importlib.resources import files
from types import TracebackType
from typing import Self

import cv2
from aiohttp import web
from aiohttp.typedefs import Handler

from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.overlay import draw
from mtm_audit.drawing.palette import colour_of
from mtm_audit.live.state import WatchState
from mtm_onboard.protocol.errors import MtmError

HOST = "127.0.0.1"
_STATIC = {
    "/": ("page.html", "text/html"),
    "/page.js": ("page.js", "text/javascript"),
    "/page.css": ("page.css", "text/css"),
}
# Nothing but what this server sends, and nothing of that in other pages.
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
_JPEG_QUALITY = 80
_LARGEST_PX = 1280
_START_S, _LINGER_S, _AFTER_S = 10.0, 3.0, 0.2


class Page:
    """Serves a state at `port` (0: any that is free) while the context lasts; `url` is where.

    Raises MtmError when nothing can listen there.
    """

    def __init__(self, state: WatchState, port: int = 0) -> None:
        self._state, self._wanted = state, port
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, name="page", daemon=True)
        self._runner: web.AppRunner | None = None
        self._asked = False
        self._end_asked = threading.Event()
        self.port = 0

    def __enter__(self) -> Self:
        self._thread.start()
        try:
            self._call(self._begin()).result(_START_S)
        except OSError as error:
            self._stop_loop()
            raise MtmError(
                f"the page cannot be served at port {self._wanted} ({error.strerror}); choose another with --page"
            ) from error
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._runner is not None:
            self._call(self._runner.cleanup()).result(_START_S)
        self._stop_loop()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{HOST}:{self.port}/"

    def let_it_be_seen(self) -> None:
        """Where somebody looks, wait for a moment until the end of the watch was asked for."""
        if self._asked:
            self._end_asked.wait(_LINGER_S)

    def _call(self, coroutine: object) -> "Future[None]":
        return asyncio.run_coroutine_threadsafe(coroutine, self._loop)  # type: ignore[arg-type]

    def _stop_loop(self) -> None:
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _begin(self) -> None:
        app = web.Application(middlewares=[self._guarded])
        for path in _STATIC:
            app.router.add_get(path, _static)
        app.router.add_get("/state", self._current)
        app.router.add_get("/picture", self._picture)
        self._runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1.0)
        await self._runner.setup()
        site = web.TCPSite(self._runner, HOST, self._wanted)
        await site.start()
        self.port = int(self._runner.addresses[0][1])

    @web.middleware
    async def _guarded(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Refuse who asks under another name, and send the headers with every answer."""
        if request.headers.get("Host", "").lower() not in (f"{HOST}:{self.port}", f"localhost:{self.port}"):
            response: web.StreamResponse = web.Response(status=403, text="ask for 127.0.0.1\n")
        else:
            try:
                response = await handler(request)
            except web.HTTPException as error:
                response = web.Response(status=error.status, text=f"{error.reason}\n")
        response.headers.update(_HEADERS)
        return response

    async def _current(self, request: web.Request) -> web.Response:
        snapshot = self._state.snapshot()
        self._asked = True
        return web.json_response(_finite(asdict(snapshot)))

    async def _picture(self, request: web.Request) -> web.Response:
        is_over = self._state.snapshot().stage != "watching"
        data = await asyncio.get_running_loop().run_in_executor(None, picture_of, self._state)
        if is_over:
            # A page asks for the picture last.
            self._loop.call_later(_AFTER_S, self._end_asked.set)
        if data is None:
            return web.Response(status=204)
        return web.Response(body=data, content_type="image/jpeg")


def picture_of(state: WatchState) -> bytes | None:
    """The newest picture with what is seen in it, as JPEG; None where there is none."""
    image, places, numbers = state.picture()
    if image is None:
        return None
    marks = [Mark(name=name, place=place, colour=colour_of(numbers[name])) for name, place in places.items()]
    drawn = draw(image, marks)
    scale = _LARGEST_PX / max(drawn.shape)
    shown = cv2.resize(drawn, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA) if scale < 1.0 else drawn
    _, data = cv2.imencode(".jpg", shown, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    return data.tobytes()


def _finite(value: object) -> object:
    """The same with None for what is no number, which JSON has no word for."""
    if isinstance(value, dict):
        return {name: _finite(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value if not isinstance(value, float) or abs(value) < float("inf") else None


async def _static(request: web.Request) -> web.Response:
    name, kind = _STATIC[request.path]
    text = files("mtm_audit.live").joinpath(name).read_text(encoding="utf-8")
    return web.Response(text=text, content_type=kind, charset="utf-8")

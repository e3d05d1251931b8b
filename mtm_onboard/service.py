"""The thread that does what a link needs between commands, such as heartbeats."""

import threading
from types import TracebackType
from typing import Self

from mtm_onboard.clock import Clock
from mtm_onboard.transports.base import Transport


class ServiceThread:
    """Calls `transport.service` each `service_period_s` while its block runs; the first failure ends it.

    `error` holds that failure, and whoever runs the loop stops the robot for it.
    """

    def __init__(self, transport: Transport, clock: Clock) -> None:
        self.error: Exception | None = None
        self._transport = transport
        self._clock = clock
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name="service", daemon=True)

    def _run(self) -> None:
        try:
            while not self._ending.is_set():
                self._transport.service(self._clock.now())
                self._ending.wait(self._transport.service_period_s)
        except Exception as error:
            self.error = error

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._ending.set()
        self._thread.join()

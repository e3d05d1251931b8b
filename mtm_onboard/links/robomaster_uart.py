"""The RoboMaster EP's UART."""

from mtm_onboard.links.byte_stream import ByteStream, serial_stream
from mtm_onboard.links.plaintext_messages import BAUDRATE
from mtm_onboard.links.robomaster_plaintext import RoboMasterPlaintext


class RoboMasterUart(RoboMasterPlaintext):
    """The robot's UART behind the serial `port`, at 115200 baud unless said otherwise."""

    def __init__(self, port: str, baudrate: int = BAUDRATE) -> None:
        super().__init__()
        self._port = port
        self._baudrate = baudrate

    def _connect(self) -> ByteStream:
        return serial_stream(self._port, self._baudrate)

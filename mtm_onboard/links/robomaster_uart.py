"""The RoboMaster EP's UART."""

from mtm_onboard.links.byte_link import ByteLink, serial_link
from mtm_onboard.links.plaintext_messages import BAUDRATE
from mtm_onboard.links.robomaster_plaintext import RoboMasterPlaintext


class RoboMasterUart(RoboMasterPlaintext):
    """The robot's UART behind the serial `port`, at 115200 baud unless said otherwise."""

    def __init__(self, port: str, baudrate: int = BAUDRATE) -> None:
        super().__init__()
        self._port = port
        self._baudrate = baudrate

    def _connect(self) -> ByteLink:
        return serial_link(self._port, self._baudrate)

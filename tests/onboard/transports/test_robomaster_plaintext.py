import pytest

from tests.onboard.transports.conformance import Rig, TransportConformance
from tests.onboard.transports.plaintext_rig import plaintext_rig


class TestRoboMasterPlaintextConforms(TransportConformance):
    @pytest.fixture(params=["memory", "pty", "tcp"])
    def rig(self, request):
        with plaintext_rig(request.param) as rig:
            yield Rig(rig.transport, rig.controller, rig.plant, rig.clock, rig.sent_bytes)

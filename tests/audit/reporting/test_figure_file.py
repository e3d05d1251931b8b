"""Figures carry the mark of the command that drew them, in every format, so that it may draw them again."""

import pytest
from matplotlib.figure import Figure

from mtm_audit.reporting.figure_file import save_figure
from mtm_audit.reporting.plot import SUFFIXES
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.output_file import check_outputs


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".PNG"])
def test_a_figure_is_drawn_again_by_its_own_command_alone(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    for _ in range(2):
        check_outputs("mtm-audit decode", path)
        save_figure(Figure(figsize=(1.0, 1.0)), path, "mtm-audit decode")
    with pytest.raises(MtmError, match="was not made by mtm-audit plan"):
        check_outputs("mtm-audit plan", path)

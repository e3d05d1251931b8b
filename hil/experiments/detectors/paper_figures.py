"""The paper's RoboMaster figures, printed beside ours (tab:robomaster-indep and tab:null)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class PaperFigure:
    """Accuracies in percent and the margin, which the null conditions lack; n = 20 rollouts of four robots."""

    symbol_percent: float
    message_percent: float | None = None
    margin: float | None = None


MESSAGE_TICKS = (200, 400, 600, 800, 1000, 1200)
NULL_TICKS = 600
MESSAGE = {
    200: PaperFigure(88.8, 65.0, 0.102),
    400: PaperFigure(98.8, 95.0, 0.239),
    600: PaperFigure(100.0, 100.0, 0.278),
    800: PaperFigure(100.0, 100.0, 0.317),
    1000: PaperFigure(100.0, 100.0, 0.336),
    1200: PaperFigure(100.0, 100.0, 0.354),
}
MARGINS = {ticks: figure.margin for ticks, figure in MESSAGE.items() if figure.margin is not None}
WRONG_KEY = PaperFigure(25.25)
NO_MESSAGE = PaperFigure(16.67)

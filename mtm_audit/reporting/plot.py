"""One picture of a decode: where the robots went, what each symbol scored, and how much evidence there is."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.drawing.output import check_output_path
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.figure_file import save_figure
from mtm_audit.reporting.panels.evidence import draw_evidence
from mtm_audit.reporting.panels.scores import draw_margins, draw_scores
from mtm_audit.reporting.panels.style import TEXT_COLOUR, VERDICT_COLOURS, plain
from mtm_audit.reporting.panels.tracks import draw_tracks
from mtm_audit.reporting.still import still_of
from mtm_audit.reporting.subject import now, subject_line
from mtm_audit.reporting.text import chance_sentence, verdict_sentence

SUFFIXES = (".png", ".pdf", ".svg")


def check_plot_path(path: Path) -> None:
    """Raise MtmError unless a picture can be written to `path`; meant for the time before the long work."""
    check_output_path(path, SUFFIXES)


def draw_plot(recording: Recording, decoding: Decoding, path: Path) -> None:
    """Draw the decode into `path`, whole or not at all; raises MtmError as `check_plot_path` does."""
    check_plot_path(path)
    figure = Figure(figsize=(11.0, 7.6), dpi=100, layout=ConstrainedLayoutEngine(w_pad=0.15, h_pad=0.12))
    FigureCanvasAgg(figure)
    colour = VERDICT_COLOURS[decoding.verdict]
    figure.suptitle(plain(verdict_sentence(decoding)), fontsize=16, fontweight="bold", color=colour)
    about = f"{chance_sentence(decoding)}\n{plain(subject_line(recording, decoding, now()))}"
    figure.supxlabel(about, fontsize=9, color=TEXT_COLOUR)
    still = still_of(recording)
    height_px = None if still is None else still.size_px[1]
    if decoding.verdict == "absent":
        # Scores of a recording without a message would be chance, and would look like symbols.
        tracks, evidence = figure.subplots(1, 2)
        draw_tracks(tracks, recording.tracks, height_px)
        draw_evidence(evidence, decoding)
    else:
        (tracks, scores), (evidence, margins) = figure.subplots(2, 2, height_ratios=(1.25, 1.0))
        draw_tracks(tracks, recording.tracks, height_px)
        draw_scores(scores, decoding)
        draw_evidence(evidence, decoding)
        draw_margins(margins, decoding)
    save_figure(figure, path, "mtm-audit decode")

"""Draw the figures of a run and write its report and manifest."""

from tiegocancel.report.figures import draw_figures
from tiegocancel.report.manifest import input_record, write_manifest
from tiegocancel.report.page import write_page

__all__ = ["draw_figures", "input_record", "write_manifest", "write_page"]

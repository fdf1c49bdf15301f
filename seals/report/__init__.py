"""Reports: one HTML file that works offline, from charts, tables and words; charts as pictures."""

from seals.report.blocks import Block, Code, Facts, Fold, Paragraph, Section, Table
from seals.report.figures import Chart, Mark, Series
from seals.report.page import page, write_page
from seals.report.pictures import write_picture

__all__ = [
    "Block",
    "Chart",
    "Code",
    "Facts",
    "Fold",
    "Mark",
    "Paragraph",
    "Section",
    "Series",
    "Table",
    "page",
    "write_page",
    "write_picture",
]

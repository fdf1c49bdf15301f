"""Reports: self-contained HTML pages of charts, tables and text; charts as images."""

from seals.report.bars import Bar, Bars
from seals.report.blocks import (
    Block,
    Choice,
    Code,
    Facts,
    Fold,
    Paragraph,
    Section,
    Table,
)
from seals.report.figures import Chart, Mark, Series
from seals.report.page import page, write_page
from seals.report.pictures import write_picture

__all__ = [
    "Bar",
    "Bars",
    "Block",
    "Chart",
    "Choice",
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

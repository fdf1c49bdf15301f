"""Reports: self-contained HTML pages of charts, tables and text; charts as images."""

from seals.report.bars import Bar as Bar
from seals.report.bars import Bars as Bars
from seals.report.blocks import Block as Block
from seals.report.blocks import Choice as Choice
from seals.report.blocks import Code as Code
from seals.report.blocks import Facts as Facts
from seals.report.blocks import Fold as Fold
from seals.report.blocks import Paragraph as Paragraph
from seals.report.blocks import Section as Section
from seals.report.blocks import Table as Table
from seals.report.figures import Chart as Chart
from seals.report.figures import Mark as Mark
from seals.report.figures import Series as Series
from seals.report.page import page as page
from seals.report.page import write_page as write_page
from seals.report.pictures import write_picture as write_picture

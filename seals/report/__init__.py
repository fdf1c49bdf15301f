"""Reports: self-contained HTML pages of charts, tables and text; charts as images."""

from seals.report.bars import Bar as Bar
from seals.report.bars import Bars as Bars
from seals.report.figures import Chart as Chart
from seals.report.figures import Mark as Mark
from seals.report.figures import Series as Series
from seals.report.page import Block as Block
from seals.report.page import Choice as Choice
from seals.report.page import Code as Code
from seals.report.page import Facts as Facts
from seals.report.page import Fold as Fold
from seals.report.page import Paragraph as Paragraph
from seals.report.page import Section as Section
from seals.report.page import Table as Table
from seals.report.page import page as page
from seals.report.page import write_page as write_page
from seals.report.pictures import write_picture as write_picture

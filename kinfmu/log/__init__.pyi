"""The public names: the package imports each from where it is listed here, when it is first used."""

from kinfmu.log.growing import McapLog as McapLog
from kinfmu.log.reading import read as read
from kinfmu.log.reading import recover as recover
from kinfmu.log.table import write_table as write_table
from kinfmu.log.viewer.live import LiveView as LiveView
from kinfmu.log.viewer.rerun_file import write_rrd as write_rrd
from kinfmu.log.viewer.reviewing import review as review
from kinfmu.log.writing import write_mcap as write_mcap

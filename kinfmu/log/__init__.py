"""Files of runs: MCAP as the permanent record, Rerun recordings for viewing, tables for other programs.

    write: Run -> writing | growing -> record, topics, cdr -> mcap_writer -> file      whole, or while a run goes on
    read:  file -> mcap_reader -> reading -> record -> Run                             complete, or cut off (`recover`)
    view:  Run -> viewer/ -> Rerun recording;  tables: Run -> table -> .csv .parquet .npz

The writers and readers load their packages (zstandard, rerun, pyarrow) when first used, not on import.
"""

from __future__ import annotations

from kinfmu.log.growing import McapLog
from kinfmu.log.reading import read, recover
from kinfmu.log.table import write_table
from kinfmu.log.viewer.live import LiveView
from kinfmu.log.viewer.rerun_file import write_rrd
from kinfmu.log.viewer.reviewing import review
from kinfmu.log.writing import write_mcap

__all__ = ["LiveView", "McapLog", "read", "recover", "review", "write_mcap", "write_rrd", "write_table"]

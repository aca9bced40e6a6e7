"""Files of runs: MCAP as the permanent record, Rerun recordings for viewing, tables for other programs.

    write: Run -> writing | growing -> record, topics, cdr -> mcap_writer -> file      whole, or while a run goes on
    read:  file -> mcap_reader -> reading -> record -> Run                             complete, or cut off (`recover`)
    view:  Run -> viewer/ -> Rerun recording;  tables: Run -> table -> .csv .parquet .npz

The writers and readers load their packages (zstandard, rerun, pyarrow) when first used, not on import.
"""

from kinfmu import _lazy

__all__, __getattr__, __dir__ = _lazy(globals())

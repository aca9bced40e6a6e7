"""Tests of kinfmu; the folders mirror its packages."""

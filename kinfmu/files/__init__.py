"""Files that are written completely or not at all, and suffixes of file names."""

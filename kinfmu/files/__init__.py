"""Files: written whole or not at all, and how their names end."""

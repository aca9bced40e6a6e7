"""The version of kinfmu, which packages below the public names also write into their files."""

VERSION = "0.1.0"

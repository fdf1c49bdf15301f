"""A hexacopter as others describe theirs: what `seals new robot` starts from."""

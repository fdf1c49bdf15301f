"""Public logs with a hidden effect, their truth and score: `seals benchmark`.

`benchmarks/naming_set.py` made the logs; `README.md` tells what they hold.
"""

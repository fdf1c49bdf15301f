"""Comparison of generated text files whose numbers come out of arithmetic."""

from __future__ import annotations

import re

import numpy as np

_NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")


def same_text(one: str, other: str, where: str) -> None:
    """Assert that two texts agree word for word and that their numbers agree.

    Numbers are written with six digits or as multiples of 1e-5; on another processor the last digit
    may be rounded the other way. What is zero in one must be smaller than half a last digit in the
    other, and in scientific notation zero.

    Args:
        one: generated text.
        other: text of the file that ships.
        where: name of the file, for the message.
    """
    assert _NUMBER.sub("#", one) == _NUMBER.sub("#", other), where
    first, second = (_NUMBER.findall(text) for text in (one, other))
    for a, b in zip(first, second, strict=True):
        if a == b:
            continue
        assert "." in a + b, f"{where}: {a} in place of {b}"
        digit = 0.0 if "e" in a + b else 1.01e-5
        np.testing.assert_allclose(float(a), float(b), rtol=1e-5, atol=digit, err_msg=where)

"""Vector algebra over any scalars."""

import itertools
import struct

from proofroll.truth.numerics.scalars import add, cross, dot, mul, sub

NUMBERS = (0.0, 1.0, -1.0, 0.3)


def bits(values: list[float]) -> bytes:
    """The numbers with their last digit and the signs of their zeros."""
    return struct.pack(f"{len(values)}d", *values)


def test_vectors_of_floats_are_multiplied_as_folded_ones() -> None:
    """Products of plain floats are those of folded terms to the last bit, without negative zeros."""
    for a, b in itertools.product(itertools.product(NUMBERS, repeat=3), repeat=2):
        (ax, ay, az), (bx, by, bz) = a, b
        pairs = ((ay, bz, az, by), (az, bx, ax, bz), (ax, by, ay, bx))
        folded = [sub(mul(p, q), mul(r, s)) for p, q, r, s in pairs]
        assert bits([dot(a, b), *cross(a, b)]) == bits([add(*map(mul, a, b)), *folded])

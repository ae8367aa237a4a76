"""Sentences on mistakes of bookkeeping."""

from __future__ import annotations

from air_robots import law_of, legged

from proofroll.robots.control.bookkeeping.mistakes import mistakes


def test_a_size_that_is_nothing_is_0() -> None:
    """Round-off of a size is told as 0, without a sign; an armature beside none may be small."""
    law = law_of(legged())
    gravity = next(item for item in mistakes(law) if item.id == "gravity")
    assert gravity.sentence(-1e-14) == gravity.sentence(3e-9) == "gravity is 0 of the right one"
    armature = next(item for item in mistakes(law.change(armature=0 * law.armature)) if item.id == "armature")
    assert armature.sentence(5e-7) == "there is an armature of 5e-07 kg m²"

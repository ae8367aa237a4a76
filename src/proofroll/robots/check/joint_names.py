"""Partners of joints of two robot files whose names differ by a prefix or a suffix."""

from collections.abc import Iterator, Mapping

from proofroll.core.errors import InputError
from proofroll.robots.model import Robot

_ANY = "*"  # stands for the common part of two names
# A pair of patterns ``front*back``, for names of the first and of the second robot.
_Patterns = tuple[str, str]


def with_patterns(names: Mapping[str, str], robot: Robot, rival: Robot) -> dict[str, str]:
    """Partners of joints, patterns replaced by the pairs of names that fit them; a pair without ``*`` wins.

    Args:
        names: joint of the first robot -> joint of the second; or ``front*back`` -> ``front*back``.
        robot: the first robot.
        rival: the second robot.

    Raises:
        InputError: a pattern has no or several ``*`` on one side, or fits no pair of joints.
    """
    pairs: dict[str, str] = {}
    for pattern, image in names.items():
        if _ANY not in pattern + image:
            continue
        if pattern.count(_ANY) != 1 or image.count(_ANY) != 1:
            raise InputError("--map", f"{pattern}={image}", "write one * on each side: it is the part both names have")
        fitting = _pairs((pattern, image), robot, rival)
        if not fitting:
            raise InputError("--map", f"{pattern}={image}", "it fits no joint of the first file with one of the second")
        pairs |= fitting
    return pairs | {pattern: image for pattern, image in names.items() if _ANY not in pattern + image}


def proposed_patterns(robot: Robot, rival: Robot, matched: Mapping[str, str]) -> tuple[str, dict[str, str]]:
    """Argument of ``--map`` that gives the most joints partners of the same kind and place in the tree.

    Args:
        robot: the first robot.
        rival: the second robot.
        matched: joint of the first robot -> its partner in the second, for those that have one.

    Returns:
        The argument, ``"panda_*=*"``, and the partners that it adds; empty where no prefix or suffix gives any.
    """
    lonely = [joint.name for joint in robot.moving if joint.name not in matched]
    partners = set(matched.values())
    lonely_there = [joint.name for joint in rival.moving if joint.name not in partners]
    best: tuple[str, dict[str, str]] = ("", {})
    tried: set[_Patterns] = set()
    for patterns in (pair for name in lonely for partner in lonely_there for pair in _differences(name, partner)):
        if patterns in tried:
            continue
        tried.add(patterns)
        fitting = {name: partner for name, partner in _pairs(patterns, robot, rival).items() if name in lonely}
        if set(fitting.values()) <= set(lonely_there) and _same_tree({**matched, **fitting}, fitting, robot, rival):
            best = max(best, ("=".join(patterns), fitting), key=lambda item: len(item[1]))
    return best


def _differences(name: str, partner: str) -> Iterator[_Patterns]:
    """Patterns of two names with a common end, and of two names with a common beginning."""
    if back := _common(name[::-1], partner[::-1]):
        yield name[:-back] + _ANY, partner[:-back] + _ANY
    if front := _common(name, partner):
        yield _ANY + name[front:], _ANY + partner[front:]


def _common(text: str, second: str) -> int:
    """Number of equal characters at the beginning of two texts."""
    return next(
        (count for count, (a, b) in enumerate(zip(text, second, strict=False)) if a != b), min(len(text), len(second))
    )


def _pairs(patterns: _Patterns, robot: Robot, rival: Robot) -> dict[str, str]:
    """Joints of two robots whose names fit two patterns with the same part in place of ``*``."""
    front, _, back = patterns[0].partition(_ANY)
    rival_names = {joint.name for joint in rival.moving}
    pairs: dict[str, str] = {}
    for joint in robot.moving:
        name = joint.name
        if len(name) >= len(front) + len(back) and name.startswith(front) and name.endswith(back):
            image = patterns[1].replace(_ANY, name[len(front) : len(name) - len(back)])
            pairs |= {name: image} if image in rival_names else {}
    return pairs


def _same_tree(partners: Mapping[str, str], added: Mapping[str, str], robot: Robot, rival: Robot) -> bool:
    """True if added partners are of one kind, and the nearest joints before them that have partners are partners."""
    kinds = [{joint.name: joint.kind for joint in tree.moving} for tree in (robot, rival)]
    back = {theirs: ours for ours, theirs in partners.items()}
    for ours, theirs in added.items():
        carrier = next((name for name in _ancestors(robot, ours) if name in partners), None)
        before_there = next((name for name in _ancestors(rival, theirs) if name in back), None)
        if kinds[0][ours] != kinds[1][theirs] or (carrier and partners[carrier]) != before_there:
            return False
    return True


def _ancestors(robot: Robot, name: str) -> Iterator[str]:
    """Moving joints between a joint and the world, the nearest first."""
    parents = {joint.name: robot.welded[joint.parent][0] for joint in robot.moving}
    while name := parents[name]:
        yield name

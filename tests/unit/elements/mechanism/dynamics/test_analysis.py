"""Decisions about rank and determinate reactions, and how far they are from being others."""

import numpy as np
import pytest

from proofroll.elements.mechanism import Tree
from proofroll.elements.mechanism.dynamics.analysis import freedom, general_place, rank_of, singular_values
from proofroll_drill.referee.random_mechanisms import random_mechanism

LOOPS = ("bricard", "slider_crank", "four_bar", "andrews_squeezer", 1, 3, 5, 7, 9, 11, 13, 15, 17, 19)
# Round-off leaves 2e-15 under three kinds of arithmetic; what counts is 5e-3 and more, over these and 80 random loops.
NOTHING, SOMETHING = 1e-12, 1e-4


def general(mechanism):
    """The tree, a general pose near the start, and the rows there."""
    tree, still = Tree(mechanism), np.zeros(mechanism.nv)

    def of_loops(q):
        rows = tree.loop_rows(tree.at(q, still))
        return rows.residual, rows.C

    motion = tree.at(general_place(mechanism.start()[0], of_loops, tree.moved), still)
    return tree, motion, tree.loop_rows(motion)


@pytest.mark.parametrize("which", LOOPS)
def test_no_decision_about_loops_lies_near_round_off(scene, which):
    """Singular values and the freedom of reactions are nothing or something, four orders from where they are told."""
    mechanism = random_mechanism(which)[1] if isinstance(which, int) else scene(which)
    tree, motion, rows = general(mechanism)
    values = singular_values(rows.C) / singular_values(rows.C)[0]
    free = freedom(tree, motion, rows, rank_of(values))
    for sizes in (values, free):
        assert ((sizes < NOTHING) | (sizes > SOMETHING)).all()


def test_freedom_of_reactions_hangs_on_no_basis(scene, monkeypatch):
    """Null vectors may be found in any basis, as another processor finds them: what is determinate stays so."""
    tree, motion, rows = general(scene("slider_crank"))
    rank = rank_of(singular_values(rows.C))
    usual, svd = freedom(tree, motion, rows, rank), np.linalg.svd
    mixed = np.linalg.qr(np.random.default_rng(0).normal(size=(len(rows.C) - rank,) * 2))[0]

    def in_another_basis(*args, **options):
        U, S, Vt = svd(*args, **options)
        return np.hstack([U[:, :rank], U[:, rank:] @ mixed]), S, Vt

    monkeypatch.setattr(np.linalg, "svd", in_another_basis)
    assert freedom(tree, motion, rows, rank) == pytest.approx(usual, abs=1e-13)

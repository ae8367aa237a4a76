"""Clusters as plug-ins: what is asked of the package that brings them."""

from __future__ import annotations

import pytest

from proofroll.core.errors import Missing
from proofroll.running import cluster


def test_a_package_that_is_not_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no package brings clusters, an address is answered with how to install one."""
    monkeypatch.setattr(cluster, "loaded", lambda _: [])
    with pytest.raises(Missing, match="pip install proofroll-cluster"):
        cluster.connected("local")


def test_the_address_reaches_the_package(monkeypatch: pytest.MonkeyPatch) -> None:
    """The class that a package announces is made with the address."""
    monkeypatch.setattr(cluster, "loaded", lambda group: [(group, lambda address: (group, address))])
    assert cluster.connected("tcp://there:1") == ("proofroll.clusters", "tcp://there:1")

"""Machines on which a runner's cases run: a plug-in, found by the entry point ``proofroll.clusters``."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, TypeVar, cast

from proofroll.core.entry_points import loaded
from proofroll.core.errors import Missing
from proofroll.running.case import Case, Result

Item = TypeVar("Item")
Found = TypeVar("Found")
Make = Callable[[Path], Result]
Arrived = Callable[[Case, Make], object]


class Cluster(Protocol):
    """Runs the cases of a runner, and functions, on other machines; made with the address of its scheduler."""

    @property
    def threads(self) -> int:
        """Number of cases that it runs at once."""

    def serve(
        self, take: Callable[[str | None], Case | None], arrived: Arrived, failed: Callable[[Exception], None]
    ) -> None:
        """Sends cases of a runner until there are no more.

        Args:
            take: gives the next case, preferably of the named engine; None: there are no more.
            arrived: called in any thread with a case and a function that writes its trajectory and returns its result.
            failed: called with an error that ends the whole run.
        """

    def map(self, function: Callable[[Item], Found], items: Sequence[Item]) -> Iterator[tuple[str, Found]]:
        """Yields the machine's name and a function's result for each item, in order, from watched processes.

        The function and its results must be picklable.

        Raises:
            ProofrollError: a process or the scheduler ended, or the function raised it.
        """

    def stop(self) -> None:
        """Ends the running and waiting cases of this command on the cluster."""


def connected(address: str) -> Cluster:
    """Cluster of a scheduler's address.

    Raises:
        InputError: the address is invalid, or no scheduler answers there.
        Missing: no package of clusters is installed.
    """
    for _, cluster in loaded("proofroll.clusters"):
        return cast(Cluster, cluster(address))
    raise Missing("--scheduler needs a package of its own: pip install proofroll-cluster; in a clone, ./cluster")

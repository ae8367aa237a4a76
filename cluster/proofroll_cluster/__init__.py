"""Cases of proofroll on a Dask cluster, behind the option ``--scheduler`` of its commands."""

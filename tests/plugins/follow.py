"""Script for a worker process (by ``runpy.run_path``): changes to the folder of the test that borrows the worker."""

import os

os.chdir(globals()["folder"])
globals().clear()  # remaining globals would be the worker's answer

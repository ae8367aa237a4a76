"""Run in a worker process, by ``runpy.run_path``: it goes to the folder of the test that borrows it."""

import os

os.chdir(globals()["folder"])
globals().clear()  # what is left here would be the answer

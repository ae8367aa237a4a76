"""The fault drill: what an engine, a disk or a person can do to a run is done on purpose, and must cost nothing else.

The engine of the drill is announced only while a drill runs, by a folder on the path of its processes.
"""

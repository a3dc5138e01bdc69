"""Reading by other libraries (Gmsh, meshio, netCDF4), in a process of its own with limits.

A damaged file can crash these libraries, keep them busy for ever or have them ask for all memory there is. `process.contents`
starts `child.main`, which reads one file by one of the modules `by_*` and sends what it holds in the form of `wire`.
"""

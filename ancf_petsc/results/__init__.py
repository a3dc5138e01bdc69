"""What a run leaves: HDF5 with an XDMF beside it, tables, a summary; and the reader of them."""

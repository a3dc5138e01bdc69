"""What a case means on its mesh, worked out on the root rank before anything is distributed."""

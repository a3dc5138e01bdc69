"""Elements in absolute nodal coordinates: codes, shape functions, quadrature and the catalogue."""

"""`python -m ancf_petsc` is the command `ancf`."""

import sys

from ancf_petsc.cli import main

if __name__ == "__main__":
    sys.exit(main())

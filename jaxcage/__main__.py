"""`python -m jaxcage` is the `jaxcage` command."""

import sys

from .cli import main


sys.exit(main())

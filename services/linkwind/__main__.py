"""``python -m linkwind``."""

from linkwind.cli import main

main()
